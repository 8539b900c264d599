//! Data that are honest and hard: noise as large as the tolerance, hardly a sample to spare, a
//! robot far from the origin, single precision. None may be refused or end short of the optimum.

use delta_cal::calibration::Ikm;
use delta_cal::robot::Arm;
use delta_cal::{
    ArmIndex, IkmCalibrator, Noise, Parameter, Real, Refusal, Robot, Sample, Settings, Tolerance,
};
use delta_cal_tests::geometries::symmetric;
use delta_cal_tests::{
    Spread, calibrated, converted, generator, measurements, paper_robot, parameter_differences,
};
use nalgebra::Vector3;

/// A robot drawn from the tolerance and its measurements.
fn robot_and_samples(seed: u64, count: usize, noise: (f64, f64)) -> (Robot<f64>, Vec<Sample<f64>>) {
    let noise = Noise::new(noise.0, noise.1).unwrap();
    let off = (0.3, 0.002, Spread::Normal);
    delta_cal_tests::robot_and_samples((2, seed), off, count, Some(&noise))
}

#[test]
fn noise_as_large_as_the_start_error_converges() {
    let noise = (1.0, 1.745e-4);
    for count in [12, 20] {
        for seed in 0..60 {
            let (_, samples) = robot_and_samples(seed, count, noise);
            let settings = Settings::default().with_noise(Noise::new(noise.0, noise.1).unwrap());
            let result = calibrated::<_, Ikm>(&paper_robot(), &samples, &settings);
            // Uncertain or undetermined may be true; "did not converge" is the solver's own fault.
            assert!(
                !matches!(result, Err(Refusal::NotConverged { .. })),
                "n {count} seed {seed}: {result:?}"
            );
        }
    }
}

/// Without a stated noise, σ from a few spare samples is Student's: it must not promise too much.
#[test]
fn sigmas_from_few_spare_samples_do_not_promise_too_much() {
    for count in [9, 10] {
        for seed in 0..50 {
            let (_, samples) = robot_and_samples(seed, count, (0.05, 0.0));
            if let Ok(outcome) =
                calibrated::<_, Ikm>(&paper_robot(), &samples, &Settings::default())
            {
                assert!(outcome.arms.iter().all(|arm| arm.covariance.is_none()));
            }
        }
    }
    for (count, most) in [(11, 108), (12, 75), (14, 33), (20, 6)] {
        let (mut beyond, mut total) = (0, 0);
        for seed in 0..500 {
            let (truth, samples) = robot_and_samples(seed, count, (0.05, 0.0));
            let Ok(outcome) = calibrated::<_, Ikm>(&paper_robot(), &samples, &Settings::default())
            else {
                continue;
            };
            let errors = parameter_differences(&outcome.robot, &truth);
            for (index, arm) in outcome.arms.iter().enumerate() {
                for parameter in Parameter::ROTARY {
                    let unit = if matches!(parameter, Parameter::Theta | Parameter::Alpha) {
                        260.0
                    } else {
                        1.0
                    };
                    let sigma = arm.standard_deviation(parameter).unwrap() * unit;
                    total += 1;
                    if (errors[index * 8 + parameter.index()] / sigma).abs() > 5.0 {
                        beyond += 1;
                    }
                }
            }
        }
        println!("{count} samples, noise not stated: {beyond} of {total} parameters beyond 5 σ");
        // Student's t of 3, 4, 6 and 12 degrees of freedom, scaled to unit variance, exceeds 5 with
        // probability 0.30, 0.21, 0.09 and 0.015 %. Three times that, for the eight parameters of an
        // arm share one estimate of the noise and come in clusters.
        assert!(beyond <= most, "{count}: {beyond} of {total}");
    }
}

#[test]
fn an_azimuth_may_cross_the_full_turn() {
    let turned = |by: f64| {
        Robot::new(paper_robot::<f64>().arms().map(|arm| {
            let mut p = arm.parameters();
            p[3] += by.to_radians();
            let radius = 164.0;
            (p[0], p[1]) = (radius * p[3].cos(), radius * p[3].sin());
            if p[3] > std::f64::consts::TAU {
                p[3] -= std::f64::consts::TAU;
            }
            Arm::new(p).unwrap()
        }))
        .unwrap()
    };
    let (nominal, truth) = (turned(359.95), turned(360.1));
    let mut rng = generator(4, 0);
    let samples = measurements(&truth, 20, None, &mut rng);
    for damped in [true, false] {
        let settings = Settings::default().with_damping(damped);
        let outcome = calibrated::<_, Ikm>(&nominal, &samples, &settings).unwrap();
        for sample in &samples {
            let x = outcome.robot.forward(&sample.joints).unwrap();
            assert!((x - sample.position).norm() < 1e-8);
        }
    }
}

/// The reference is the truth and the sample has no residual, not even a rounded one: 360² + 480² is
/// 600². The residual's column of the factor is zero then, which says nothing about the parameters.
fn a_sample_without_a_residual_calibrates<T: Real>() {
    let number = T::from_f64;
    let robot = symmetric([130.0, 30.0, 260.0, 600.0]).cast().unwrap();
    let settings = Settings::default()
        .with_noise(Noise::new(number(0.02), number(0.001)).unwrap())
        .with_tolerance(Tolerance::new(number(0.3), number(0.002)).unwrap());
    let below = Sample {
        joints: [T::ZERO; 3],
        position: Vector3::new(0.0, 0.0, -480.0).map(number),
    };
    let arm = robot.arm(ArmIndex::First);
    assert!(arm.constraint(&below.position, T::ZERO) == T::ZERO);
    let mut calibrator = IkmCalibrator::new(&robot, &settings);
    for count in 1..=3 {
        calibrator.add(&below).unwrap();
        let outcome = calibrator.calibrate().unwrap();
        assert_eq!(outcome.arms[0].arm, *arm, "{count} samples");
        assert!(outcome.arms[0].condition.finite(), "{count} samples");
    }
}

#[test]
fn samples_without_any_residual_are_not_undetermined() {
    a_sample_without_a_residual_calibrates::<f64>();
    a_sample_without_a_residual_calibrates::<f32>();
}

/// Angles that are known as well as can be stated in single precision, far better than their rounding: the samples say
/// nothing of them there, and as little in double precision.
#[test]
fn angles_that_are_known_exactly_are_not_determined_by_the_samples() {
    let noise = Noise::new(1e-3, 0.0).unwrap();
    let off = (0.5, 0.0, Spread::Normal);
    let (_, samples) = delta_cal_tests::robot_and_samples((2, 1), off, 13, Some(&noise));
    let tolerance = Tolerance::new(0.5, 1e-15).unwrap();
    let settings = Settings::default().with_tolerance(tolerance);
    let double = calibrated::<_, Ikm>(&paper_robot(), &samples, &settings).unwrap();
    let tolerance = Tolerance::new(0.5, 1e-15).unwrap();
    let settings = Settings::default().with_tolerance(tolerance);
    let single = calibrated::<f32, Ikm>(&paper_robot(), &converted(&samples), &settings).unwrap();
    for (single, double) in single.arms.iter().zip(&double.arms) {
        let (found, expected) = (single.degrees_of_freedom, double.degrees_of_freedom);
        // Thirteen samples less six lengths.
        assert!((expected - 7.0).abs() < 0.01, "{expected}");
        // The lengths' shares, of the order (σ/0.5)², go with the estimated noise, which is rounded.
        assert!((f64::from(found) - expected).abs() < 1e-3, "{found}");
    }
}
