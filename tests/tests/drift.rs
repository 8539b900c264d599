//! Forgetting: the estimate follows a robot that changes slowly, with the lag and the variance that
//! theory has for it.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

use delta_cal::{Arm, Calibrator, Memory, Noise, Parameter, Robot, Sample, Settings, Tolerance};
use delta_cal_tests::{
    Spread, generator, largest_difference, measurements, paper_limits, paper_robot, perturbed,
    to_single,
};
use nalgebra::SMatrix;
use rand_pcg::Pcg32;

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const SAMPLES: usize = 400;

fn noise() -> Noise<f64> {
    Noise::new(0.02, 0.002 * DEGREE).unwrap()
}

fn settings() -> Settings<f64> {
    Settings {
        noise: Some(noise()),
        ..Settings::default()
    }
}

/// The second arm's parameter moved.
fn moved(robot: &Robot<f64>, parameter: Parameter, by: f64) -> Robot<f64> {
    let mut arms = *robot.arms();
    let mut parameters = arms[1].parameters().data.0[0];
    parameters[parameter.index()] += by;
    arms[1] = Arm::new(parameters).unwrap();
    Robot::new(arms).unwrap()
}

/// Measurements of a robot of which one parameter grows by `rate` a sample.
fn warming(
    truth: &Robot<f64>,
    parameter: Parameter,
    rate: f64,
    rng: &mut Pcg32,
) -> Vec<Sample<f64>> {
    (0..SAMPLES)
        .map(|index| {
            let now = moved(truth, parameter, rate * index as f64);
            let pose = delta_cal::random_pose(&now, &paper_limits(), rng).unwrap();
            delta_cal::simulate_sample(&now, &pose.joints, Some(&noise()), rng).unwrap()
        })
        .collect()
}

fn followed(samples: &[Sample<f64>], memory: f64, settings: &Settings<f64>) -> Robot<f64> {
    let memory = Memory::new(memory).unwrap();
    let mut calibrator = Calibrator::new(&paper_robot(), settings);
    for sample in samples {
        calibrator.add_forgetting(sample, &memory).unwrap();
    }
    calibrator.solve().unwrap().robot
}

/// σ² A⁻¹ B A⁻¹ of the second arm, A = Σ λᵏ hhᵀ, B = Σ λ²ᵏ hhᵀ: the covariance of weighted least squares
/// whose weights are not the noise's.
fn covariance(truth: &Robot<f64>, samples: &[Sample<f64>], memory: f64) -> SMatrix<f64, 8, 8> {
    let lambda = memory / (memory + 1.0);
    let arm = &truth.arms()[1];
    let (mut a, mut b) = (SMatrix::<f64, 8, 8>::zeros(), SMatrix::zeros());
    for (age, sample) in samples.iter().rev().enumerate() {
        let (x, q) = (&sample.position, sample.joints[1]);
        let row = arm.constraint_by_parameters(x, q);
        let variance = (arm.constraint_by_position(x, q).norm() * noise().position()).powi(2)
            + (arm.constraint_by_joint(x, q) * noise().joint()).powi(2);
        let weight = lambda.powi(i32::try_from(age).unwrap());
        a += row * row.transpose() * (weight / variance);
        b += row * row.transpose() * (weight * weight / variance);
    }
    let inverse = a.try_inverse().unwrap();
    inverse * b * inverse
}

#[test]
fn the_estimate_follows_a_ramp_with_the_lag_and_the_variance_that_theory_has() {
    for (campaign, memory, parameter) in [
        (960, 20.0, Parameter::Lb),
        (961, 49.0, Parameter::Lb),
        (962, 49.0, Parameter::Dx),
        (963, 49.0, Parameter::LaX),
    ] {
        let robots = 400;
        let (mut lag, mut squared_z, mut effective) = (0.0, 0.0, 0.0);
        let (mut lag_squared, mut sigma) = (0.0, 0.0);
        for number in 0..robots {
            let mut rng = generator(campaign, number);
            let truth = perturbed(&paper_robot(), 0.5, 0.2 * DEGREE, Spread::Normal, &mut rng);
            // The same poses and the same noise, with the ramp and without it.
            let still = warming(&truth, parameter, 0.0, &mut rng.clone());
            let index = parameter.index();
            let predicted = covariance(&truth, &still, memory);
            let predicted_sigma = predicted[(index, index)].sqrt();
            let found = followed(&still, memory, &settings());
            let error = found.arms()[1].get(parameter) - truth.arms()[1].get(parameter);
            squared_z += (error / predicted_sigma).powi(2);
            sigma += predicted_sigma;

            // So fast that the estimate is five σ behind.
            let rate = 5.0 * predicted_sigma / memory;
            let ramp = warming(&truth, parameter, rate, &mut rng);
            let end = truth.arms()[1].get(parameter) + rate * (SAMPLES - 1) as f64;
            let found = followed(&ramp, memory, &settings());
            let behind = (end - found.arms()[1].get(parameter)) / rate;
            lag += behind;
            lag_squared += behind * behind;
            // What the samples are worth: the variance of equal weights times their number.
            let all = covariance(&truth, &still, 1e12)[(index, index)] * SAMPLES as f64;
            effective += all / predicted[(index, index)];
        }
        let robots = robots as f64;
        let lag = lag / robots;
        let spread = ((lag_squared / robots - lag * lag) / robots).sqrt();
        let z = (squared_z / robots).sqrt();
        println!(
            "{parameter}, memory {memory}: lag {lag:.2} ± {spread:.2} samples; rms error over the \
             predicted sigma {z:.3} ({:.1} µm); worth {:.1} samples of {:.0}",
            1e3 * sigma / robots,
            effective / robots,
            2.0 * memory + 1.0,
        );
        // Blocks of four shift the weights by less than half a sample.
        assert!(
            (lag - memory).abs() < 3.0 * spread + 0.5,
            "{lag} ± {spread}"
        );
        // The root mean square of 400 numbers is known to 1/√800.
        assert!((z - 1.0).abs() < 4.0 / 800f64.sqrt() + 0.02, "{z}");
    }
}

