//! Against formulas written another way.

use crate::linear::{made, measurements};
use delta_cal::kinematics::{JointLimits, KinematicsError, Singularity};
use delta_cal::robot::{Arm, Drive, GeometryError, ParameterKind, SymmetricLinearRobot};
use delta_cal::simulate::random_pose;
use delta_cal::{ArmIndex, Parameter, Robot, SymmetricRobot};
use delta_cal_tests::geometries::{geometries, linear_geometries, position_jacobian};
use delta_cal_tests::{Spread, generator, paper_limits};
use nalgebra::{Matrix3, Vector3};

/// Where a tower's carriage is, from the angles alone.
fn carriage(arm: &Arm<f64>, travel: f64) -> Vector3<f64> {
    let [x, y] = [Parameter::LeanX, Parameter::LeanY].map(|lean| arm.get(lean).sin());
    let direction = Vector3::new(x, y, (1.0 - x * x - y * y).sqrt());
    let foot = [Parameter::Dx, Parameter::Dy, Parameter::Zero].map(|own| arm.get(own));
    Vector3::from(foot) + travel * arm.get(Parameter::Scale) * direction
}

/// Newton's method on the three distances, from below the carriages.
fn platform(robot: &Robot<f64>, travels: &[f64; 3]) -> Vector3<f64> {
    let arms = robot.arms();
    let carriages = [0, 1, 2].map(|arm| carriage(&arms[arm], travels[arm]));
    let mean = carriages.iter().sum::<Vector3<f64>>() / 3.0;
    let mut x = mean - Vector3::z() * arms[0].lb();
    for _ in 0..50 {
        let rows = carriages.map(|b| (x - b).transpose() * 2.0);
        let errors =
            Vector3::from_fn(|arm, _| (x - carriages[arm]).norm_squared() - arms[arm].lb().powi(2));
        x -= Matrix3::from_rows(&rows).try_inverse().unwrap() * errors;
    }
    x
}

#[test]
fn the_platform_is_at_the_forearms_length_from_every_carriage() {
    for (index, (name, nominal, travel)) in (0..).zip(linear_geometries()) {
        let mut rng = generator(9100, index);
        for _ in 0..50 {
            let robot = made(&nominal, 3.0, Spread::Normal, &mut rng);
            for sample in measurements(&robot, travel, 4, None, &mut rng) {
                let expected = platform(&robot, &sample.joints);
                // Lengths of some hundred mm: a few thousand ε.
                let off = (sample.position - expected).norm();
                assert!(off < 1e-9, "{name}: {off}");
                let back = robot.inverse(&sample.position).unwrap();
                for (found, travel) in back.iter().zip(sample.joints) {
                    assert!((found - travel).abs() < 1e-8, "{name}: {found} {travel}");
                }
            }
        }
    }
}

#[test]
fn derivatives_are_central_differences() {
    for (index, (name, nominal, travel)) in (0..).zip(linear_geometries()) {
        let mut rng = generator(9101, index);
        let robot = made(&nominal, 3.0, Spread::Normal, &mut rng);
        for sample in measurements(&robot, travel, 20, None, &mut rng) {
            let (x, q) = (sample.position, sample.joints);
            let found = robot.platform_jacobian(&x, &q).unwrap();
            let expected = position_jacobian(&robot, &q).unwrap();
            for (arm, block) in found.by_parameters.iter().enumerate() {
                let off = (block - expected.fixed_columns::<8>(8 * arm)).amax();
                // Of thousands of mm per radian the differences keep seven digits.
                assert!(off < 1e-3 * block.amax().max(1.0) / 100.0, "{name}: {off}");
            }
            for joint in 0..3 {
                let at = |by: f64| {
                    let mut q = q;
                    q[joint] += by;
                    robot.forward(&q).unwrap()
                };
                let slope = (at(1e-4) - at(-1e-4)) / 2e-4;
                let off = (found.by_joints.column(joint) - slope).amax();
                assert!(off < 1e-6, "{name}: {off}");
            }
        }
    }
}

#[test]
fn a_point_out_of_reach_or_at_the_edge_is_refused() {
    let geometry = SymmetricLinearRobot {
        tower_radius: 140.0,
        forearm: 330.0,
    };
    let robot = geometry.robot().unwrap();
    // The third tower stands at (0, 140): its forearm reaches no further than y = −190.
    assert_eq!(
        robot.inverse(&Vector3::new(0.0, -191.0, 0.0)),
        Err(KinematicsError::Unreachable(ArmIndex::Third))
    );
    assert_eq!(
        robot.inverse(&Vector3::new(0.0, -190.0, 0.0)),
        Err(KinematicsError::Singular(
            ArmIndex::Third,
            Singularity::Serial
        ))
    );
    assert!(robot.forward(&[0.0, 0.0, 1000.0]).is_err());
    assert!(robot.forward(&[f64::NAN, 0.0, 0.0]).is_err());
}

