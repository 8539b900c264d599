//! Noisy measurements: the covariance is right, the error is at the Cramér–Rao bound, and the
//! tolerance prior earns what it should.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

use delta_cal::{
    Calibrator, Noise, Parameter, ParameterKind, Robot, RobotOutcome, Sample, Settings, Tolerance,
};
use delta_cal_tests::{
    Spread, generator, measurements, paper_robot, parameter_differences, perturbed,
};
use nalgebra::SMatrix;

struct Campaign {
    number: u64,
    robots: u64,
    poses: usize,
    /// mm and radians.
    start_error: (f64, f64),
    noise: (f64, f64),
    spread: Spread,
    prior: bool,
}

/// Gain (4.1) of each robot, z-scores of all parameters, and the sums of squared errors and of
/// predicted variances (angles times the upper arm's length).
struct Result {
    gains: Vec<f64>,
    z_squared: Vec<f64>,
    error_squared: f64,
    bound_squared: f64,
    refused: usize,
}

fn run(campaign: &Campaign) -> Result {
    let nominal = paper_robot::<f64>();
    let (length, angle) = campaign.start_error;
    let noise = Noise::new(campaign.noise.0, campaign.noise.1).unwrap();
    let settings = Settings {
        noise: Some(noise),
        tolerance: campaign
            .prior
            .then(|| Tolerance::new(length, angle).unwrap()),
        ..Settings::default()
    };
    let mut result = Result {
        gains: Vec::new(),
        z_squared: Vec::new(),
        error_squared: 0.0,
        bound_squared: 0.0,
        refused: 0,
    };
    for robot in 0..campaign.robots {
        let mut rng = generator(campaign.number, robot);
        let truth = perturbed(&nominal, length, angle, campaign.spread, &mut rng);
        let samples = measurements(&truth, campaign.poses, Some(&noise), &mut rng);
        let mut calibrator = Calibrator::new(&nominal, &settings);
        calibrator.add_many(&samples).unwrap();
        let Ok(outcome) = calibrator.solve() else {
            result.refused += 1;
            continue;
        };
        let norm = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
        let errors = parameter_differences(&outcome.robot, &truth);
        let before = norm(&parameter_differences(&nominal, &truth));
        result.gains.push(100.0 * (1.0 - norm(&errors) / before));
        for (error, sigma) in errors.iter().zip(sigmas(&outcome)) {
            result.z_squared.push((error / sigma).powi(2));
            result.error_squared += error * error;
        }
        if !campaign.prior {
            result.bound_squared += cramer_rao_bound(&truth, &samples, &noise);
        }
    }
    result.gains.sort_by(f64::total_cmp);
    result
}

/// The trace of the inverse Fisher information of the true robot, angles times the upper arm's
/// length, from the constraint's derivatives (3.21) and a dense inverse.
fn cramer_rao_bound(truth: &Robot<f64>, samples: &[Sample<f64>], noise: &Noise<f64>) -> f64 {
    let mut bound = 0.0;
    for (index, arm) in truth.arms().iter().enumerate() {
        let mut information = SMatrix::<f64, 8, 8>::zeros();
        for sample in samples {
            let (x, q) = (&sample.position, sample.joints[index]);
            let mut row = arm.constraint_by_parameters(x, q);
            row[3] /= 260.0;
            row[4] /= 260.0;
            let variance = (arm.constraint_by_position(x, q).norm() * noise.position()).powi(2)
                + (arm.constraint_by_joint(x, q) * noise.joint()).powi(2);
            information += row * row.transpose() / variance;
        }
        bound += information.try_inverse().unwrap().trace();
    }
    bound
}

/// All 24 σ, angles times the upper arm's length, as `parameter_differences` has them.
fn sigmas(outcome: &RobotOutcome<f64>) -> Vec<f64> {
    outcome
        .arms
        .iter()
        .zip(outcome.robot.arms())
        .flat_map(|(result, _)| {
            Parameter::ALL.map(|parameter| {
                let unit = match parameter.kind() {
                    ParameterKind::Length => 1.0,
                    ParameterKind::Angle => 260.0,
                };
                result.standard_deviation(parameter).unwrap() * unit
            })
        })
        .collect()
}

fn rms(squares: &[f64]) -> f64 {
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn z_scores_have_rms_between_0_9_and_1_1_and_errors_reach_the_cramer_rao_bound() {
    let degree = 1f64.to_radians();
    for (number, poses, noise) in [
        (41, 20, (0.001, 0.001 * degree)),
        (42, 20, (0.01, 0.01 * degree)),
        (43, 40, (0.05, 0.002 * degree)),
        (44, 60, (0.001, 0.01 * degree)),
        (45, 200, (0.1, 0.01 * degree)),
    ] {
        let result = run(&Campaign {
            number,
            robots: 500,
            poses,
            start_error: (1.0, degree),
            noise,
            spread: Spread::Uniform,
            prior: false,
        });
        let z = rms(&result.z_squared);
        let ratio = (result.error_squared / result.bound_squared).sqrt();
        println!("{poses} poses, noise {noise:?}: z rms {z:.3}, error/bound {ratio:.3}");
        assert_eq!(result.refused, 0);
        assert!((0.9..=1.1).contains(&z), "{poses} poses: z rms {z}");
        // 12,000 numbers whose own scatter is some 3 %, heavy-tailed poses included.
        assert!(ratio <= 1.05, "{poses} poses: error over bound {ratio}");
    }
}

#[test]
fn with_a_prior_the_covariance_is_right_for_robots_drawn_from_it() {
    let degree = 1f64.to_radians();
    for (number, poses) in [(46, 5), (47, 8), (48, 20)] {
        let result = run(&Campaign {
            number,
            robots: 500,
            poses,
            start_error: (0.1, 0.1 * degree),
            noise: (0.001, 0.01 * degree),
            spread: Spread::Normal,
            prior: true,
        });
        let z = rms(&result.z_squared);
        println!("{poses} poses with prior: z rms {z:.3}");
        assert_eq!(result.refused, 0);
        assert!((0.9..=1.1).contains(&z), "{poses} poses: z rms {z}");
    }
}

/// The table of the tolerance prior: start error 0.1 mm/0.1°, σx 1 µm, σq 0.01°, median gain.
#[test]
fn the_prior_meets_its_table_of_gains() {
    let degree = 1f64.to_radians();
    for (number, poses, expected) in [
        (51, 8, 52.0),
        (52, 20, 61.0),
        (53, 40, 68.0),
        (54, 60, 69.0),
    ] {
        let campaign = |prior| Campaign {
            number,
            robots: 500,
            poses,
            start_error: (0.1, 0.1 * degree),
            noise: (0.001, 0.01 * degree),
            spread: Spread::Uniform,
            prior,
        };
        let median = |result: &Result| result.gains[result.gains.len() / 2];
        let with = run(&campaign(true));
        let without = run(&campaign(false));
        println!(
            "{poses} poses: gain with prior {:.0} %, worst robot {:.0} %; weights alone {:.0} % ({} refused)",
            median(&with),
            with.gains[0],
            median(&without),
            without.refused
        );
        assert_eq!(with.refused, 0);
        assert!(
            median(&with) >= expected,
            "{poses} poses: {}",
            median(&with)
        );
    }
}
