//! Forward and inverse kinematics: published robots, round trips, frames, and every error.

use delta_cal::frame::{AlignmentError, RigidTransform};
use delta_cal::kinematics::{KinematicsError, Singularity};
use delta_cal::robot::{Arm, GeometryError};
use delta_cal::{ArmIndex, Parameter, Robot, SymmetricRobot};
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed, uniform};
use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;

fn degrees(q: [f64; 3]) -> [f64; 3] {
    q.map(f64::to_radians)
}

#[test]
fn trossen_forum_robot() {
    let root3 = 3f64.sqrt();
    let robot = SymmetricRobot {
        base_radius: 457.3 / (2.0 * root3),
        platform_radius: 115.0 / (2.0 * root3),
        upper_arm: 112.0,
        forearm: 232.0,
    }
    .robot_from_azimuth(-90f64.to_radians())
    .unwrap();
    // Published to four decimals.
    let x = robot.forward(&degrees([0.0, 0.0, 0.0])).unwrap();
    assert!((x - Vector3::new(0.0, 0.0, -96.8590)).norm() < 1e-4, "{x}");
    let x = robot.forward(&degrees([10.0, 20.0, 30.0])).unwrap();
    assert!(
        (x - Vector3::new(10.1168, -16.3280, -148.1187)).norm() < 1e-4,
        "{x}"
    );
}

#[test]
fn williams_flexpicker() {
    let root3 = 3f64.sqrt();
    let robot = SymmetricRobot {
        base_radius: 0.567 * root3 / 6.0,
        platform_radius: 0.076 * root3 / 3.0,
        upper_arm: 0.524,
        forearm: 1.244,
    }
    .robot_from_azimuth(-90f64.to_radians())
    .unwrap();
    let x = robot.forward(&degrees([0.0, 0.0, 0.0])).unwrap();
    // Published to five decimals.
    assert!((x - Vector3::new(0.0, 0.0, -1.06445)).norm() < 1e-5, "{x}");
    let x = robot.forward(&degrees([10.0, 20.0, 30.0])).unwrap();
    assert!(
        (x - Vector3::new(0.10814, -0.18035, -1.24354)).norm() < 1e-5,
        "{x}"
    );
}

fn any_robot() -> impl Strategy<Value = (Robot<f64>, [f64; 3])> {
    (any::<u64>(), prop::array::uniform3(-40f64..70.0)).prop_map(|(seed, q)| {
        let mut rng = generator(61, seed);
        (
            perturbed(&paper_robot(), 15.0, 0.1, Spread::Uniform, &mut rng),
            degrees(q),
        )
    })
}

/// The robot in another frame, by the rotation's effect on points and the motor axis alone.
fn moved(
    robot: &Robot<f64>,
    rotation: &Rotation3<f64>,
    shift: &Vector3<f64>,
) -> Option<Robot<f64>> {
    let arms = robot.arms().map(|arm| {
        let basis = arm.basis();
        let (u, v) = (rotation * basis.u, rotation * basis.v);
        let axis = rotation * basis.ey;
        let d = rotation * arm.d() + shift;
        let theta = (-axis.x).atan2(axis.y);
        let alpha = axis.z.asin();
        let ex = Vector3::new(theta.cos(), theta.sin(), 0.0);
        let ez = axis.cross(&ex).scale(-1.0);
        assert!((u.dot(&axis)).abs() < 1e-9 && (v.dot(&axis)).abs() < 1e-9);
        Arm::new([
            d.x,
            d.y,
            d.z,
            theta,
            alpha,
            u.dot(&ex),
            u.dot(&ez),
            arm.lb(),
        ])
    });
    let [Ok(first), Ok(second), Ok(third)] = arms else {
        return None;
    };
    Robot::new([first, second, third]).ok()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(500) })]

    #[test]
    fn inverse_undoes_forward((robot, q) in any_robot()) {
        if let Ok(x) = robot.forward(&q)
            && let Ok(back) = robot.inverse(&x)
            && let Ok(jacobian) = robot.platform_jacobian(&x, &q)
        {
            // Both solve the same constraints; near singular poses the joint angles magnify the
            // position's rounding by the inverse velocity Jacobian.
            let magnification = jacobian.by_joints.try_inverse().map_or(1e9, |m| m.norm());
            for ((arm, back), q) in robot.arms().iter().zip(back).zip(q) {
                let w = x - arm.elbow(q);
                // Elbow-out: the branch on which a larger q lowers f.
                if w.dot(&arm.elbow_derivative(q)) > 0.0 {
                    prop_assert!((back - q).abs() < 1e-12 + 1e-10 * magnification, "{back} for {q}");
                }
            }
        }
    }

    #[test]
    fn forward_satisfies_all_constraints_below_the_elbows((robot, q) in any_robot()) {
        if let Ok(x) = robot.forward(&q) {
            for (arm, q) in robot.arms().iter().zip(q) {
                // |w|² − Lb² with lengths of 500: 2.5e5 ε, magnified near singular poses.
                prop_assert!(arm.constraint(&x, q).abs() < 1e-6);
            }
            let elbows: Vec<_> = robot.arms().iter().zip(q).map(|(a, q)| a.elbow(q)).collect();
            let normal = (elbows[1] - elbows[0]).cross(&(elbows[2] - elbows[0]));
            let above = normal.dot(&robot.up()).signum() * normal.dot(&(x - elbows[0]));
            prop_assert!(above < 0.0);
        }
    }

    #[test]
    fn a_robot_in_another_frame_moves_its_platform_with_it(
        (robot, q) in any_robot(),
        angles in prop::array::uniform3(-1f64..1.0),
        shift in prop::array::uniform3(-2000f64..2000.0),
    ) {
        let rotation = Rotation3::from_euler_angles(angles[0], angles[1], angles[2] * 3.0);
        let shift = Vector3::from(shift);
        if let Some(other) = moved(&robot, &rotation, &shift)
            && let (Ok(here), Ok(there)) = (robot.forward(&q), other.forward(&q))
        {
            prop_assert!((rotation * here + shift - there).norm() < 1e-6);
        }
    }

    #[test]
    fn arms_may_be_numbered_either_way_round((robot, q) in any_robot()) {
        let [a, b, c] = *robot.arms();
        let reversed = Robot::new([c, b, a]).unwrap();
        if let (Ok(x), Ok(y)) = (robot.forward(&q), reversed.forward(&[q[2], q[1], q[0]])) {
            prop_assert!((x - y).norm() < 1e-7);
        }
    }
}

