#![allow(clippy::unwrap_used)]

use super::Forgetting;
use crate::calibration::JointCalibrator;
use crate::{Calibrator, Sample, Settings, SymmetricRobot};

#[test]
fn after_so_many_samples_the_factor_is_its_power() {
    let forgetting = Forgetting::new(19.0_f64).unwrap();
    let mut expected = 1.0;
    for count in 0..70 {
        assert!(
            (forgetting.after(count) / expected - 1.0).abs() < 1e-13,
            "{count}"
        );
        expected *= 0.95;
    }
}

/// Both kinds of calibrators, sample by sample and with solves in between, after which nothing is left waiting: what
/// the samples are worth is Σ λᵏ = (1 − λⁿ)/(1 − λ), less at most a block that still waits or is not yet forgotten.
#[test]
fn every_sample_fades_whatever_was_left_waiting() {
    let robot = SymmetricRobot {
        base_radius: 194.0,
        platform_radius: 30.0,
        upper_arm: 260.0,
        forearm: 480.0,
    };
    let robot = robot.robot().unwrap();
    let forgetting = Forgetting::new(19.0_f64).unwrap();
    for solve_every in [1, 3, u32::MAX] {
        let mut joint = JointCalibrator::new(&robot, &Settings::default());
        let mut apart = Calibrator::new(&robot, &Settings::default());
        for count in 1..=150_u32 {
            let t = f64::from(count);
            let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
            let position = robot.forward(&joints).unwrap();
            let sample = Sample { joints, position };
            joint.add_forgetting(&sample, &forgetting).unwrap();
            apart.add_forgetting(&sample, &forgetting).unwrap();
            if count % solve_every == 0 {
                joint.flush();
                apart.flush();
            }
        }
        joint.flush();
        apart.flush();
        let expected = (1.0 - 0.95_f64.powi(150)) / 0.05;
        let effective = [
            joint.factor().effective_samples(),
            apart.arms()[0].effective_samples(),
        ];
        for (effective, block) in effective.into_iter().zip([2.0, 4.0]) {
            assert!(
                (effective - expected).abs() <= block,
                "{effective}, {expected}, every {solve_every}"
            );
        }
    }
}
