//! Deviations of readings of any kind. Unknown planes, points and frames are first fitted to the readings, with the
//! robot held fixed.

use super::interval::{Deviation, Read, RowNoise};
use crate::accuracy::information::prior_covariance;
use crate::accuracy::repeats::Attained;
use crate::accuracy::rigid_motion::{RigidMotions, degenerate};
use crate::accuracy::uncertainty::{Sensitivities, first_inside};
use crate::calibration::refusal::{CalibrateError, Refused};
use crate::effects::Places;
use crate::files::robot_file::{KnownPlane, RobotFile, Tool};
use crate::files::samples_file::{Kind, READINGS, Reading, ReadingFrom, Readings};
use crate::fit::jointly::of_platform_point;
use crate::fit::solution::PARAMETERS;
use crate::fit::{Frame, Options, Unsolved, solve_with};
use crate::geometry::{Region, range};
use delta_cal::Tolerance;
use delta_cal::frame::RigidTransform;
use nalgebra::{DMatrix, DVector};

/// Tolerance that holds the robot fixed while the instruments are fitted: as a fraction of the forearm, and in radians.
const HELD: f64 = 1e-8;
/// Prior of an unknown plane: its distance (σ) in forearm lengths, and its tilt in radians.
const ANYWHERE: f64 = 10.0;
const TILT: f64 = 0.1;
/// Poses from which the variation of the error is computed, and the fewest.
const POSES: usize = 1000;
const FEWEST: usize = 30;
/// Step of a joint for derivatives, radians or mm.
const STEP: f64 = 1e-6;

pub(super) struct Deviations {
    pub(super) rows: Vec<Deviation>,
    /// Transform from the robot's frame to the sensor's, if fitted.
    pub(super) frame: Option<RigidTransform<f64>>,
    /// Of each row of the file, in the robot's frame.
    pub(super) attained: Vec<Option<Attained>>,
    pub(super) read: Read,
}

/// Computes the deviations of readings of any kind. `known`: the transform from the robot's frame to that of the
/// coordinates; it is fitted if it is unknown.
///
/// # Errors
/// The readings do not determine where the instruments are, or this robot cannot produce them.
pub(super) fn deviations(
    robot: &RobotFile,
    readings: &Readings,
    known: Option<RigidTransform<f64>>,
) -> Result<Deviations, CalibrateError> {
    let (places, leverages) = match known {
        Some(_) => of_other_instruments(robot, readings, known)?,
        None if readings.is_complete() => of_positions(robot, readings)?,
        None => of_instruments(robot, readings, Frame::Sensor)?,
    };
    let mut rows = Vec::new();
    let mut read = Read::default();
    for (index, (row, leverage)) in readings.rows.iter().zip(&leverages).enumerate() {
        for kind in Kind::ALL {
            let cells = row.value.read().into_iter().enumerate();
            let own =
                cells.filter(|(place, cell)| cell.is_some() && Kind::of_place(*place) == kind);
            let own: Vec<_> = own.map(|(place, _)| place).collect();
            if own.is_empty() {
                continue;
            }
            let found = deviation(robot, &places, row.line, &row.value, &own);
            let found = found.ok_or_else(|| {
                let cause = "does not reach these joint angles";
                readings.fault(index, format!("the robot of {} {cause}", robot.name))
            })?;
            let used: f64 = own.iter().map(|place| leverage[*place]).sum();
            let count = own.len() as f64;
            rows.push(Deviation {
                leverage: used / count,
                ..found
            });
            read.taken_up += used;
            read.coordinates += count;
        }
    }
    read.coordinates /= (rows.len() as f64).max(1.0);
    read.variation = [variation(robot, &rows, known.is_none()), of_noise(&rows)];
    let attained = readings.rows.iter();
    let attained = attained.map(|row| places.attained(&robot.robot, &row.value));
    Ok(Deviations {
        rows,
        attained: attained.collect(),
        frame: places.frame.filter(|_| known.is_none()),
        read,
    })
}

/// See [`Read::variation`]: n Σ 2 tr Sₖ²/(Σ tr Sₖ)² of the rows' covariances S, at most; 0 where none is stated.
fn of_noise(rows: &[Deviation]) -> f64 {
    let known = || rows.iter().filter_map(|row| row.noise);
    let sum: f64 = known().map(|own| own.mean_square).sum();
    let squares = known().map(|own| 2.0 * own.largest * own.largest * own.mean_square);
    if sum > 0.0 {
        rows.len() as f64 * squares.sum::<f64>() / (sum * sum)
    } else {
        0.0
    }
}