#[test]
fn round_trips_hold_in_single_precision() {
    let robot = paper_robot::<f32>();
    for seed in 0..500 {
        let mut rng = generator(62, seed);
        let sample = measurements(&paper_robot(), 1, None, &mut rng)[0];
        let q = sample.joints.map(|q| q as f32);
        let x = robot.forward(&q).unwrap();
        // Poses are kept clear of singularities; ε · 500 mm times a condition below 100.
        assert!((x.cast::<f64>() - sample.position).norm() < 6e-8 * 500.0 * 100.0);
        let back = robot.forward(&robot.inverse(&x).unwrap()).unwrap();
        assert!((back - x).norm() < 6e-3);
    }
}

#[test]
fn unreachable_points_and_angles_name_the_arm() {
    let robot = paper_robot::<f64>();
    // Far out along arm 2's azimuth: the opposite arms fail, the first of them is named.
    let far = Vector3::new(-600.0, 0.0, -400.0);
    assert_eq!(
        robot.inverse(&far),
        Err(KinematicsError::Unreachable(ArmIndex::First))
    );
    let short = {
        let mut arms = *robot.arms();
        let mut p = arms[1].parameters();
        p[7] = 150.0;
        arms[1] = Arm::new(p).unwrap();
        Robot::new(arms).unwrap()
    };
    assert_eq!(
        short.forward(&degrees([-30.0; 3])),
        Err(KinematicsError::Unreachable(ArmIndex::Second))
    );
}

#[test]
fn a_stretched_arm_is_a_serial_singularity() {
    let robot = paper_robot::<f64>();
    // Arm 1 straight out at 40° below the horizontal: elbow and platform on one line from the axis.
    let direction = Vector3::new(40f64.to_radians().cos(), 0.0, -(40f64.to_radians().sin()));
    let x = Vector3::new(164.0, 0.0, 0.0) + direction * 740.0;
    assert_eq!(
        robot.inverse(&x),
        Err(KinematicsError::Singular(
            ArmIndex::First,
            Singularity::Serial
        ))
    );
    assert_eq!(
        robot.inverse(&(x + direction)),
        Err(KinematicsError::Unreachable(ArmIndex::First))
    );
}

#[test]
fn numbers_that_are_not_finite_name_the_arm() {
    let robot = paper_robot::<f64>();
    assert_eq!(
        robot.forward(&[0.0, f64::NAN, 0.0]),
        Err(KinematicsError::NonFinite(ArmIndex::Second))
    );
    assert_eq!(
        robot.forward(&[0.0, 0.0, f64::INFINITY]),
        Err(KinematicsError::NonFinite(ArmIndex::Third))
    );
    assert_eq!(
        robot.inverse(&Vector3::new(f64::NAN, 0.0, -400.0)),
        Err(KinematicsError::NonFinite(ArmIndex::First))
    );
}

