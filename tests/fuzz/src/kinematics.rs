//! Forward and inverse kinematics and derived quantities, for any robot at any pose.

use crate::numbers::{Bits, Source};
use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Drive;
use delta_cal::simulate::{random_pose, simulate_sample};
use delta_cal::{Noise, Robot, SymmetricRobot};
use nalgebra::{Matrix3, Vector3};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

in_either_precision!(kinematics, everything);

fn everything<T: Bits>(source: &mut Source<'_>) {
    alignment::<T>(source);
    let symmetric = SymmetricRobot {
        base_radius: source.number::<T>(194.0, 200.0),
        platform_radius: source.number(30.0, 100.0),
        upper_arm: source.number(260.0, 300.0),
        forearm: source.number(480.0, 400.0),
    };
    for robot in [
        symmetric.robot(),
        symmetric.robot_from_azimuth(source.number(0.3, 6.0)),
        source.robot(),
    ]
    .into_iter()
    .flatten()
    {
        poses(&robot, source);
    }
}

fn poses<T: Bits>(robot: &Robot<T>, source: &mut Source<'_>) {
    let joints = [(); 3].map(|()| source.number(0.3, 1.5));
    let position = source.vector([0.0, 0.0, -450.0], 200.0);
    if let Ok(reached) = robot.forward(&joints) {
        assert!(finite(&reached), "{robot:?} {joints:?}");
        pose(robot, &reached, &joints);
    }
    if let Ok(angles) = robot.inverse(&position) {
        let most = T::PI * (T::ONE + T::TWO * T::EPSILON);
        assert!(
            angles.iter().all(|q| q.magnitude() <= most),
            "{robot:?} {position:?}"
        );
        pose(robot, &position, &angles);
    }
    // Not a pose of the robot: it must only terminate, and NaN must not count as clear.
    let conditioning = robot.singularity_distance(&position, &joints);
    assert!(
        !(conditioning.is_clear()
            && !conditioning.parallel.finite()
            && conditioning.parallel.magnitude() != T::INFINITY)
    );
    jacobian(robot, &position, &joints);
    let _ = robot.cast::<f32>();
    let _ = robot.cast::<f64>();

    let (least, most) = (source.number(-1.0, 1.0), source.number(1.6, 1.0));
    let mut rng = Pcg32::seed_from_u64(u64::from(source.byte()));
    // A draw that fails takes 10,000 attempts, so it is not run for every input.
    if source.byte() & 0x1f == 0x1f
        && let Ok(limits) = JointLimits::new(least, most)
        && let Some(drawn) = random_pose(robot, &limits, &mut rng)
    {
        assert_eq!(drawn.check(Drive::Rotary), Ok(()));
        let noise = Noise::new(source.number(0.02, 0.02), source.number(1e-5, 1e-5));
        let _ = simulate_sample(robot, &drawn.joints, noise.ok().as_ref(), &mut rng);
    }
}

/// Quantities computed at a pose of the robot.
fn pose<T: Bits>(robot: &Robot<T>, position: &Vector3<T>, joints: &[T; 3]) {
    let conditioning = robot.singularity_distance(position, joints);
    let figures = conditioning.serial.iter().chain([&conditioning.parallel]);
    for figure in figures {
        assert!(
            figure.finite() && *figure >= T::ZERO,
            "{robot:?} {position:?} {joints:?}: {conditioning:?}"
        );
    }
    jacobian(robot, position, joints);
}

fn jacobian<T: Bits>(robot: &Robot<T>, position: &Vector3<T>, joints: &[T; 3]) {
    if let Ok(jacobian) = robot.platform_jacobian(position, joints) {
        let blocks = jacobian.by_parameters.iter().flat_map(|block| block.iter());
        assert!(
            jacobian
                .by_joints
                .iter()
                .chain(blocks)
                .all(|entry| entry.finite())
        );
    }
}

/// For any points, an accepted transform is a proper rotation and a finite translation.
fn alignment<T: Bits>(source: &mut Source<'_>) {
    let count = source.below(8);
    let mut pairs = [(Vector3::zeros(), Vector3::zeros()); 8];
    for pair in pairs.iter_mut().take(count) {
        let from = source.vector::<T>([100.0, -50.0, -400.0], 300.0);
        let to = source.vector::<T>([80.0, 70.0, 400.0], 300.0);
        *pair = (from, to);
    }
    let Some(found) = RigidTransform::align(pairs.iter().copied().take(count)) else {
        return;
    };
    assert!(finite(&found.translation), "{found:?}");
    let off = found.rotation.transpose() * found.rotation - Matrix3::identity();
    let most = T::from_f64(64.0) * T::EPSILON;
    assert!(
        off.iter().all(|entry| entry.magnitude() <= most),
        "{found:?}"
    );
    assert!(right_handed(&found.rotation), "{found:?}");
}

fn finite<T: Bits>(vector: &Vector3<T>) -> bool {
    vector.iter().all(|coordinate| coordinate.finite())
}

fn right_handed<T: Bits>(rotation: &Matrix3<T>) -> bool {
    let [x, y, z] = rotation.data.0.map(Vector3::from);
    x.cross(&y).dot(&z) > T::ZERO
}
