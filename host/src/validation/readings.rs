//! Deviations of readings of any kind. Unknown planes, points and frames are first fitted to the readings, with the
//! robot held fixed.

use super::interval::{Read, RowDeviation, RowNoise};
use crate::accuracy::rigid_motion::{RigidMotions, degenerate};
use crate::calibration::refusal::{CalibrateError, Refused};
use crate::files::input::InputError;
use crate::files::robot_file::{KnownPlane, RobotFile};
use crate::files::samples_file::{Kind, READINGS, Reading, ReadingFrom, Readings};
use crate::fit::solution::Places;
use crate::fit::{Frame, Options, Unsolved, solve};
use delta_cal::frame::RigidTransform;
use delta_cal::{Robot, Sample, Tolerance};
use nalgebra::{DMatrix, DVector, Vector3};

/// Tolerance that holds the robot fixed while the instruments are fitted: as a fraction of the forearm, and in radians.
const HELD: f64 = 1e-8;

/// Prior of an unknown plane: its distance (σ) in forearm lengths, and its tilt in radians.
const ANYWHERE: f64 = 10.0;
const TILT: f64 = 0.1;

/// The deviations of all readings.
pub(super) struct Deviations {
    pub(super) rows: Vec<RowDeviation>,
    /// Transform from the robot's frame to the sensor's, if fitted.
    pub(super) frame: Option<RigidTransform<f64>>,
    pub(super) read: Read,
}

/// Computes the deviations of readings of any kind, with a known or a fitted frame.
///
/// # Errors
/// The readings do not determine where the instruments are, or this robot cannot produce them.
pub(super) fn deviations(
    robot: &RobotFile,
    readings: &Readings,
    frame: Frame,
) -> Result<Deviations, CalibrateError> {
    let (places, leverages) = if readings.is_complete() {
        of_positions(robot, readings, frame)?
    } else {
        of_instruments(robot, readings, frame).map_err(|why| {
            if let Unsolved::Row(index, error) = why {
                return readings.fault(index, error.to_string()).into();
            }
            let cause = "the readings do not determine where planes, points or the frame are";
            CalibrateError::from(unknown_frame(readings, cause))
        })?
    };
    let (mut rows, mut taken_up, mut coordinates) = (Vec::new(), 0.0, 0.0);
    for (index, (row, leverage)) in readings.rows.iter().zip(&leverages).enumerate() {
        for kind in Kind::ALL {
            let of = deviation(robot, &places, &row.value, kind, leverage);
            let (own, used, count) = of.ok_or_else(|| unreachable(robot, readings, index))?;
            rows.extend(own.map(|own| RowDeviation {
                line: row.line,
                ..own
            }));
            taken_up += used;
            coordinates += count;
        }
    }
    Ok(Deviations {
        read: Read {
            coordinates: coordinates / (rows.len() as f64).max(1.0),
            taken_up,
        },
        rows,
        frame: places.frame,
    })
}

/// Where the instruments are, and the fraction of each reading's deviation absorbed by fitting them, 0 to 1.
type Found = (Places, Vec<[f64; READINGS]>);

/// For complete positions; the sensor's frame is the best rigid motion.
fn of_positions(robot: &RobotFile, readings: &Readings, frame: Frame) -> Result<Found, Refused> {
    let mut places = Places::default();
    let mut leverages = vec![[0.0; READINGS]; readings.rows.len()];
    if frame == Frame::Base {
        return Ok((places, leverages));
    }
    let samples: Vec<_> = readings.samples().collect();
    let [arm, ..] = robot.robot.arms();
    let points = samples.iter().map(|row| row.value.position);
    if let Some(how) = degenerate(points.clone(), arm.lb()) {
        let cause =
            format!("the measured points lie {how}, so the sensor's frame is not determined");
        return Err(unknown_frame(readings, &cause));
    }
    let pairs = samples.iter().filter_map(|row| {
        let expected = robot.robot.forward(&row.value.joints).ok()?;
        Some((expected, row.value.position))
    });
    let found = RigidTransform::align(pairs);
    places.frame = Some(found.map_err(|error| unknown_frame(readings, &error.to_string()))?);
    if let Some(motions) = RigidMotions::of(points.clone()) {
        for (leverage, point) in leverages.iter_mut().zip(points) {
            leverage[..3].fill(motions.leverage(&point));
        }
    }
    Ok((places, leverages))
}

fn of_instruments(robot: &RobotFile, readings: &Readings, frame: Frame) -> Result<Found, Unsolved> {
    let [arm, ..] = robot.robot.arms();
    let mut held = robot.clone();
    held.tolerance = Tolerance::new(HELD * arm.lb(), HELD).ok();
    held.transmission = None;
    // An inaccurate robot is no reason to refuse, so the noise is taken from the deviations.
    held.noise = None;
    held.instruments.height_noise = None;
    held.instruments.distance_noise = None;
    // Poses above one another do not show a plane's tilt, so the plane is assumed nearly level.
    for name in &readings.planes {
        let mut planes = held.instruments.planes.iter();
        if planes.all(|plane| plane.name != *name) {
            held.instruments.planes.push(KnownPlane {
                name: name.clone(),
                line: 0,
                height: 0.0,
                sigma: ANYWHERE * arm.lb(),
                tilt: Some(TILT),
                blocks: Vec::new(),
            });
        }
    }
    let options = Options {
        frame,
        ..Options::default()
    };
    let solution = solve(&held, readings, &options)?;
    let leverages = solution.rows.iter().map(|row| row.leverage).collect();
    Ok((solution.places, leverages))
}

