//! Noise, residuals, covariance and the share of the prior.

use crate::outcomes::{SIGMA, calibrate, case, sums};
use delta_cal::calibration::ArmSolver;
use delta_cal::samples::{ArmFactor, NominalArm};
use delta_cal::{ArmIndex, Noise, Parameter, Progress, Settings, Tolerance};
use delta_cal_tests::paper_robot;
use nalgebra::{SMatrix, Vector3};

fn same(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-6 * expected.abs()
}

fn same_matrix(found: &SMatrix<f64, 8, 8>, expected: &SMatrix<f64, 8, 8>) -> bool {
    (found - expected).norm() <= 1e-5 * expected.norm()
}

fn tolerances() -> [f64; 8] {
    [0.3, 0.3, 0.3, 0.002, 0.002, 0.3, 0.3, 0.3]
}

/// With a tolerance the information is JᵀJ/σ² + diag(1/t²), and the prior's share of a parameter is its
/// variance over t².
#[test]
fn the_prior_counts_as_eight_more_measurements() {
    for count in [4, 30] {
        let (_, samples) = case(6, count);
        let settings = Settings::default()
            .with_noise(Noise::new(SIGMA, 0.0).unwrap())
            .with_tolerance(Tolerance::new(0.3, 0.002).unwrap());
        let outcome = calibrate(&samples, &settings).unwrap();
        for (index, arm) in ArmIndex::ALL.into_iter().zip(&outcome.arms) {
            let (_, mut information) = sums(&arm.arm, index, &samples);
            information /= SIGMA * SIGMA;
            let of_samples = information;
            for (k, tolerance) in tolerances().into_iter().enumerate() {
                information[(k, k)] += 1.0 / (tolerance * tolerance);
            }
            let expected = information.try_inverse().unwrap();
            assert!(same_matrix(&arm.covariance.unwrap(), &expected));
            for (k, tolerance) in tolerances().into_iter().enumerate() {
                let share = expected[(k, k)] / (tolerance * tolerance);
                assert!((arm.prior_share[k] - share).abs() < 1e-6, "{k}");
            }
            let determined = (expected * of_samples).trace();
            assert!((arm.degrees_of_freedom - (count as f64 - determined).max(0.0)).abs() < 1e-6);
        }
    }
}

/// A tolerance without a stated noise: the noise that is found in the samples is the one that, had it
/// been stated, would have given the same result.
#[test]
fn the_noise_balanced_against_a_tolerance_could_have_been_stated() {
    let tolerance = Some(Tolerance::new(0.3, 0.002).unwrap());
    for (seed, count) in [(11, 9), (12, 12), (13, 20), (14, 60)] {
        let (_, samples) = case(seed, count);
        let balanced = Settings::default().with_tolerance(tolerance);
        let found = calibrate(&samples, &balanced).unwrap();
        for (index, arm) in ArmIndex::ALL.into_iter().zip(&found.arms) {
            let sigma = arm.estimated_noise.unwrap();
            let (squares, information) = sums(&arm.arm, index, &samples);
            assert!(same(sigma, (squares / arm.degrees_of_freedom).sqrt()));
            // γ at that noise.
            let mut with_prior = information;
            for (k, tolerance) in tolerances().into_iter().enumerate() {
                with_prior[(k, k)] += (sigma / tolerance).powi(2);
            }
            let determined = (with_prior.try_inverse().unwrap() * information).trace();
            let freedom = count as f64 - determined;
            // The rounds end when it has settled: a few, if there are samples enough.
            assert!(count < 20 || arm.iterations < 20, "{}", arm.iterations);
            // It has settled to a hundredth of the noise.
            assert!((arm.degrees_of_freedom / freedom - 1.0).abs() < 0.05);
            let stated = balanced.with_noise(Noise::new(sigma, 0.0).unwrap());
            let reference = NominalArm::new(
                paper_robot().arm(index),
                &Vector3::new(0.0, 0.0, -450.0),
                stated.noise,
            );
            let mut factor = ArmFactor::new(reference);
            for sample in &samples {
                let q = sample.joints[index.index()];
                factor.add(&sample.position, q, index).unwrap();
            }
            let mut solver = ArmSolver::new(&factor, index, &stated).unwrap();
            while solver.step(&factor) == Progress::Working {}
            let other = solver.outcome(&factor).unwrap();
            for parameter in Parameter::ROTARY {
                let apart = (other.arm.get(parameter) - arm.arm.get(parameter)).abs();
                assert!(apart < 0.05 * other.standard_deviation(parameter).unwrap());
            }
        }
    }
}
