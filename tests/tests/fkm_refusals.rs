//! What the FKM method refuses, and that it accepts nothing that it should not.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_possible_truncation
)]

use delta_cal::calibration::Solver;
use delta_cal::{Noise, Refusal, Robot, Sample, Settings, Tolerance};
use delta_cal_host::fit::fkm;
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed, uniform};
use nalgebra::Vector3;

/// A robot off by up to 1 cm and 1°.
fn case(campaign: u64, robot: u64, count: usize, noise: Option<&Noise<f64>>) -> Vec<Sample<f64>> {
    let mut rng = generator(campaign, robot);
    let angle = 1f64.to_radians();
    let truth = perturbed(&paper_robot(), 10.0, angle, Spread::Uniform, &mut rng);
    measurements(&truth, count, noise, &mut rng)
}

#[test]
fn refusals_are_those_of_the_ikm_method() {
    let nominal = paper_robot::<f64>();
    let samples = case(77, 0, 20, None);
    let plain = Settings::default();
    assert!(matches!(
        fkm::calibrate(&nominal, &samples[..7], &plain),
        Err(Refusal::TooFewSamples {
            samples: 7,
            needed: 8,
            ..
        })
    ));
    // Twenty times the same pose.
    assert!(matches!(
        fkm::calibrate(&nominal, &[samples[0]; 20], &plain),
        Err(Refusal::Undetermined { .. })
    ));
    let noise = plain.with_noise(Noise::new(0.001, 0.0).unwrap());
    let mut outlier = samples.clone();
    outlier[3].position.x += 1.0;
    assert!(matches!(
        fkm::calibrate(&nominal, &outlier, &noise),
        Err(Refusal::ResidualContradictsNoise { .. })
    ));
    let coarse = plain.with_noise(Noise::new(50.0, 0.1).unwrap());
    assert!(matches!(
        fkm::calibrate(&nominal, &samples, &coarse),
        Err(Refusal::Uncertain { .. })
    ));
    let tight = noise.with_tolerance(Tolerance::new(0.01, 1e-4).unwrap());
    assert!(matches!(
        fkm::calibrate(&nominal, &samples, &tight),
        Err(Refusal::FarFromNominal { .. })
    ));
    let mirrored: Vec<_> = samples
        .iter()
        .map(|sample| Sample {
            position: Vector3::new(sample.position.x, sample.position.y, -sample.position.z),
            joints: sample.joints.map(|q| -q),
        })
        .collect();
    assert_eq!(
        fkm::calibrate(&nominal, &mirrored, &plain),
        Err(Refusal::WrongSide)
    );
    let mut infinite = samples;
    infinite[5].position.y = f64::NAN;
    assert!(matches!(
        fkm::calibrate(&nominal, &infinite, &plain),
        Err(Refusal::NonFinite { .. })
    ));
}

#[test]
fn samples_of_no_delta_robot_are_never_accepted_with_a_stated_noise() {
    for seed in 0..50 {
        let mut rng = generator(83, seed);
        let mut random = || uniform(&mut rng);
        let samples: Vec<_> = (0..30)
            .map(|_| Sample {
                joints: [random(), random(), random()],
                position: Vector3::new(random(), random(), random() - 2.0) * 200.0,
            })
            .collect();
        for method in [Solver::LevenbergMarquardt, Solver::GaussNewton] {
            let settings = Settings::default()
                .with_solver(method)
                .with_noise(Noise::new(0.05, 1e-4).unwrap());
            let result = fkm::calibrate(&paper_robot(), &samples, &settings);
            assert!(result.is_err(), "seed {seed} {method:?}");
        }
    }
}

#[test]
fn an_accepted_calibration_never_fits_worse_than_before() {
    let squares = |robot: &Robot<f64>, samples: &[Sample<f64>]| -> f64 {
        samples
            .iter()
            .map(|sample| {
                robot
                    .forward(&sample.joints)
                    .map_or(f64::INFINITY, |x| (x - sample.position).norm_squared())
            })
            .sum()
    };
    let mut accepted = 0;
    for seed in 0..200 {
        let noise = Noise::new(0.05, 2e-4).unwrap();
        let samples = case(84, seed, 8 + seed as usize % 30, Some(&noise));
        for method in [Solver::LevenbergMarquardt, Solver::GaussNewton] {
            let settings = Settings::default().with_solver(method);
            let Ok(outcome) = fkm::calibrate(&paper_robot(), &samples, &settings) else {
                continue;
            };
            accepted += 1;
            let after = squares(&outcome.fit.robot, &samples);
            assert!(
                after <= squares(&paper_robot(), &samples),
                "seed {seed} {method:?}"
            );
        }
    }
    println!("{accepted} of 400 accepted");
    assert!(accepted > 300, "{accepted}");
}