#[test]
fn what_is_no_tower_is_no_arm() {
    let arm = |parameters| Arm::<f64>::linear(parameters);
    let good = [140.0, 0.0, 0.0, 0.01, -0.01, 1.0, 330.0];
    assert!(arm(good).is_ok());
    for (place, value, error) in [
        (0, f64::NAN, GeometryError::NonFinite(Parameter::Dx)),
        (2, f64::INFINITY, GeometryError::NonFinite(Parameter::Zero)),
        (3, 1.6, GeometryError::LeanTooLarge),
        // Beyond the horizontal, where the sines are those of a tower that stands.
        (3, 2.5, GeometryError::LeanTooLarge),
        (4, -2.5, GeometryError::LeanTooLarge),
        // Squares of lengths must be finite too.
        (0, 1e200, GeometryError::NonFinite(Parameter::Dx)),
        (1, -1e200, GeometryError::NonFinite(Parameter::Dx)),
        (2, 1e200, GeometryError::NonFinite(Parameter::Dx)),
        (5, 1e200, GeometryError::NonFinite(Parameter::Scale)),
        (6, 1e200, GeometryError::NonFinite(Parameter::Lb)),
        (5, 0.0, GeometryError::NotPositive(Parameter::Scale)),
        (5, -1.0, GeometryError::NotPositive(Parameter::Scale)),
        (6, 0.0, GeometryError::NotPositive(Parameter::Lb)),
    ] {
        let mut parameters = good;
        parameters[place] = value;
        assert_eq!(arm(parameters).err(), Some(error), "{place}");
    }
    // 50° in both directions is more than a tower can lean.
    assert_eq!(
        arm([140.0, 0.0, 0.0, 0.9, 0.9, 1.0, 330.0]).err(),
        Some(GeometryError::LeanTooLarge)
    );
    let rotary = SymmetricRobot {
        base_radius: 194.0,
        platform_radius: 30.0,
        upper_arm: 260.0,
        forearm: 480.0,
    };
    let [turning, ..] = *rotary.robot().unwrap().arms();
    let tower = arm(good).unwrap();
    assert_eq!(
        Robot::new([tower, tower, turning]).err(),
        Some(GeometryError::MixedDrives)
    );
    assert!(JointLimits::travel(10.0, 10.0).is_err());
    assert!(JointLimits::travel(f64::NAN, 10.0).is_err());
}

#[test]
fn limits_are_of_travels_or_of_angles() {
    let travels = JointLimits::travel(100.0, 600.0).unwrap();
    assert_eq!(travels.drive(), Drive::Linear);
    let angles = JointLimits::new(-0.5, 1.0).unwrap();
    assert_eq!(angles.drive(), Drive::Rotary);
}

/// In metres and in millimetres a robot has the same joint angles, and travels in its own unit.
#[test]
fn the_unit_of_length_makes_no_difference() {
    let linear = linear_geometries().into_iter().map(|(_, robot, _)| robot);
    let rotary = geometries().into_iter().map(|(_, robot)| robot);
    for robot in linear.chain(rotary) {
        let size = robot.arms()[0].lb();
        let x = match robot.drive() {
            Drive::Linear => Vector3::new(0.05, -0.1, 0.5) * size,
            Drive::Rotary => {
                let mut rng = generator(9110, 0);
                random_pose(&robot, &paper_limits(), &mut rng)
                    .unwrap()
                    .position
            }
        };
        let joints = robot.inverse(&x).unwrap();
        for scale in [1e-3, 1e3] {
            let parameters = robot.parameters().map(|mut arm| {
                for (value, place) in arm.iter_mut().zip(robot.drive().places()) {
                    if place.is_some_and(|place| place.kind() == ParameterKind::Length) {
                        *value *= scale;
                    }
                }
                arm
            });
            let scaled = robot.with_parameters(parameters).unwrap();
            let back = scaled.inverse(&(x * scale)).unwrap();
            for (found, expected) in back.iter().zip(joints) {
                let unit = if robot.drive() == Drive::Linear {
                    scale
                } else {
                    1.0
                };
                // Lengths of some hundred: a few thousand ε.
                assert!((found / unit - expected).abs() < 1e-9, "{found} {expected}");
            }
        }
    }
}

/// Where the forearm is square to its tower, just beyond, and at a number that has no square.
#[test]
fn the_edge_of_a_towers_reach_is_singular_and_beyond_is_unreachable() {
    let robot = SymmetricLinearRobot {
        tower_radius: 140.0,
        forearm: 330.0,
    };
    let robot = robot.robot().unwrap();
    let first = ArmIndex::First;
    let outwards = robot.arms()[0].d() / 140.0;
    // As far from the first tower as its forearm is long, and nearer to both others.
    for (distance, expected) in [
        (330.0 * (1.0 - 1e-12), None),
        (
            330.0 * (1.0 - 1e-15),
            Some(KinematicsError::Singular(first, Singularity::Serial)),
        ),
        (
            330.0 * (1.0 + 1e-15),
            Some(KinematicsError::Singular(first, Singularity::Serial)),
        ),
        (
            330.0 * (1.0 + 1e-12),
            Some(KinematicsError::Unreachable(first)),
        ),
        (1e200, Some(KinematicsError::NonFinite(first))),
    ] {
        let x = outwards * (140.0 - distance);
        assert_eq!(robot.inverse(&x).err(), expected, "{distance}");
    }
}