/// However long ago the tolerance was stated, it counts.
#[test]
fn the_prior_is_not_forgotten() {
    let settings = Settings {
        tolerance: Some(Tolerance::new(0.5, 0.2 * DEGREE).unwrap()),
        ..settings()
    };
    let mut rng = generator(965, 0);
    let truth = perturbed(&paper_robot(), 0.5, 0.2 * DEGREE, Spread::Normal, &mut rng);
    // Four samples of memory determine nothing by themselves.
    let samples = measurements(&truth, 300, Some(&noise()), &mut rng);
    let memory = Memory::new(2.0).unwrap();
    let mut calibrator = Calibrator::new(&paper_robot(), &settings);
    for sample in &samples {
        calibrator.add_forgetting(sample, &memory).unwrap();
    }
    let outcome = calibrator.solve().unwrap();
    for arm in &outcome.arms {
        // The forearm is known well, its tolerance decides; no σ is above its tolerance.
        for parameter in Parameter::ALL {
            let sigma = arm.standard_deviation(parameter).unwrap();
            assert!(sigma <= settings.tolerance.unwrap().of(parameter) * 1.000_001);
        }
        assert!(arm.prior_share.max() > 0.3);
    }
}

/// However the samples come in, solved after each or never, they are forgotten alike.
#[test]
fn solving_in_between_does_not_change_what_is_forgotten() {
    let mut rng = generator(966, 0);
    let truth = perturbed(&paper_robot(), 0.5, 0.2 * DEGREE, Spread::Normal, &mut rng);
    let samples = measurements(&truth, 300, Some(&noise()), &mut rng);
    let memory = Memory::new(30.0).unwrap();
    let mut calibrator = Calibrator::new(&paper_robot(), &settings());
    for sample in &samples {
        calibrator.add_forgetting(sample, &memory).unwrap();
        calibrator.flush();
    }
    // Σ λᵏ = N + 1, to within a block.
    for factor in calibrator.arms() {
        let worth = factor.effective_samples();
        assert!((28.0..36.0).contains(&worth), "{worth}");
    }
}

/// A hundred thousand samples: rounding is forgotten as the samples are.
#[test]
fn a_long_stream_in_single_precision_stays_as_good_as_in_double() {
    let mut rng = generator(967, 0);
    let truth = perturbed(&paper_robot(), 0.5, 0.2 * DEGREE, Spread::Normal, &mut rng);
    let poses = measurements(&truth, 2000, Some(&noise()), &mut rng);
    let single = Settings {
        noise: Some(Noise::<f32>::new(0.02, 3.5e-5).unwrap()),
        ..Settings::default()
    };
    let rounded = to_single(&poses);
    let (mut narrow, mut wide) = (
        Calibrator::<f32>::new(&paper_robot(), &single),
        Calibrator::<f64>::new(&paper_robot(), &settings()),
    );
    let (short, long) = (Memory::new(200.0_f32).unwrap(), Memory::new(200.0).unwrap());
    let mut worst = 0.0_f64;
    for round in 0..50 {
        for (a, b) in rounded.iter().zip(&poses) {
            narrow.add_forgetting(a, &short).unwrap();
            wide.add_forgetting(b, &long).unwrap();
        }
        let (a, b) = (narrow.solve().unwrap(), wide.solve().unwrap());
        let apart = largest_difference(&a.robot.cast().unwrap(), &b.robot) * 1e3;
        worst = worst.max(apart);
        let error = largest_difference(&b.robot, &truth) * 1e3;
        if round == 49 {
            println!(
                "100,000 samples, memory 200: f32 and f64 at most {worst:.3} µm apart, f64 \
                 {error:.1} µm from the truth"
            );
        }
    }
    // As of twenty to a thousand samples without forgetting: 0.1 to 0.6 µm.
    assert!(worst < 1.0, "{worst} µm");
}