#[test]
fn invalid_geometry_cannot_be_constructed() {
    let good = [164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0];
    let with = |parameter: Parameter, value: f64| {
        let mut p = good;
        p[parameter.index()] = value;
        Arm::new(p)
    };
    assert!(Arm::new(good).is_ok());
    for parameter in Parameter::ROTARY {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(
                with(parameter, value),
                Err(GeometryError::NonFinite(parameter))
            );
        }
    }
    assert_eq!(
        with(Parameter::Lb, 0.0),
        Err(GeometryError::NotPositive(Parameter::Lb))
    );
    assert_eq!(
        with(Parameter::Lb, -1.0),
        Err(GeometryError::NotPositive(Parameter::Lb))
    );
    assert_eq!(
        with(Parameter::LaX, 0.0),
        Err(GeometryError::NotPositive(Parameter::LaX))
    );
    assert_eq!(
        with(Parameter::Alpha, 1.6),
        Err(GeometryError::TiltTooLarge)
    );
    assert_eq!(
        with(Parameter::Theta, 7.0),
        Err(GeometryError::AzimuthTooLarge)
    );
    assert_eq!(
        with(Parameter::Dx, 1e200),
        Err(GeometryError::NonFinite(Parameter::Dx))
    );

    // Three arms whose planes' up directions cancel are no robot.
    let tilted = |theta: f64| Arm::new([0.0, 0.0, 0.0, theta, 1.57, 260.0, 0.0, 480.0]).unwrap();
    let third = 2.0 * std::f64::consts::FRAC_PI_3;
    assert_eq!(
        Robot::new([tilted(0.0), tilted(third), tilted(2.0 * third)]),
        Err(GeometryError::NoCommonUp)
    );
}

fn random_motion(seed: u64) -> (RigidTransform<f64>, Vec<Vector3<f64>>) {
    let mut rng = generator(101, seed);
    let mut vector = || Vector3::from([(); 3].map(|()| uniform(&mut rng)));
    let axis = vector();
    let angle = vector().x * std::f64::consts::PI;
    let motion = RigidTransform {
        rotation: Rotation3::new(axis.normalize() * angle).into_inner(),
        translation: vector() * 3000.0,
    };
    let points = (0..12).map(|_| vector() * 300.0).collect();
    (motion, points)
}

fn aligned(
    motion: &RigidTransform<f64>,
    points: &[Vector3<f64>],
) -> Result<RigidTransform<f64>, AlignmentError> {
    RigidTransform::align(points.iter().map(|p| (*p, motion.apply(p))))
}

/// The least-squares rotation against the singular value decomposition's (Kabsch 1976), which this
/// project does not use: noise of a tenth of the points' spread, and mirrored points.
#[test]
fn noisy_and_mirrored_points_get_kabschs_rotation() {
    for seed in 0..500 {
        let (motion, points) = random_motion(seed);
        let mut rng = generator(102, seed);
        let mirrored = seed % 3 == 0;
        let pairs: Vec<_> = points
            .iter()
            .map(|p| {
                let from = if mirrored {
                    Vector3::new(-p.x, p.y, p.z)
                } else {
                    *p
                };
                let noise = Vector3::from([(); 3].map(|()| 30.0 * uniform(&mut rng)));
                (from, motion.apply(p) + noise)
            })
            .collect();
        let count = 12.0;
        let from_mean = pairs.iter().map(|p| p.0).sum::<Vector3<f64>>() / count;
        let to_mean = pairs.iter().map(|p| p.1).sum::<Vector3<f64>>() / count;
        let covariance = pairs.iter().fold(Matrix3::zeros(), |sum, (from, to)| {
            sum + (to - to_mean) * (from - from_mean).transpose()
        });
        let svd = covariance.svd(true, true);
        let (u, v_t) = (svd.u.unwrap(), svd.v_t.unwrap());
        let mut reflection = Matrix3::identity();
        reflection.m33 = (u * v_t).determinant().signum();
        let expected = u * reflection * v_t;
        let found = RigidTransform::align(pairs.iter().copied()).unwrap();
        assert!((found.rotation.determinant() - 1.0).abs() < 1e-13);
        // The gap of the eigenvalues of mirrored points can be small.
        assert!((found.rotation - expected).norm() < 1e-9, "seed {seed}");
    }
}

#[test]
fn too_few_points_and_bad_numbers_are_refused() {
    let (motion, points) = random_motion(0);
    assert_eq!(
        aligned(&motion, &points[..2]),
        Err(AlignmentError::TooFewPoints)
    );
    assert_eq!(
        aligned(&motion, &[points[0]; 5]),
        Err(AlignmentError::Collinear)
    );
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        let mut spoilt = points.clone();
        spoilt[3].y = bad;
        assert_eq!(
            aligned(&motion, &spoilt),
            Err(AlignmentError::NonFinite),
            "{bad}"
        );
    }
}
