//! Robots with errors, measured with noise, and what their errors really are.

use delta_cal::frame::RigidTransform;
use delta_cal::simulate::{random_pose, simulate_sample};
use delta_cal::{Noise, Robot, Sample};
use delta_cal_host::{Frame, InstrumentFacts, Readings, Record, RobotFile};
use delta_cal_tests::{Spread, measurements, paper_limits, perturbed, uniform};
use nalgebra::{Rotation3, Vector3};
use rand_pcg::Pcg32;

/// Poses over which the true error is taken.
const HELD_OUT: usize = 2000;

/// A robot, the one of its file, and what was measured.
pub(crate) struct Made {
    pub(crate) truth: Robot<f64>,
    pub(crate) nominal: Robot<f64>,
    pub(crate) samples: Vec<Sample<f64>>,
}

pub(crate) fn noise() -> Noise<f64> {
    Noise::new(0.02, 0.002_f64.to_radians()).unwrap()
}

/// Where the robot works: a cube on the axis, whose edge is this part of the forearm.
const REGION: f64 = 0.5;

/// The middle of the region: the joints at 40° or, where the robot does not get there or is near to a singularity,
/// at others.
fn centre(robot: &Robot<f64>) -> Vector3<f64> {
    let angles = [40_f64, 50.0, 60.0, 70.0, 80.0, 30.0, 20.0];
    let found = angles.into_iter().find_map(|degrees| {
        let joints = [degrees.to_radians(); 3];
        let place = robot.forward(&joints).ok()?;
        (robot.singularity_distance(&place, &joints).parallel > 0.1).then_some(place)
    });
    found.unwrap()
}

/// A random pose where the robot works, that both robots reach, within the joint limits.
fn pose(truth: &Robot<f64>, nominal: &Robot<f64>, rng: &mut Pcg32) -> [f64; 3] {
    let (centre, half) = (centre(nominal), 0.5 * REGION * nominal.arms()[0].lb());
    let limits = paper_limits();
    loop {
        let place = centre + Vector3::from_fn(|_, _| half * uniform(rng));
        let Ok(joints) = truth.inverse(&place) else {
            continue;
        };
        let within = joints
            .iter()
            .all(|q| *q > limits.minimum() && *q < limits.maximum());
        let clear = truth.singularity_distance(&place, &joints).is_clear();
        let there = truth
            .forward(&joints)
            .is_ok_and(|found| (found - place).norm() < 1e-6);
        if within && clear && there && nominal.forward(&joints).is_ok() {
            return joints;
        }
    }
}

/// With errors of that part of 0.5 mm and 0.2°.
fn robot(nominal: &Robot<f64>, factor: f64, rng: &mut Pcg32) -> Robot<f64> {
    let (length, angle) = (0.5 * factor, 0.2_f64.to_radians() * factor);
    perturbed(nominal, length, angle, Spread::Normal, rng)
}

/// Measured at random poses anywhere.
pub(crate) fn made_anywhere(nominal: &Robot<f64>, rows: usize, rng: &mut Pcg32) -> Made {
    let truth = robot(nominal, 1.0, rng);
    let samples = measurements(&truth, rows, Some(&noise()), rng);
    Made {
        truth,
        nominal: *nominal,
        samples,
    }
}

/// Measured at random poses where the robot works.
pub(crate) fn made(nominal: &Robot<f64>, factor: f64, rows: usize, rng: &mut Pcg32) -> Made {
    let truth = robot(nominal, factor, rng);
    let samples = (0..rows)
        .map(|_| {
            let joints = pose(&truth, nominal, rng);
            simulate_sample(&truth, &joints, Some(&noise()), rng).unwrap()
        })
        .collect();
    Made {
        truth,
        nominal: *nominal,
        samples,
    }
}

/// Where the robot is, and where its file says it is.
fn pairs(
    robot: &Made,
    joints: impl Iterator<Item = [f64; 3]>,
) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    joints
        .filter_map(|q| {
            Some((
                robot.truth.forward(&q).ok()?,
                robot.nominal.forward(&q).ok()?,
            ))
        })
        .collect()
}

fn held_out(robot: &Made, rng: &mut Pcg32) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let joints: Vec<_> = (0..HELD_OUT)
        .map(|_| pose(&robot.truth, &robot.nominal, rng))
        .collect();
    pairs(robot, joints.into_iter())
}

fn rms(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> f64 {
    let squares: f64 = pairs
        .iter()
        .map(|(is, said)| (is - said).norm_squared())
        .sum();
    #[allow(clippy::cast_precision_loss)] // 2000
    let number = pairs.len() as f64;
    (squares / number).sqrt()
}

/// Where the file's robot is after the rigid motion that fits the true one best.
fn moved(pairs: Vec<(Vector3<f64>, Vector3<f64>)>) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let frame = RigidTransform::align(pairs.iter().map(|(is, said)| (*said, *is))).unwrap();
    let moved = pairs.into_iter().map(|(is, said)| (is, frame.apply(&said)));
    moved.collect()
}

/// The rms error over all that the joints reach, as a calibration states it.
pub(crate) fn error_anywhere(robot: &Made, rng: &mut Pcg32) -> f64 {
    let joints: Vec<_> = (0..HELD_OUT)
        .map(|_| {
            random_pose(&robot.truth, &paper_limits(), rng)
                .unwrap()
                .joints
        })
        .collect();
    rms(&pairs(robot, joints.into_iter()))
}

/// The rms error over the region.
pub(crate) fn position_error(robot: &Made, rng: &mut Pcg32) -> f64 {
    rms(&held_out(robot, rng))
}

/// The same after the best rigid motion.
pub(crate) fn intrinsic(robot: &Made, rng: &mut Pcg32) -> f64 {
    rms(&moved(held_out(robot, rng)))
}

/// The largest error at the measured poses.
pub(crate) fn largest(robot: &Made, frame: Frame) -> f64 {
    let at = pairs(robot, robot.samples.iter().map(|sample| sample.joints));
    let at = match frame {
        Frame::Base => at,
        Frame::Sensor => moved(at),
    };
    let lengths = at.iter().map(|(is, said)| (is - said).norm());
    lengths.fold(0.0, f64::max)
}

/// The robot file that states the noise.
pub(crate) fn robot_file(robot: &Robot<f64>) -> RobotFile {
    RobotFile {
        name: "robot.toml".to_owned(),
        robot: *robot,
        limits: paper_limits(),
        forearm_limit: None,
        tolerance: None,
        noise: Some(noise()),
        sensor_frame: None,
        transmission: None,
        instruments: InstrumentFacts::default(),
        record: Record::default(),
    }
}

/// The measurements, in the frame of a sensor somewhere if that is asked for.
pub(crate) fn samples_file(robot: &Made, frame: Frame) -> Readings {
    let at = match frame {
        Frame::Base => RigidTransform::identity(),
        Frame::Sensor => RigidTransform {
            rotation: Rotation3::from_euler_angles(0.3, -0.5, 2.0).into_inner(),
            translation: Vector3::new(1200.0, -700.0, 300.0),
        },
    };
    let samples = robot.samples.iter().map(|sample| Sample {
        joints: sample.joints,
        position: at.apply(&sample.position),
    });
    Readings::of_samples("samples.csv", &samples.collect::<Vec<_>>())
}