fn unknown_frame(readings: &Readings, cause: &str) -> Refused {
    let remedy = "measure more poses, spread over the whole workspace";
    Refused::new(format!("{}: {cause}", readings.name), remedy)
}

fn unreachable(robot: &RobotFile, readings: &Readings, index: usize) -> InputError {
    let cause = format!(
        "the robot of {} does not reach these joint angles",
        robot.name
    );
    readings.fault(index, cause)
}

/// The deviation of a row's readings of one kind, how many of them the fit used up, and their number. `None` if
/// the robot does not reach the row.
fn deviation(
    robot: &RobotFile,
    places: &Places,
    reading: &Reading,
    kind: Kind,
    leverage: &[f64; READINGS],
) -> Option<(Option<RowDeviation>, f64, f64)> {
    let position = robot.robot.forward(&reading.joints).ok()?;
    let expected = places.expected(&robot.robot, reading);
    let (mut off, mut used) = (Vector3::zeros(), 0.0);
    let mut noises = Vec::with_capacity(READINGS);
    for (place, read) in reading.read().into_iter().enumerate() {
        let (Some(read), true) = (read, Kind::of_place(place) == kind) else {
            continue;
        };
        let axis = if kind == Kind::Position { place } else { 2 };
        off[axis] = read - expected[place]?;
        used += leverage[place];
        let along = direction(robot, places, reading, place, &position)?;
        noises.push((axis, along, noise(robot, kind, axis)));
    }
    let count = noises.len() as f64;
    if noises.is_empty() {
        return Some((None, 0.0, 0.0));
    }
    let own = RowDeviation {
        line: 0,
        measured: Sample {
            joints: reading.joints,
            position,
        },
        deviation: off,
        leverage: used / count,
        noise: row_noise(&robot.robot, &reading.joints, &position, &off, &noises),
    };
    Some((Some(own), used, count))
}

/// Axis of a reading's deviation, ∂h/∂X, and σ of the reading and of the joints.
type ReadingNoise = (usize, Vector3<f64>, Option<(f64, f64)>);

/// `None` if the noise of a reading is not stated, or the pose is singular.
fn row_noise(
    robot: &Robot<f64>,
    joints: &[f64; 3],
    position: &Vector3<f64>,
    off: &Vector3<f64>,
    noises: &[ReadingNoise],
) -> Option<RowNoise> {
    let by_joints = robot.platform_jacobian(position, joints).ok()?.by_joints;
    let count = noises.len();
    let mut by_joint = DMatrix::zeros(count, 3);
    let mut covariance = DMatrix::zeros(count, count);
    for (index, (_, along, noise)) in noises.iter().enumerate() {
        let (sigma, joint) = (*noise)?;
        by_joint.set_row(index, &(along.transpose() * by_joints * joint));
        covariance[(index, index)] = sigma * sigma;
    }
    covariance += &by_joint * by_joint.transpose();
    let deviation = DVector::from_iterator(count, noises.iter().map(|own| off[own.0]));
    let weighed = covariance.clone().cholesky()?.solve(&deviation);
    Some(RowNoise {
        mean_square: covariance.trace(),
        largest: covariance.symmetric_eigenvalues().max().max(0.0).sqrt(),
        squares: deviation.dot(&weighed),
    })
}

/// σ of a reading and of the joints, if stated.
fn noise(robot: &RobotFile, kind: Kind, axis: usize) -> Option<(f64, f64)> {
    let facts = &robot.instruments;
    let joint = robot.noise.map(|own| own.joint()).or(facts.joint_noise);
    let sigma = match kind {
        Kind::Position => robot.noise.map(|own| own.position_by_axis()[axis]),
        Kind::Height => facts.height_noise,
        Kind::Distance => facts.distance_noise,
    };
    Some((sigma?, joint.unwrap_or_default()))
}

/// ∂h/∂X of a reading.
fn direction(
    robot: &RobotFile,
    places: &Places,
    reading: &Reading,
    place: usize,
    position: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    match Kind::of_place(place) {
        Kind::Position => Some(match &places.frame {
            Some(frame) => frame.rotation.row(place).transpose(),
            None => Vector3::ith(place, 1.0),
        }),
        Kind::Height => Some(places.planes.get(reading.height?.0)?.normal),
        Kind::Distance => {
            let begin = match reading.distance?.0 {
                ReadingFrom::Point(point) => places.points.get(point)?.place,
                ReadingFrom::Pose(joints) => robot.robot.forward(&joints).ok()?,
            };
            Some((position - begin).normalize())
        }
    }
}
