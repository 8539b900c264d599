//! The FKM method from noisy measurements: the covariance is right, the error is at the Cramér–Rao
//! bound, the gains are above the paper's; and the evaluation that says so.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss,
    // 0 and 100 are exact.
    clippy::float_cmp
)]

use delta_cal::{Noise, Robot, Sample, Settings, Tolerance};
use delta_cal_host::CalibrationMethod;
use delta_cal_host::accuracy::evaluation::{CramerRaoBound, Evaluation, differences};
use delta_cal_host::fit::fkm;
use delta_cal_tests::documents::print_documented;
use delta_cal_tests::noisy_campaign::{Calibrated, NoisyCampaign, Trial};
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed};
use nalgebra::SMatrix;

/// The document with the figures.
const BENCHMARKS: &str = "docs/benchmarks.md";

/// A robot off by up to 1 cm and 1°, measured exactly.
fn case(campaign: u64, robot: u64, count: usize) -> (Robot<f64>, Vec<Sample<f64>>) {
    let mut rng = generator(campaign, robot);
    let angle = 1f64.to_radians();
    let truth = perturbed(&paper_robot(), 10.0, angle, Spread::Uniform, &mut rng);
    let samples = measurements(&truth, count, None, &mut rng);
    (truth, samples)
}

/// The FKM method on one robot.
fn calibrated(trial: &Trial<'_>) -> Option<Calibrated> {
    let truth = trial.truth;
    let outcome = fkm::calibrate(trial.nominal, trial.samples, trial.settings).ok()?;
    let evaluation = Evaluation {
        truth,
        before: trial.nominal,
        after: &outcome.fit.robot,
    };
    let covariance = outcome.covariance.unwrap();
    let sigmas = (0..24).map(|index| {
        let is_angle = index % 8 == 3 || index % 8 == 4;
        let unit = if is_angle {
            truth.arms()[index / 8].upper_arm_length()
        } else {
            1.0
        };
        covariance[(index, index)].sqrt() * unit
    });
    let joints: Vec<_> = trial.samples.iter().map(|sample| sample.joints).collect();
    let (method, tolerance) = (CalibrationMethod::Fkm, trial.settings.tolerance.as_ref());
    let bound = CramerRaoBound::new(method, truth, &joints, trial.noise, tolerance).unwrap();
    Some(Calibrated {
        gain: evaluation.gain(),
        errors: differences(&outcome.fit.robot, truth)
            .iter()
            .copied()
            .collect(),
        sigmas: sigmas.collect(),
        bound_squared: bound.error().powi(2),
    })
}

