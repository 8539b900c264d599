//! Robots of several geometries, made to a tolerance, and measurements of them.

use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Arm;
use delta_cal::simulate::{random_pose, simulate_sample};
use delta_cal::{Noise, Robot, Sample, SymmetricRobot, Tolerance};
use delta_cal_host::{InstrumentFacts, PositionUnit, Record, RobotFile, Row, SamplesFile};
use delta_cal_tests::{Spread, paper_limits, perturbed, uniform};
use nalgebra::{Rotation3, Vector3};
use rand_pcg::Pcg32;

/// A name and a nominal robot.
pub(crate) type Geometry = (&'static str, Robot<f64>);

fn symmetric(lengths: [f64; 4]) -> Robot<f64> {
    let [base_radius, platform_radius, upper_arm, forearm] = lengths;
    let robot = SymmetricRobot {
        base_radius,
        platform_radius,
        upper_arm,
        forearm,
    };
    robot.robot().unwrap()
}

fn changed(robot: &Robot<f64>, changes: [[f64; 8]; 3]) -> Robot<f64> {
    let arms = [0, 1, 2].map(|arm| {
        let mut values = robot.arms()[arm].parameters();
        for (value, change) in values.iter_mut().zip(changes[arm]) {
            *value += change;
        }
        Arm::new(values).unwrap()
    });
    Robot::new(arms).unwrap()
}

/// Six proportions, three different arms at uneven azimuths, and tilted motor axes.
pub(crate) fn geometries() -> Vec<Geometry> {
    let paper = symmetric([194.0, 30.0, 260.0, 480.0]);
    vec![
        ("194/30/260/480", paper),
        ("200/45/235/800", symmetric([200.0, 45.0, 235.0, 800.0])),
        ("60/40/400/900", symmetric([60.0, 40.0, 400.0, 900.0])),
        ("60/110/250/520", symmetric([60.0, 110.0, 250.0, 520.0])),
        ("150/60/250/275", symmetric([150.0, 60.0, 250.0, 275.0])),
        ("60/25/80/180", symmetric([60.0, 25.0, 80.0, 180.0])),
        (
            "uneven arms",
            changed(
                &paper,
                [
                    [0.0, 0.0, 0.0, 0.0, 0.0, -20.0, 0.0, -10.0],
                    [10.0, 0.0, 15.0, -0.1, 0.0, 0.0, 0.0, 0.0],
                    [0.0, -15.0, -10.0, 0.15, 0.0, 30.0, 0.0, 40.0],
                ],
            ),
        ),
        (
            "tilted axes",
            changed(
                &paper,
                [0.2, -0.25, 0.3].map(|tilt| [0.0, 0.0, 0.0, 0.0, tilt, 0.0, 0.0, 0.0]),
            ),
        ),
    ]
}

/// One σ of the parts as made.
pub(crate) fn tolerance() -> Tolerance<f64> {
    Tolerance::new(0.5, 0.2_f64.to_radians()).unwrap()
}

/// One σ of a measurement.
pub(crate) fn noise() -> Noise<f64> {
    Noise::new(0.02, 0.002_f64.to_radians()).unwrap()
}

/// Where a robot is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Poses {
    /// So many, evenly in joint space.
    Spread(usize),
    /// So many in a cube, whose edge is that part of the first forearm.
    Cube(usize, f64),
}

/// A robot as it was made, and what was measured of it.
pub(crate) struct Made {
    pub(crate) truth: Robot<f64>,
    /// In the robot's frame.
    pub(crate) samples: Vec<Sample<f64>>,
}

/// Made to the tolerance times a factor.
pub(crate) fn made(nominal: &Robot<f64>, factor: f64, poses: Poses, rng: &mut Pcg32) -> Made {
    let (length, angle) = (0.5 * factor, 0.2_f64.to_radians() * factor);
    let truth = perturbed(nominal, length, angle, Spread::Normal, rng);
    let joints: Vec<_> = match poses {
        Poses::Spread(count) => (0..count).map(|_| spread_pose(&truth, rng)).collect(),
        Poses::Cube(count, part) => {
            let centre = cube_centre(nominal);
            let half = 0.5 * part * nominal.arms()[0].lb();
            (0..count)
                .map(|_| pose_in_cube(&truth, &centre, half, rng))
                .collect()
        }
    };
    let samples = joints
        .iter()
        .map(|q| simulate_sample(&truth, q, Some(&noise()), rng).unwrap())
        .collect();
    Made { truth, samples }
}

/// Joint angles that were not measured.
pub(crate) fn spread_pose(robot: &Robot<f64>, rng: &mut Pcg32) -> [f64; 3] {
    random_pose(robot, &paper_limits(), rng).unwrap().joints
}

/// On the axis, the joints at 40° or, where the robot does not get there or is near to a
/// singularity, at others.
fn cube_centre(robot: &Robot<f64>) -> Vector3<f64> {
    [40_f64, 50.0, 60.0, 70.0, 80.0, 30.0, 20.0]
        .map(|degrees| [degrees.to_radians(); 3])
        .into_iter()
        .find_map(|q| {
            let x = robot.forward(&q).ok()?;
            let clear = robot.singularity_distance(&x, &q).parallel > 0.1;
            clear.then_some(x)
        })
        .unwrap()
}

fn pose_in_cube(robot: &Robot<f64>, centre: &Vector3<f64>, half: f64, rng: &mut Pcg32) -> [f64; 3] {
    let limits: JointLimits<f64> = paper_limits();
    loop {
        let x = centre + Vector3::from_fn(|_, _| half * uniform(rng));
        let Ok(q) = robot.inverse(&x) else { continue };
        let within = q
            .iter()
            .all(|q| *q > limits.minimum() && *q < limits.maximum());
        let there = robot
            .forward(&q)
            .is_ok_and(|found| (found - x).norm() < 1e-6);
        if within && there && robot.singularity_distance(&x, &q).is_clear() {
            return q;
        }
    }
}

/// The robot file that states these.
pub(crate) fn robot_file(nominal: &Robot<f64>, stated: (bool, bool)) -> RobotFile {
    RobotFile {
        name: "robot.toml".to_owned(),
        robot: *nominal,
        limits: paper_limits(),
        forearm_limit: None,
        tolerance: stated.0.then(tolerance),
        noise: stated.1.then(noise),
        sensor_frame: None,
        transmission: None,
        instruments: InstrumentFacts::default(),
        record: Record::default(),
    }
}

pub(crate) fn samples_file(samples: &[Sample<f64>], frame: &RigidTransform<f64>) -> SamplesFile {
    let rows = (2..).zip(samples).map(|(line, sample)| Row {
        line,
        value: Sample {
            joints: sample.joints,
            position: frame.apply(&sample.position),
        },
    });
    SamplesFile {
        name: "samples.csv".to_owned(),
        rows: rows.collect(),
        all: None,
        in_degrees: true,
        positions_in: PositionUnit::Millimetre,
    }
}

/// A tracker's place and orientation.
pub(crate) fn tracker() -> RigidTransform<f64> {
    RigidTransform {
        rotation: Rotation3::from_euler_angles(0.3, -0.5, 2.0).into_inner(),
        translation: Vector3::new(1200.0, -700.0, 300.0),
    }
}
