//! Noisy measurements: the covariance is right, the error is at the Cramér–Rao bound, and the
//! tolerance prior earns what it should.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

use delta_cal::robot::ParameterKind;
use delta_cal::{Calibrator, Noise, Parameter, Robot, RobotOutcome, Sample};
use delta_cal_tests::documents::print_documented;
use delta_cal_tests::noisy_campaign::{Calibrated, NoisyCampaign, Trial};
use delta_cal_tests::{Spread, parameter_differences};
use nalgebra::SMatrix;

/// The document with the figures.
const BENCHMARKS: &str = "docs/benchmarks.md";

/// The IKM method on one robot; the bound is left out with a prior.
fn calibrated(trial: &Trial<'_>) -> Option<Calibrated> {
    let mut calibrator = Calibrator::new(trial.nominal, trial.settings);
    calibrator.add_many(trial.samples).unwrap();
    let outcome = calibrator.solve().ok()?;
    let norm = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    let errors = parameter_differences(&outcome.robot, trial.truth);
    let before = norm(&parameter_differences(trial.nominal, trial.truth));
    let bound_squared = match trial.settings.tolerance {
        None => cramer_rao_bound(trial.truth, trial.samples, trial.noise),
        Some(_) => 0.0,
    };
    Some(Calibrated {
        gain: 100.0 * (1.0 - norm(&errors) / before),
        sigmas: sigmas(&outcome),
        errors,
        bound_squared,
    })
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
            Parameter::ROTARY.map(|parameter| {
                let unit = match parameter.kind() {
                    ParameterKind::Length => 1.0,
                    ParameterKind::Angle | ParameterKind::Ratio => 260.0,
                };
                result.standard_deviation(parameter).unwrap() * unit
            })
        })
        .collect()
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
        let result = NoisyCampaign {
            number,
            robots: 500,
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
                "| IKM | {poses} | {} mm, {}° | {z:.3} | {ratio:.3} |",
                noise.0,
                // Back to the number above.
                (noise.1 / degree * 1e9).round() / 1e9
            ),
        );
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
        let result = NoisyCampaign {
            number,
            robots: 500,
            poses,
            start_error: (0.1, 0.1 * degree),
            noise: (0.001, 0.01 * degree),
            spread: Spread::Normal,
            prior: true,
        }
        .run(calibrated);
        let z = result.z_rms();
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
        let campaign = |prior| NoisyCampaign {
            number,
            robots: 500,
            poses,
            start_error: (0.1, 0.1 * degree),
            noise: (0.001, 0.01 * degree),
            spread: Spread::Uniform,
            prior,
        };
        let with = campaign(true).run(calibrated);
        let without = campaign(false).run(calibrated);
        print_documented(
            BENCHMARKS,
            &format!(
                "| {poses} | {:.0} % | {:.0} % | {:.0} % | {} |",
                with.median_gain(),
                with.gains[0],
                without.median_gain(),
                without.refused
            ),
        );
        assert_eq!(with.refused, 0);
        assert!(
            with.median_gain() >= expected,
            "{poses} poses: {}",
            with.median_gain()
        );
    }
}
