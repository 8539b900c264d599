//! What the gate and the held-out samples report, against the definitions.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

mod innovations;
mod validations;

use delta_cal::stream::{Forgetting, ForgettingError};
use delta_cal::{ArmIndex, Noise, RobotOutcome, Sample};
use delta_cal_tests::closures::{Jacobian, distances};
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed};
use nalgebra::{DVector, SMatrix};

const SIGMA: f64 = 0.02;

fn noise() -> Noise<f64> {
    Noise::new(SIGMA, 0.0).unwrap()
}

fn samples(seed: u64, count: usize) -> Vec<Sample<f64>> {
    let mut rng = generator(660, seed);
    let truth = perturbed(&paper_robot(), 0.3, 0.002, Spread::Normal, &mut rng);
    measurements(&truth, count, Some(&noise()), &mut rng)
}

/// Distances along the forearm and their derivatives, of an arm of the outcome.
fn rows(
    outcome: &RobotOutcome<f64>,
    index: ArmIndex,
    samples: &[Sample<f64>],
) -> (DVector<f64>, Jacobian) {
    distances(&paper_robot(), index, outcome.robot.arm(index), samples)
}

/// (JᵀJ + prior)⁻¹ at one σ of the distances.
fn covariance(jacobian: &Jacobian, sigma: f64, tolerance: bool) -> SMatrix<f64, 8, 8> {
    let mut information = jacobian.tr_mul(jacobian) / (sigma * sigma);
    if tolerance {
        for k in 0..8 {
            let tolerance: f64 = if k == 3 || k == 4 { 0.002 } else { 0.3 };
            information[(k, k)] += tolerance.powi(-2);
        }
    }
    information.try_inverse().unwrap()
}

/// Σ λᵏ = N + 1, of which a sample k ago is λᵏ.
#[test]
fn a_memory_is_a_forgetting_factor() {
    for (samples, factor) in [(1.0_f64, 0.5_f64), (49.0, 0.98), (999.0, 0.999)] {
        let memory = Forgetting::new(samples).unwrap();
        assert!((memory.factor() - factor).abs() < 1e-15);
        assert!((memory.mean_age() - samples).abs() < 1e-12);
    }
    assert_eq!(Forgetting::new(0.999), Err(ForgettingError::TooShort));
    assert_eq!(Forgetting::new(f64::NAN), Err(ForgettingError::TooShort));
    // ε of single precision is 2⁻²³: 2¹⁶ samples and no more.
    assert!(Forgetting::new(65_536.0_f32).is_ok());
    assert_eq!(Forgetting::new(65_540.0_f32), Err(ForgettingError::TooLong));
}