fn rms(squares: &[f64]) -> f64 {
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn z_scores_have_rms_between_0_9_and_1_1_and_errors_reach_the_cramer_rao_bound() {
    let degree = 1f64.to_radians();
    for (number, poses, noise) in [
        (61, 20, (0.001, 0.001 * degree)),
        (62, 20, (0.01, 0.01 * degree)),
        (63, 40, (0.05, 0.002 * degree)),
        (64, 60, (0.001, 0.01 * degree)),
    ] {
        let result = NoisyCampaign {
            number,
            robots: 300,
            poses,
            start_error: (1.0, degree),
            noise,
            spread: Spread::Uniform,
            prior: false,
        }
        .run(calibrated);
        let z = result.z_rms();
        let ratio = result.error_over_bound();
        print_documented(
            BENCHMARKS,
            &format!(
                "| FKM | {poses} | {} mm, {}° | {z:.3} | {ratio:.3} |",
                noise.0,
                // Back to the number above.
                (noise.1 / degree * 1e9).round() / 1e9
            ),
        );
        assert_eq!(result.refused, 0);
        assert!((0.9..=1.1).contains(&z), "{poses} poses: z rms {z}");
        // 7,200 numbers whose own scatter is some 3 %, heavy-tailed poses included: as the IKM
        // method's.
        assert!(
            (0.9..=1.1).contains(&ratio),
            "{poses} poses: error over bound {ratio}"
        );
    }
}

#[test]
fn with_a_prior_the_covariance_is_right_for_robots_drawn_from_it() {
    let degree = 1f64.to_radians();
    for (number, poses) in [(66, 5), (67, 8), (68, 20)] {
        let result = NoisyCampaign {
            number,
            robots: 300,
            poses,
            start_error: (0.1, 0.1 * degree),
            noise: (0.001, 0.01 * degree),
            spread: Spread::Normal,
            prior: true,
        }
        .run(calibrated);
        let z = result.z_rms();
        let ratio = result.error_over_bound();
        println!("{poses} poses with prior: z rms {z:.3}, error/bound {ratio:.3}");
        assert_eq!(result.refused, 0);
        assert!((0.9..=1.1).contains(&z), "{poses} poses: z rms {z}");
        assert!(
            (0.9..=1.1).contains(&ratio),
            "{poses} poses: error over bound {ratio}"
        );
    }
}

/// The paper's FKM noise case: start error 0.1 mm/0.1°, σx 1 µm, σq 0.01°; its gains are −38.54, 20,
/// 38 and 45.38 %.
#[test]
fn with_a_prior_every_gain_is_above_the_papers_and_positive() {
    let degree = 1f64.to_radians();
    for (number, poses, paper) in [
        (71, 8, -38.54),
        (72, 20, 20.0),
        (73, 40, 38.0),
        (74, 60, 45.38),
    ] {
        let result = NoisyCampaign {
            number,
            robots: 300,
            poses,
            start_error: (0.1, 0.1 * degree),
            noise: (0.001, 0.01 * degree),
            spread: Spread::Uniform,
            prior: true,
        }
        .run(calibrated);
        let median = result.median_gain();
        println!(
            "{poses} poses: median gain {median:.1} %, worst robot {:.1} %; paper {paper} %",
            result.gains[0]
        );
        assert_eq!(result.refused, 0);
        assert!(median > 0.0 && median > paper, "{poses} poses: {median} %");
    }
}

/// Without joint noise the FKM method's bound is that of least squares on the positions. The IKM
/// method's, whose weights leave the correlation between the arms' closure errors out of account, is
/// never below it, and equal where the joints' noise, which has none, is all there is.
#[test]
fn bounds_are_those_of_the_measurements() {
    let degree = 1f64.to_radians();
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for robot in 0..20 {
        let (truth, samples) = case(75, robot, 20);
        let joints: Vec<_> = samples.iter().map(|sample| sample.joints).collect();
        let noise = Noise::new(0.01, 0.0).unwrap();
        let bound = CramerRaoBound::new(CalibrationMethod::Fkm, &truth, &joints, &noise, None);
        let mut information = SMatrix::<f64, 24, 24>::zeros();
        for sample in &samples {
            let core = truth
                .platform_jacobian(&sample.position, &sample.joints)
                .unwrap();
            let mut jacobian = SMatrix::<f64, 3, 24>::zeros();
            for (arm, block) in core.by_parameters.iter().enumerate() {
                jacobian.fixed_columns_mut::<8>(8 * arm).copy_from(block);
                for angle in [3, 4] {
                    let mut column = jacobian.column_mut(8 * arm + angle);
                    column /= truth.arms()[arm].upper_arm_length();
                }
            }
            information += jacobian.transpose() * jacobian / 0.01f64.powi(2);
        }
        let expected = information.try_inverse().unwrap();
        let found = bound.unwrap();
        // The sums lose twice the condition's digits.
        let error = (found.covariance - expected).norm() / expected.norm();
        assert!(error < 1e-6, "robot {robot}: {error:e}");

        let ratio = |position: f64, joint: f64| {
            let noise = Noise::new(position, joint).unwrap();
            let of = |method| CramerRaoBound::new(method, &truth, &joints, &noise, None).unwrap();
            of(CalibrationMethod::Ikm).error() / of(CalibrationMethod::Fkm).error()
        };
        let (positions, joints) = (ratio(0.01, 0.0), ratio(1e-6, 0.01 * degree));
        (least, most) = (least.min(positions), most.max(positions));
        assert!(positions > 1.0, "robot {robot}: {positions}");
        // σx is 1e-6 mm against some 0.05 mm: its share of the variance is 1e-9.
        assert!((joints - 1.0).abs() < 1e-6, "robot {robot}: {joints}");
    }
    print_documented(
        "docs/method.md",
        &format!("the IKM method's bound is {least:.3} to {most:.3} times that of the FKM method"),
    );
}

#[test]
fn a_gain_is_100_percent_for_the_true_robot_and_0_for_the_unchanged() {
    let (truth, samples) = case(76, 0, 5);
    let nominal = paper_robot::<f64>();
    let joints: Vec<_> = samples.iter().map(|sample| sample.joints).collect();
    let found = Evaluation {
        truth: &truth,
        before: &nominal,
        after: &truth,
    };
    assert_eq!(found.gain(), 100.0);
    assert!(
        found
            .parameter_gains()
            .iter()
            .flatten()
            .all(|gain| *gain == 100.0)
    );
    assert_eq!(found.position_error_after(&joints).rms, 0.0);
    let squares: f64 = samples
        .iter()
        .map(|s| (nominal.forward(&s.joints).unwrap() - s.position).norm_squared())
        .sum();
    let before = found.position_error_before(&joints);
    assert!((before.rms - (squares / 5.0).sqrt()).abs() < 1e-9);
    assert!(before.max >= before.rms && before.unreachable == 0);
    let unchanged = Evaluation {
        after: &nominal,
        ..found
    };
    assert_eq!(unchanged.gain(), 0.0);

    // θ of 120° and of −240° is the same; an angle counts by the true upper arm's length.
    let mut arms = *nominal.arms();
    let mut p = arms[1].parameters();
    p[3] -= std::f64::consts::TAU - 0.01;
    arms[1] = delta_cal::robot::Arm::new(p).unwrap();
    let turned = Robot::new(arms).unwrap();
    let difference = differences(&turned, &nominal);
    assert!((difference[11] - 2.6).abs() < 1e-9);
    assert!((difference.norm() - 2.6).abs() < 1e-9);
}

/// With a tolerance and no stated noise the noise is estimated from the residuals: with 20 poses as well
/// as 36 to 60 spare residuals can, to some 10 %, and the parameters follow.
#[test]
fn a_noise_that_is_not_stated_is_found_beside_a_tolerance() {
    let (length, angle) = (0.1, 0.1f64.to_radians());
    let noise = Noise::new(0.01, 0.0).unwrap();
    let (mut estimates, mut distances) = (Vec::new(), Vec::new());
    for robot in 0..100 {
        let mut rng = generator(79, robot);
        let truth = perturbed(&paper_robot(), length, angle, Spread::Normal, &mut rng);
        let samples = measurements(&truth, 20, Some(&noise), &mut rng);
        let unstated = Settings::default().with_tolerance(Tolerance::new(length, angle).unwrap());
        let stated = unstated.with_noise(noise);
        let [found, expected] = [unstated, stated]
            .map(|settings| fkm::calibrate(&paper_robot(), &samples, &settings).unwrap());
        estimates.push(found.fit.arms[0].estimated_noise.unwrap());
        let covariance = expected.covariance.unwrap();
        for index in 0..24 {
            let of = |robot: &Robot<f64>| robot.arms()[index / 8].parameters()[index % 8];
            let apart = of(&found.fit.robot) - of(&expected.fit.robot);
            distances.push(apart.powi(2) / covariance[(index, index)]);
        }
    }
    estimates.sort_by(f64::total_cmp);
    println!("estimated noise: {:?}", [0, 50, 99].map(|k| estimates[k]));
    println!("parameters apart by {:.3} σ", rms(&distances));
    // The median of 100 estimates that scatter by 1/√(2·36): 0.0015; the largest of them by 3.5 times.
    assert!((estimates[50] - 0.01).abs() < 0.0006);
    assert!(estimates[0] > 0.0058 && estimates[99] < 0.0142);
    // A weight that is wrong by 20 % moves a parameter that the tolerance decides by a fifth of a σ.
    assert!(rms(&distances) < 0.2);
}