/// See [`Read::variation`]: from the tolerance, over the poses of the workspace between the measured ones; 0 of too few.
fn variation(robot: &RobotFile, rows: &[Deviation], relative: bool) -> f64 {
    let more = 1.0 / f64::max(rows.len() as f64 - 1.0, 1.0);
    let between = [0, 1, 2].map(|axis| {
        let (low, high) = range(rows.iter().map(|row| row.position[axis]));
        (low - more * (high - low), high + more * (high - low))
    });
    let mut reach = robot.reach();
    reach.within = Some(Region {
        ranges: between,
        radius: None,
    });
    let poses = first_inside(&robot.robot, &reach, POSES);
    let all = Sensitivities::<PARAMETERS>::of(&robot.robot, &Tool::default(), poses);
    let left = if relative { all.relative() } else { Some(all) };
    let [arm, ..] = robot.robot.arms();
    let usual = || Tolerance::new(1.0, 1.0 / arm.lb()).ok();
    let (Some(left), Some(tolerance)) = (left, robot.tolerance.or_else(usual)) else {
        return 0.0;
    };
    let covariance = prior_covariance(&robot.robot, &tolerance);
    if left.0.len() < FEWEST {
        0.0
    } else {
        left.variation(&covariance)
    }
}

/// Where the instruments are, and the fraction of each reading's deviation absorbed by fitting them, 0 to 1.
type Found = (Places, Vec<[f64; READINGS]>);

/// In a known frame: coordinates say nothing about planes and points.
fn of_other_instruments(
    robot: &RobotFile,
    readings: &Readings,
    known: Option<RigidTransform<f64>>,
) -> Result<Found, CalibrateError> {
    let mut leverages = vec![[0.0; READINGS]; readings.rows.len()];
    let mut others = readings.clone();
    for row in &mut others.rows {
        row.value.position = [None; 3];
    }
    let rows = others.rows.iter();
    let used: Vec<_> = rows.map(|row| row.value.readings() > 0).collect();
    let mut keep = used.iter();
    others.rows.retain(|_| keep.next() == Some(&true));
    let mut places = Places::default();
    if !others.rows.is_empty() {
        let (found, of_others) = of_instruments(robot, &others, Frame::Base)?;
        places = found;
        let own = leverages.iter_mut().zip(used).filter(|(_, used)| *used);
        own.zip(of_others).for_each(|((own, _), of)| *own = of);
    }
    places.frame = known;
    Ok((places, leverages))
}

/// For complete positions: the frame is the best rigid motion.
fn of_positions(robot: &RobotFile, readings: &Readings) -> Result<Found, Refused> {
    let mut places = Places::default();
    let mut leverages = vec![[0.0; READINGS]; readings.rows.len()];
    let samples: Vec<_> = readings.samples().collect();
    let [arm, ..] = robot.robot.arms();
    let points = samples.iter().map(|row| row.value.position);
    if let Some(how) = degenerate(points.clone(), arm.lb()) {
        let cause = format!("the measured points lie {how}, so the sensor frame is not determined");
        return Err(unknown_frame(readings, &cause));
    }
    let pairs = samples.iter().filter_map(|row| {
        let expected = robot.robot.forward(&row.value.joints).ok()?;
        Some((expected, row.value.position))
    });
    let found = RigidTransform::align(pairs).ok_or_else(|| {
        unknown_frame(readings, "the positions do not determine the sensor frame")
    })?;
    places.frame = Some(found);
    if let Some(motions) = RigidMotions::of(points.clone()) {
        for (leverage, point) in leverages.iter_mut().zip(points) {
            leverage[..3].fill(motions.leverage(&point));
        }
    }
    Ok((places, leverages))
}

/// The readings of the platform point. Where the points of distances are not known, a fit of them says what each of several
/// targets does to a distance.
///
/// # Errors
/// The distances do not determine where the points are.
pub(super) fn at_platform_point(
    robot: &RobotFile,
    readings: &Readings,
    known: Option<RigidTransform<f64>>,
) -> Result<Readings, CalibrateError> {
    let mut found = of_platform_point(robot, readings, known);
    let facts = &robot.instruments;
    let is_placed = |name: &String| facts.point(name).is_some_and(|own| own.place.is_some());
    let of_point = |own: &Reading| matches!(own.distance, Some((ReadingFrom::Point(_), _)));
    if facts.targets.len() < 2 || readings.points.iter().all(is_placed) {
        return Ok(found);
    }
    let mut distances = readings.clone();
    distances.rows.retain(|row| of_point(&row.value));
    for row in &mut distances.rows {
        (row.value.position, row.value.height) = ([None; 3], None);
    }
    let mut held = held(robot.clone());
    for own in &mut held.instruments.targets {
        own.sigma.fill(HELD);
    }
    let options = Options::in_frame(Frame::Base);
    let solution = solve_with(&held, &distances, &options, (&[], false));
    let cause = "the distances do not determine where their points are";
    let solution = solution.map_err(|_| unknown_frame(readings, cause))?;
    let rows = found.rows.iter_mut().filter(|row| of_point(&row.value));
    for (row, own) in rows.zip(&solution.readings.rows) {
        row.value.distance = own.value.distance;
    }
    Ok(found)
}

