//! Forward and inverse kinematics: published robots, round trips, frames, and every error.

use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::{KinematicsError, SingularityDistance};
use delta_cal::robot::{Arm, GeometryError};
use delta_cal::{ArmIndex, Parameter, Robot, SymmetricRobot};
use delta_cal_tests::geometries::symmetric;
use delta_cal_tests::{Spread, generator, paper_robot, perturbed, uniform};
use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;

fn degrees(q: [f64; 3]) -> [f64; 3] {
    q.map(f64::to_radians)
}

/// The Delta of the Trossen forum, mm, and Williams's FlexPicker, m, as far as their decimals go.
#[test]
fn published_positions_are_reached() {
    let root3 = 3f64.sqrt();
    for ([base_radius, platform_radius, upper_arm, forearm], level, bent, close) in [
        (
            [457.3 / (2.0 * root3), 115.0 / (2.0 * root3), 112.0, 232.0],
            [0.0, 0.0, -96.8590],
            [10.1168, -16.3280, -148.1187],
            1e-4,
        ),
        (
            [0.567 * root3 / 6.0, 0.076 * root3 / 3.0, 0.524, 1.244],
            [0.0, 0.0, -1.06445],
            [0.10814, -0.18035, -1.24354],
            1e-5,
        ),
    ] {
        let robot = SymmetricRobot {
            base_radius,
            platform_radius,
            upper_arm,
            forearm,
        };
        let robot = robot.robot_from_azimuth(-90f64.to_radians()).unwrap();
        for (joints, expected) in [([0.0; 3], level), ([10.0, 20.0, 30.0], bent)] {
            let x = robot.forward(&degrees(joints)).unwrap();
            assert!((x - Vector3::from(expected)).norm() < close, "{x}");
        }
    }
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
fn a_pose_that_does_not_exist_names_its_cause_and_arm() {
    use KinematicsError::{NonFinite, Parallel, Serial, Unreachable};
    let [first, second, third] = ArmIndex::ALL;
    let paper = paper_robot::<f64>();
    // A folded arm whose forearm ends on its motor axis reaches that point at every joint angle.
    let folded = with_forearms(&paper, [260.0, 480.0, 480.0]);
    let axis = paper.arm(first).d();
    // Arm 1 straight out at 40° below the horizontal: elbow and platform on one line from the axis.
    let down = 40_f64.to_radians();
    let along = Vector3::new(down.cos(), 0.0, -down.sin());
    let stretched = axis + along * 740.0;
    for (robot, x, error) in [
        // Far out along arm 2's azimuth: the opposite arms fail, the first of them is named.
        (
            &paper,
            Vector3::new(-600.0, 0.0, -400.0),
            Unreachable(first),
        ),
        (&paper, stretched, Serial(first)),
        (&paper, stretched + along, Unreachable(first)),
        (
            &paper,
            Vector3::new(f64::NAN, 0.0, -400.0),
            NonFinite(first),
        ),
        (&folded, axis, Serial(first)),
    ] {
        assert_eq!(robot.inverse(&x), Err(error), "{x}");
    }
    let short = with_forearms(&paper, [480.0, 150.0, 480.0]);
    // Elbows in one place or on one line hold nothing.
    let arm = |x: f64| Arm::new([x, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0]).unwrap();
    let same = Robot::new([arm(164.0); 3]).unwrap();
    let line = Robot::new([arm(0.0), arm(100.0), arm(250.0)]).unwrap();
    for (robot, joints, error) in [
        (&short, degrees([-30.0; 3]), Unreachable(second)),
        (&paper, [0.0, f64::NAN, 0.0], NonFinite(second)),
        (&paper, [0.0, 0.0, f64::INFINITY], NonFinite(third)),
        (&same, [0.1; 3], Parallel(first)),
        (&line, [0.1; 3], Parallel(first)),
    ] {
        assert_eq!(robot.forward(&joints), Err(error), "{joints:?}");
    }
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
    let not_positive = GeometryError::NotPositive;
    for (parameter, value, error) in [
        (Parameter::Lb, 0.0, not_positive(Parameter::Lb)),
        (Parameter::Lb, -1.0, not_positive(Parameter::Lb)),
        (Parameter::LaX, 0.0, not_positive(Parameter::LaX)),
        (Parameter::Alpha, 1.6, GeometryError::TiltTooLarge),
        (Parameter::Theta, 7.0, GeometryError::AzimuthTooLarge),
        (
            Parameter::Dx,
            1e200,
            GeometryError::NonFinite(Parameter::Dx),
        ),
    ] {
        assert_eq!(with(parameter, value), Err(error));
    }

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

fn aligned(motion: &RigidTransform<f64>, points: &[Vector3<f64>]) -> Option<RigidTransform<f64>> {
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
    assert_eq!(aligned(&motion, &points[..2]), None);
    assert_eq!(aligned(&motion, &[points[0]; 5]), None);
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        let mut spoilt = points.clone();
        spoilt[3].y = bad;
        assert_eq!(aligned(&motion, &spoilt), None, "{bad}");
    }
}

fn with_forearms(robot: &Robot<f64>, forearms: [f64; 3]) -> Robot<f64> {
    let mut parameters = robot.parameters();
    for (arm, forearm) in parameters.iter_mut().zip(forearms) {
        arm[7] = forearm;
    }
    robot.with_parameters(parameters).unwrap()
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
        let robot = symmetric([distance, 0.0, 260.0, 480.0]);
        // Upper arms straight down: the elbows are as far from each other as the motors.
        let x = robot.forward(&[std::f64::consts::FRAC_PI_2; 3]).unwrap();
        assert!((x.z + 740.0).abs() < 1e-3 && x.xy().norm() < 1e-3, "{x}");
    }
    // And far apart.
    let large = symmetric([1e7, 0.0, 1e7, 2.5e7]);
    let x = large.forward(&[0.0; 3]).unwrap();
    assert!((x.z + 1.5e7).abs() < 1e-6);
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
            let robot = symmetric([radius - 200.0, 0.0, 200.0, forearm]);
            let found = robot.forward(&[0.0; 3]);
            if refused {
                assert!(
                    matches!(found, Err(KinematicsError::Parallel(_))),
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
        let robot = symmetric([400.0, 0.0, 260.0, 480.0]);
        let parameters = robot.parameters().map(|[x, y, z, rest @ ..]| {
            let [a, b, c, d, e] = rest;
            [x + shift[0], y + shift[1], z + shift[2], a, b, c, d, e]
        });
        let robot = robot.with_parameters(parameters).unwrap();
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
        Err(KinematicsError::Serial(ArmIndex::First))
    );
    let (robot, x, q) = nearly_stretched(1.4 * limit);
    assert!(robot.platform_jacobian(&x, &q).is_ok());
}

/// det of the forearms' unit vectors below √ε; here (3√3/2) (r/Lb)² h/Lb with r ≈ Lb.
#[test]
fn a_platform_close_to_the_elbows_plane_has_no_jacobian() {
    let limit = f64::EPSILON.sqrt() / (1.5 * 3f64.sqrt());
    for forearm in [300.0, 480.0, 505.0, 700.0] {
        let robot = symmetric([forearm - 200.0, 0.0, 200.0, forearm]);
        let at = |height: f64| {
            robot.platform_jacobian(&Vector3::new(0.0, 0.0, -height * forearm), &[0.0; 3])
        };
        let within = at(0.7 * limit);
        assert!(
            matches!(within, Err(KinematicsError::Parallel(_))),
            "{forearm} {within:?}"
        );
        // Beyond it what fails, if anything, are the joints.
        let beyond = at(1.4 * limit);
        assert!(
            !matches!(beyond, Err(KinematicsError::Parallel(_))),
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
                Err(KinematicsError::Parallel(ArmIndex::ALL[named])),
                "{lengths:?}"
            );
        }
    }
    // A platform at an elbow, where no forearm is.
    let robot = paper_robot::<f64>();
    let elbow = robot.arm(ArmIndex::First).elbow(0.2);
    assert!(matches!(
        robot.platform_jacobian(&elbow, &[0.2; 3]),
        Err(KinematicsError::Parallel(_))
    ));
}
