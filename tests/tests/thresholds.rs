//! Where kinematics gives up: every documented limit from both sides, and the arm that is named.

use delta_cal::kinematics::{KinematicsError, Singularity, SingularityDistance};
use delta_cal::robot::Arm;
use delta_cal::{ArmIndex, Robot, SymmetricRobot};
use delta_cal_tests::paper_robot;
use nalgebra::Vector3;

const PARALLEL: Singularity = Singularity::Parallel;
const SERIAL: Singularity = Singularity::Serial;

fn symmetric(radius: f64, upper_arm: f64, forearm: f64) -> Robot<f64> {
    SymmetricRobot {
        base_radius: radius,
        platform_radius: 0.0,
        upper_arm,
        forearm,
    }
    .robot()
    .unwrap()
}

fn with_forearms(robot: &Robot<f64>, forearms: [f64; 3]) -> Robot<f64> {
    let mut arms = *robot.arms();
    for (arm, forearm) in arms.iter_mut().zip(forearms) {
        let mut p = arm.parameters();
        p[7] = forearm;
        *arm = Arm::new(p).unwrap();
    }
    Robot::new(arms).unwrap()
}

fn moved(robot: &Robot<f64>, by: [f64; 3]) -> Robot<f64> {
    Robot::new(robot.arms().map(|arm| {
        let mut p = arm.parameters();
        for (value, by) in p.iter_mut().zip(by) {
            *value += by;
        }
        Arm::new(p).unwrap()
    }))
    .unwrap()
}

/// Equal joint angles: elbows on a circle of radius r = R + La cos q, the platform h below their plane,
/// h² = Lb² − r². Then serial = (r sin q + h cos q)/Lb and det = (3√3/2) (r/Lb)² h/Lb.
#[test]
fn the_conditioning_of_a_symmetric_pose_in_closed_form() {
    let robot = paper_robot::<f64>();
    for q in [-0.4, 0.0, 0.3, 1.0] {
        let radius = 164.0 + 260.0 * f64::cos(q);
        let height = (480.0_f64.powi(2) - radius * radius).sqrt();
        let x = robot.forward(&[q; 3]).unwrap();
        assert!((x.z - (-260.0 * q.sin() - height)).abs() < 1e-10);
        let found = robot.singularity_distance(&x, &[q; 3]);
        for serial in found.serial {
            let expected = (radius * q.sin() + height * q.cos()) / 480.0;
            assert!((serial - expected).abs() < 1e-12);
        }
        let expected = 1.5 * 3f64.sqrt() * (radius / 480.0).powi(2) * height / 480.0;
        assert!((found.parallel - expected).abs() < 1e-12);
    }
}

#[test]
fn a_pose_is_clear_of_singularities_above_both_limits() {
    let clear =
        |serial: [f64; 3], parallel: f64| SingularityDistance { serial, parallel }.is_clear();
    let (serial, parallel) = (
        SingularityDistance::<f64>::LEAST_SERIAL,
        SingularityDistance::<f64>::LEAST_PARALLEL,
    );
    let above = serial * 1.01;
    assert!(clear([above; 3], parallel * 1.01));
    assert!(!clear([above; 3], parallel));
    assert!(!clear([serial, above, above], 1.0));
    assert!(!clear([above, serial, above], 1.0));
    assert!(!clear([above, above, serial], 1.0));
    assert!(!clear([0.0; 3], parallel * 1.01));
    assert!(!clear([f64::NAN; 3], 1.0));
}

/// Elbows a few nanometres apart span a plane like any others.
#[test]
fn elbows_may_lie_close_together() {
    for distance in [1e-2, 1e-3, 1e-4] {
        let robot = symmetric(distance, 260.0, 480.0);
        // Upper arms straight down: the elbows are as far from each other as the motors.
        let x = robot.forward(&[std::f64::consts::FRAC_PI_2; 3]).unwrap();
        assert!((x.z + 740.0).abs() < 1e-3 && x.xy().norm() < 1e-3, "{x}");
    }
    // And far apart.
    let large = symmetric(1e7, 1e7, 2.5e7);
    let x = large.forward(&[0.0; 3]).unwrap();
    assert!((x.z + 1.5e7).abs() < 1e-6);
}

#[test]
fn elbows_in_one_place_or_on_one_line_hold_nothing() {
    let arm = |x: f64| Arm::new([x, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0]).unwrap();
    let singular = Err(KinematicsError::Singular(ArmIndex::First, PARALLEL));
    let same = Robot::new([arm(164.0); 3]).unwrap();
    assert_eq!(same.forward(&[0.1; 3]), singular);
    let line = Robot::new([arm(0.0), arm(100.0), arm(250.0)]).unwrap();
    assert_eq!(line.forward(&[0.1; 3]), singular);
}

/// The platform within 4√ε forearms of the elbows' plane is refused, and no farther.
#[test]
fn the_platform_may_come_close_to_the_elbows_plane() {
    let root = f64::EPSILON.sqrt();
    for forearm in [300.0, 480.0, 500.0] {
        for (height, refused) in [(3.0, true), (5.0, false)] {
            let height = height * root * forearm;
            // Elbows at q = 0 on a circle of this radius; h is a small part of Lb.
            let radius = forearm - height * height / (2.0 * forearm);
            let robot = symmetric(radius - 200.0, 200.0, forearm);
            let found = robot.forward(&[0.0; 3]);
            if refused {
                assert!(
                    matches!(found, Err(KinematicsError::Singular(_, PARALLEL))),
                    "{forearm} {found:?}"
                );
            } else {
                assert!(found.is_ok(), "{forearm} {found:?}");
            }
        }
    }
}

