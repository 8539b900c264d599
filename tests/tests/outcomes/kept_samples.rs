//! What a sample may be, where its position is counted from, and what it is worth once it is kept.

use crate::outcomes::case;
use delta_cal::calibration::JointCalibrator;
use delta_cal::robot::{Arm, Drive};
use delta_cal::samples::{ArmFactor, NominalArm};
use delta_cal::{ArmIndex, Calibrator, Noise, Robot, Sample, Settings};
use delta_cal_tests::{generator, measurements, paper_robot, to_single};
use nalgebra::Vector3;

#[test]
fn a_joint_angle_may_be_two_turns_and_no_more() {
    let (_, samples) = case(51, 1);
    let limit = 4.0 * std::f64::consts::PI;
    for (q, accepted) in [(12.5, true), (-12.5, true), (12.6, false), (-12.6, false)] {
        assert_eq!(f64::abs(q) <= limit, accepted);
        let mut sample = samples[0];
        sample.joints[1] = q;
        assert_eq!(sample.check(Drive::Rotary).is_ok(), accepted, "{q}");
    }
}

#[test]
fn a_position_may_be_ten_thousand_units_from_the_centre() {
    let mut calibrator = Calibrator::new(&paper_robot::<f64>(), &Settings::default());
    let reference = *calibrator.arms()[0].nominal();
    assert!(reference.centre().norm() > 100.0);
    for direction in [Vector3::x(), -Vector3::z(), Vector3::z()] {
        for (distance, accepted) in [(0.99999, true), (1.00001, false)] {
            let sample = Sample {
                joints: [0.0; 3],
                position: reference.centre() + direction * (1e4 * reference.scale() * distance),
            };
            let added = calibrator.add(&sample);
            assert_eq!(added.is_ok(), accepted, "{direction} {distance}");
        }
    }
}

#[test]
fn merged_factors_are_worth_the_sum_of_what_they_remember() {
    let (_, samples) = case(53, 30);
    let filled = |part: &[Sample<f64>]| {
        let mut calibrator = Calibrator::new(&paper_robot(), &Settings::default());
        calibrator.add_many(part).unwrap();
        calibrator
    };
    let mut first = filled(&samples[..10]);
    first.forget(0.5);
    first.add_many(&samples[10..13]).unwrap();
    let mut second = filled(&samples[13..]);
    second.forget(0.25);
    first.merge(&second).unwrap();
    for factor in first.arms() {
        assert!((factor.effective_samples() - (5.0 + 3.0 + 17.0 / 4.0)).abs() < 1e-12);
        assert_eq!(factor.samples(), 30);
    }
    // λ of 1 and more forgets nothing.
    let before = first.arms()[0].effective_samples();
    first.forget(1.0);
    first.forget(1.5);
    first.forget(f64::NAN);
    assert!((first.arms()[0].effective_samples() - before).abs() < 1e-12);
}

/// No stated noise claims more than the scalar can hold: half an ε of the position, and 4ε Lb² in f.
#[test]
fn rounding_is_a_noise_too() {
    let arm = Arm::<f32>::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0]).unwrap();
    let noises = [
        Noise::new(1e-12_f32, 0.0),
        Noise::by_axis([1e-12_f32, 1e-12, 2e-12], 0.0),
    ];
    for (far, noise) in [0.0_f64, 4e4]
        .into_iter()
        .flat_map(|far| noises.map(|noise| (far, noise.ok())))
    {
        let mut moved = arm.parameters();
        moved[1] += far as f32;
        let arm = Arm::new(moved).unwrap();
        let centre = Vector3::new(0.0, far as f32, -450.0);
        let mut factor = ArmFactor::new(NominalArm::new(&arm, &centre, noise));
        let x = Vector3::new(424.0, far as f32, -481.0);
        factor.add(&x, 0.0, ArmIndex::First).unwrap();
        let f = 481.0_f64.powi(2) - 480.0_f64.powi(2);
        let epsilon = f64::from(f32::EPSILON);
        let position = x.cast::<f64>().norm() * epsilon / 2.0 * 2.0 * 480.0;
        let arithmetic = 4.0 * epsilon * 480.0 * 480.0;
        let expected = f / position.hypot(arithmetic);
        let found = f64::from(factor.sum_of_squares(&arm)).sqrt();
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
    }
}

/// Of all arms together, too: exact samples in single precision agree with the least noise that can be stated.
#[test]
fn rounded_samples_of_all_arms_agree_with_any_stated_noise() {
    let (truth, _) = case(7, 1);
    let samples = to_single(&measurements(&truth, 40, None, &mut generator(642, 0)));
    let nominal: Robot<f32> = paper_robot();
    let noise = Noise::new(1e-12, 0.0).unwrap();
    let mut calibrator = JointCalibrator::new(&nominal, &Settings::default().with_noise(noise));
    calibrator.add_many(&samples).unwrap();
    let outcome = calibrator.solve().unwrap();
    // Rounding of positions and joints, in σ of what it is taken for.
    assert!((0.01..1.5).contains(&outcome.estimate.residual_rms));
}