/// Everything is as stated.
fn held(mut robot: RobotFile) -> RobotFile {
    let [arm, ..] = robot.robot.arms();
    robot.tolerance = Tolerance::new(HELD * arm.lb(), HELD).ok();
    robot.transmission = None;
    robot.instruments.datum.clear();
    robot
}

fn of_instruments(
    robot: &RobotFile,
    readings: &Readings,
    frame: Frame,
) -> Result<Found, CalibrateError> {
    let [arm, ..] = robot.robot.arms();
    let mut held = held(robot.at_platform_point());
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
    let options = Options::in_frame(frame);
    // An inaccurate robot is no reason to refuse: the noise is as large as the deviations need.
    let solution = solve_with(&held, readings, &options, (&[], false)).map_err(|why| {
        if let Unsolved::Row(index, error) = why {
            return CalibrateError::from(readings.fault(index, error.to_string()));
        }
        let cause = "the readings do not determine where planes, points or the frame are";
        unknown_frame(readings, cause).into()
    })?;
    let leverages = solution.rows.iter().map(|row| row.leverage).collect();
    Ok((solution.places, leverages))
}

fn unknown_frame(readings: &Readings, cause: &str) -> Refused {
    let remedy = "Measure more poses, spread over the whole workspace.";
    Refused::new(format!("{}: {cause}", readings.name), remedy)
}

/// The deviation of a row's readings of one kind, at these indices. `None` if the robot does not reach the row.
fn deviation(
    robot: &RobotFile,
    places: &Places,
    line: u64,
    row: &Reading,
    own: &[usize],
) -> Option<Deviation> {
    let (read, expected) = (row.read(), places.expected(&robot.robot, row));
    let off = own
        .iter()
        .map(|place| Some(read[*place]? - expected[*place]?));
    let off = DVector::from(off.collect::<Option<Vec<_>>>()?);
    Some(Deviation {
        line,
        deviation_mm: off.norm(),
        joints: row.joints,
        position: robot.robot.forward(&row.joints).ok()?,
        leverage: 0.0,
        noise: noise(robot, places, row, own, &off),
    })
}

/// `None` if the noise of a reading is not stated, or the pose is singular.
fn noise(
    robot: &RobotFile,
    places: &Places,
    row: &Reading,
    own: &[usize],
    off: &DVector<f64>,
) -> Option<RowNoise> {
    let joint = robot.joint_noise().unwrap_or_default();
    let variance = |place: &usize| {
        let kind = Kind::of_place(*place);
        let stated = match kind {
            Kind::Position => robot.noise.map(|own| own.position_by_axis()[*place]),
            kind => robot.sigma(kind),
        };
        let sigma = row.sigma.filter(|_| row.kind() == Some(kind)).or(stated);
        sigma.map(|sigma| sigma * sigma)
    };
    let variances = own.iter().map(variance).collect::<Option<Vec<_>>>()?;
    let mut by_joints = DMatrix::zeros(own.len(), 3);
    for index in 0..3 {
        let [ahead, back] = [STEP, -STEP].map(|step| {
            let mut moved = *row;
            moved.joints[index] += step;
            places.expected(&robot.robot, &moved)
        });
        for (reading, place) in own.iter().enumerate() {
            let change = ahead[*place]? - back[*place]?;
            by_joints[(reading, index)] = joint * change / (2.0 * STEP);
        }
    }
    let of_joints = &by_joints * by_joints.transpose();
    let covariance = DMatrix::from_diagonal(&DVector::from(variances)) + of_joints;
    let weighed = covariance.clone().cholesky()?.solve(off);
    Some(RowNoise {
        mean_square: covariance.trace(),
        largest: covariance.symmetric_eigenvalues().max().max(0.0).sqrt(),
        squares: off.dot(&weighed),
    })
}