/// Of forearms that hardly differ as well, wherever the robot stands.
#[test]
fn the_shortest_forearm_is_named_by_a_small_difference() {
    for shift in [[0.0; 3], [900.0, -700.0, 400.0], [-800.0, 900.0, 0.0]] {
        let robot = moved(&symmetric(400.0, 260.0, 480.0), shift);
        for (short, index) in ArmIndex::ALL.into_iter().enumerate() {
            let mut forearms = [480.0; 3];
            forearms[short] = 475.0;
            assert_eq!(
                with_forearms(&robot, forearms).forward(&[-0.2, 0.1, 0.3]),
                Err(KinematicsError::Unreachable(index))
            );
        }
    }
}

/// A folded arm whose forearm ends on its motor axis reaches that point at every joint angle.
#[test]
fn an_arm_folded_onto_its_motor_axis_is_a_serial_singularity() {
    let robot = with_forearms(&paper_robot(), [260.0, 480.0, 480.0]);
    let axis = robot.arm(ArmIndex::First).d();
    assert_eq!(
        robot.inverse(&axis),
        Err(KinematicsError::Singular(ArmIndex::First, SERIAL))
    );
}

/// A robot of which arm 1 at `q` holds its forearm at `angle` from the line of its upper arm, and
/// the joint angles.
fn nearly_stretched(angle: f64) -> (Robot<f64>, Vector3<f64>, [f64; 3]) {
    let robot = with_forearms(&paper_robot(), [480.0, 900.0, 900.0]);
    let arm = robot.arm(ArmIndex::First);
    let q = 0.7;
    let (along, across) = (
        (arm.elbow(q) - arm.d()).normalize(),
        arm.elbow_derivative(q).normalize(),
    );
    let x = arm.elbow(q) + (along * angle.cos() + across * angle.sin()) * arm.lb();
    // Arm 1's own inverse is singular there: the others' from a robot that has two of them.
    let [_, second, third] = *robot.arms();
    let others = Robot::new([second, second, third]).unwrap();
    let [_, q2, q3] = others.inverse(&x).unwrap();
    (robot, x, [q, q2, q3])
}

/// ∂f/∂q = 2 La Lb sin of the angle between the links; below √ε La Lb the joint does not move the
/// platform.
#[test]
fn a_joint_that_does_not_move_the_platform_has_no_jacobian() {
    let limit = f64::EPSILON.sqrt() / 2.0;
    let (robot, x, q) = nearly_stretched(0.7 * limit);
    assert_eq!(
        robot.platform_jacobian(&x, &q),
        Err(KinematicsError::Singular(ArmIndex::First, SERIAL))
    );
    let (robot, x, q) = nearly_stretched(1.4 * limit);
    assert!(robot.platform_jacobian(&x, &q).is_ok());
}

/// det of the forearms' unit vectors below √ε; here (3√3/2) (r/Lb)² h/Lb with r ≈ Lb.
#[test]
fn a_platform_close_to_the_elbows_plane_has_no_jacobian() {
    let limit = f64::EPSILON.sqrt() / (1.5 * 3f64.sqrt());
    for forearm in [300.0, 480.0, 505.0, 700.0] {
        let robot = symmetric(forearm - 200.0, 200.0, forearm);
        let at = |height: f64| {
            robot.platform_jacobian(&Vector3::new(0.0, 0.0, -height * forearm), &[0.0; 3])
        };
        let within = at(0.7 * limit);
        assert!(
            matches!(within, Err(KinematicsError::Singular(_, PARALLEL))),
            "{forearm} {within:?}"
        );
        // Beyond it what fails, if anything, are the joints.
        let beyond = at(1.4 * limit);
        assert!(
            !matches!(beyond, Err(KinematicsError::Singular(_, PARALLEL))),
            "{forearm} {beyond:?}"
        );
    }
}

/// Forearms in one plane, the third at 80° and 10° from the others: whichever arm it is, the other two
/// span their plane best, and it is named. How long they are does not matter.
#[test]
fn the_forearm_nearest_to_the_plane_of_the_others_is_named() {
    let ten = 10f64.to_radians();
    let directions = [
        Vector3::new(1.0, 0.0, 0.0),
        Vector3::new(0.0, 1.0, 0.0),
        Vector3::new(ten.cos(), ten.sin(), 0.0),
    ];
    for lengths in [
        [1.0, 1.0, 1.0],
        [1.0, 1.0, 3.0],
        [2.0, 0.5, 1.0],
        [0.5, 2.0, 1.0],
    ] {
        for named in 0..3 {
            // The arms stand so that their forearms at q = 0 are these vectors.
            let arms: [Arm<f64>; 3] = std::array::from_fn(|index| {
                let role = (index + 2 + 3 - named) % 3;
                let forearm = directions[role] * lengths[role] * 400.0;
                let d = -forearm - Vector3::new(200.0, 0.0, 0.0);
                Arm::new([d.x, d.y, d.z, 0.0, 0.0, 200.0, 0.0, lengths[role] * 400.0]).unwrap()
            });
            let robot = Robot::new(arms).unwrap();
            assert_eq!(
                robot.platform_jacobian(&Vector3::zeros(), &[0.0; 3]),
                Err(KinematicsError::Singular(ArmIndex::ALL[named], PARALLEL)),
                "{lengths:?}"
            );
        }
    }
    // A platform at an elbow, where no forearm is.
    let robot = paper_robot::<f64>();
    let elbow = robot.arm(ArmIndex::First).elbow(0.2);
    assert!(matches!(
        robot.platform_jacobian(&elbow, &[0.2; 3]),
        Err(KinematicsError::Singular(_, PARALLEL))
    ));
}
