//! Noise, residuals, covariance and the share of the prior.

use crate::outcomes::{SIGMA, calibrate, case, sums};
use delta_cal::calibration::ArmSolver;
use delta_cal::robot::Arm;
use delta_cal::samples::{ArmFactor, NominalArm};
use delta_cal::{ArmIndex, Noise, Parameter, Progress, Settings, Tolerance};
use delta_cal_tests::{generator, measurements, paper_robot};
use nalgebra::{SMatrix, Vector3};

fn same(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-6 * expected.abs()
}

fn same_matrix(found: &SMatrix<f64, 8, 8>, expected: &SMatrix<f64, 8, 8>) -> bool {
    (found - expected).norm() <= 1e-5 * expected.norm()
}

/// σ² = Σd²/(n − 8); the covariance is Student's, larger by ν/(ν − 2).
#[test]
fn without_a_stated_noise_it_is_estimated() {
    for (seed, count) in [(1, 20), (2, 40), (3, 11)] {
        let (_, samples) = case(seed, count);
        let outcome = calibrate(&samples, &Settings::default()).unwrap();
        for (index, arm) in ArmIndex::ALL.into_iter().zip(&outcome.arms) {
            let (squares, information) = sums(&arm.arm, index, &samples);
            let count = count as f64;
            assert!(same(arm.residual_rms, (squares / count).sqrt()));
            assert!(same(
                arm.estimated_noise.unwrap(),
                (squares / (count - 8.0)).sqrt()
            ));
            assert!(same(arm.degrees_of_freedom, count - 8.0));
            let inverse = information.try_inverse().unwrap();
            let expected = inverse * (squares / (count - 10.0));
            assert!(same_matrix(&arm.covariance.unwrap(), &expected));
            for parameter in Parameter::ROTARY {
                let k = parameter.index();
                let sigma = arm.standard_deviation(parameter).unwrap();
                assert!(same(sigma, expected[(k, k)].sqrt()));
                assert!(arm.prior_share[k].abs() < 1e-30);
            }
        }
    }
    // Nothing to estimate it from, or too little for a covariance.
    for (count, noise) in [(8, false), (9, true), (10, true)] {
        let (truth, _) = case(4, 1);
        let samples = measurements(&truth, count, None, &mut generator(641, 0));
        let outcome = calibrate(&samples, &Settings::default()).unwrap();
        for arm in &outcome.arms {
            assert_eq!(arm.estimated_noise.is_some(), noise);
            assert!(arm.covariance.is_none());
        }
    }
}

#[test]
fn with_a_stated_noise_the_covariance_is_the_cramer_rao_bound() {
    let (_, samples) = case(5, 30);
    let settings = Settings::default().with_noise(Noise::new(SIGMA, 0.0).unwrap());
    let outcome = calibrate(&samples, &settings).unwrap();
    for (index, arm) in ArmIndex::ALL.into_iter().zip(&outcome.arms) {
        let (squares, information) = sums(&arm.arm, index, &samples);
        assert!(same(arm.residual_rms, (squares / 30.0).sqrt() / SIGMA));
        assert_eq!(arm.estimated_noise, None);
        let expected = information.try_inverse().unwrap() * (SIGMA * SIGMA);
        assert!(same_matrix(&arm.covariance.unwrap(), &expected));
    }
}

/// Of a noise that differs by axis, σf² is Σ (∂f/∂x σx)² over the axes and (∂f/∂q σq)² besides, at the robot before.
#[test]
fn a_noise_by_axis_weighs_each_sample_by_its_own_direction() {
    let (truth, _) = case(6, 1);
    let noise = Noise::by_axis([0.03, 0.03, 0.1], 1e-5).unwrap();
    let mut rng = generator(640, 6);
    let samples = measurements(&truth, 40, Some(&noise), &mut rng);
    let outcome = calibrate(&samples, &Settings::default().with_noise(noise)).unwrap();
    for (index, arm) in ArmIndex::ALL.into_iter().zip(&outcome.arms) {
        let (mut squares, mut information) = (0.0, SMatrix::<f64, 8, 8>::zeros());
        let nominal = paper_robot();
        let nominal: &Arm<f64> = nominal.arm(index);
        for sample in &samples {
            let (x, q) = (&sample.position, sample.joints[index.index()]);
            let sigmas = Vector3::from(noise.position_by_axis());
            let by_position = nominal.constraint_by_position(x, q).component_mul(&sigmas);
            let by_joint = nominal.constraint_by_joint(x, q) * noise.joint();
            let variance = by_position.norm_squared() + by_joint.powi(2);
            squares += arm.arm.constraint(x, q).powi(2) / variance;
            let row = arm.arm.constraint_by_parameters(x, q);
            information += row * row.transpose() / variance;
        }
        assert!(same(arm.residual_rms, (squares / 40.0).sqrt()));
        let expected = information.try_inverse().unwrap();
        assert!(same_matrix(&arm.covariance.unwrap(), &expected));
    }
    let [x, y, z] = noise.position_by_axis();
    let root_mean_square = ((x * x + y * y + z * z) / 3.0).sqrt();
    assert!((noise.position() - root_mean_square).abs() < 1e-15);
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
