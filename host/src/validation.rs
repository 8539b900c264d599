//! Validates a robot file against independent measurements.
//!
//! ```text
//! RobotFile, SamplesFile, Request ─→ deviations ─→ rms and largest error with their intervals ─→ verdict
//! ```

mod comparison;
mod interval;
mod readings;

use crate::accuracy::expanded::of_vectors;
use crate::accuracy::position_error::{OUTLIER, PositionError};
use crate::accuracy::repeats::{Attained, Repeatability};
use crate::calibration::refusal::{CalibrateError, Refused};
use crate::calibration::unused_rotations;
use crate::effects::orientations;
use crate::explain::{Diagnosis, Step, diagnose, search};
use crate::files::input::{InputError, InputText};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind, Readings};
use crate::fit::datum::Datum;
use crate::fit::instruments::FrameReport;
use crate::fit::observations::is_stated;
use crate::fit::{Case, Frame, Options};
use crate::geometry::{NUMBERS, centroid};
use crate::text::{count, degrees};
pub use comparison::Comparison;
use delta_cal::frame::RigidTransform;
pub use interval::{Bounded, Deviation, RmsError, Verdict};
use interval::{Read, largest, rms_error};
use nalgebra::Vector3;
use readings::{Deviations, at_platform_point, deviations};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::collections::BTreeMap;

/// Fewer distinct poses than this do not show how the error varies.
const LEAST_POSES: usize = 8;
/// The same when the sensor's frame is fitted, which uses up six coordinates.
const LEAST_POSES_OF_SENSOR: usize = 10;
/// The stated noise is too large if deviations this small are less probable than this: one-sided 3 σ (normal).
const IMPROBABLE: f64 = 0.00135;
/// The stored frame is an old one if another leaves less than this part of the deviations.
const MOVED: f64 = 0.5;

/// The question to be answered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// Limit of the rms position error, mm.
    pub limit: f64,
    /// The frame in which the positions were measured.
    pub frame: Frame,
    /// Whether to use the sensor's frame stored in the robot file rather than fit it.
    pub stored: bool,
}

/// The result of validating a calibrated robot. Lengths are in the units and axes of the robot file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Validation {
    /// Name of the robot file.
    pub robot_file: String,
    /// Name of the samples file.
    pub samples_file: String,
    /// The frame in which the positions were measured, or the base's if the sensor's is known.
    pub frame: Frame,
    /// Whether the limit is met.
    pub verdict: Verdict,
    /// What happened during the measurement: everything here is of the rows before it.
    pub step: Option<Step>,
    /// Over the measured region, without the noise.
    pub rms_error: RmsError,
    /// The largest position error at the measured poses, without the noise.
    pub largest_error: Bounded,
    /// Deviations over all rows, including the instrument's noise.
    pub deviation_mm: PositionError,
    /// rms and largest angle, degrees, between the measured rotations and those of the calibrated platform, about the mean of
    /// each target, which is how it is mounted; `None` if no rotation was measured or the rods are not known.
    pub rotation_deg: Option<[f64; 2]>,
    /// Mean, rms and largest absolute deviation along x, y and z of the robot file and in space, of rows with all three.
    pub axes_mm: Vec<[f64; 3]>,
    /// Pose accuracy and repeatability, if poses were repeated.
    pub repeatability: Option<Repeatability>,
    /// By what the limit is narrowed to pass, and widened to fail (ISO 14253-1); `None` with simple acceptance.
    pub guard_band_mm: Option<f64>,
    /// rms noise removed from the deviations; `None` if none was removed.
    pub noise_mm: Option<f64>,
    /// Number of rows.
    pub row_count: usize,
    /// Number of distinct poses.
    pub pose_count: usize,
    /// Measured region: smallest and largest x, y and z.
    pub region_mm: [(f64, f64); 3],
    /// The sensor's frame, if fitted.
    pub sensor_frame: Option<FrameReport>,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Names of rows, by line.
    #[serde(skip)]
    pub names: BTreeMap<u64, String>,
    /// Deviations in file order.
    #[serde(skip)]
    pub rows: Vec<Deviation>,
    /// The kind of the readings if they are all of one kind.
    #[serde(skip)]
    pub kind: Option<Kind>,
    /// Whether datum points give the frame.
    #[serde(skip)]
    of_datum: bool,
}

/// Of the expanded uncertainty of the instrument.
const COVERAGE_FACTOR: f64 = 2.0;

impl Validation {
    /// Judges with a guard band (ISO 14253-1): the expanded uncertainty of what the instrument adds to all deviations alike,
    /// its scale, target and datum. Its noise is part of the interval.
    #[must_use]
    pub fn guarded(mut self, robot: &RobotFile) -> Self {
        let facts = &robot.instruments;
        let count = self.rows.len().max(1) as f64;
        let mean_square = |from: &Vector3<f64>| {
            let all = self
                .rows
                .iter()
                .map(|row| (row.position - from).norm_squared());
            all.sum::<f64>() / count
        };
        let known = self.frame == Frame::Base;
        let from = if known {
            Vector3::zeros()
        } else {
            centroid(self.rows.iter().map(|row| row.position))
        };
        let mut variance = facts.scale_sigma().powi(2) * mean_square(&from);
        if known && let Some(target) = facts.targets.first() {
            variance += target.sigma.norm_squared();
        }
        if known && self.of_datum && !facts.datum.is_empty() {
            let points = facts.datum.len() as f64;
            let noise = robot.noise.map_or(0.0, |own| own.position());
            let stated = facts
                .datum
                .iter()
                .map(|own| own.sigma.unwrap_or(noise).powi(2));
            let square = stated.sum::<f64>() / points;
            let places = facts.datum.iter().map(|own| own.place);
            let centre = centroid(places.clone());
            let out = places.map(|own| (own - centre).norm_squared());
            let out = out.sum::<f64>() / points;
            variance += 3.0 * square / points * (1.0 + mean_square(&centre) / out.max(1.0));
        }
        let band = COVERAGE_FACTOR * variance.sqrt();
        let limit = self.rms_error.limit_mm;
        self.guard_band_mm = Some(band);
        if self.verdict != Verdict::NotJudged {
            let passes = Verdict::of(&self.rms_error.error, limit - band) == Verdict::Pass;
            let fails = Verdict::of(&self.rms_error.error, limit + band) == Verdict::Fail;
            self.verdict = match (passes, fails) {
                (true, _) => Verdict::Pass,
                (_, true) => Verdict::Fail,
                _ => Verdict::Undecided,
            };
        }
        self
    }
}

/// Checks that a robot was not calibrated from these samples: `calibrate` writes their SHA-256 to its file.
///
/// # Errors
/// The robot was calibrated from these samples.
pub fn check_independent(robot: &InputText, samples: &InputText) -> Result<(), InputError> {
    if !robot.text().contains(samples.sha256()) {
        return Ok(());
    }
    let cause = format!("{} was calibrated from the same measurements", robot.name());
    Err(InputError::new(samples.name(), cause)
        .with_remedy("measure other poses, spread over the region in which the robot works"))
}

/// Checks whether the robot's positions agree with its file to within a limit.
///
/// # Errors
/// Too few poses, poses that do not determine the sensor's frame, joint angles that the robot does not reach, or
/// samples that are wrong altogether.
pub fn validate(
    robot: &RobotFile,
    readings: &Readings,
    request: Request,
) -> Result<Validation, CalibrateError> {
    let robot = &readings.noise_into(robot);
    if request.frame == Frame::Sensor
        && !request.stored
        && let Some(missing) = readings.missing_datum(robot)
    {
        return Err(missing.into());
    }
    let known = known_frame(robot, request)?;
    let frame = known.map_or(Frame::Sensor, |_| Frame::Base);
    let mut readings = at_platform_point(robot, readings, known)?;
    let (diagnosis, step) = explained(robot, &readings, known.as_ref());
    if let Some(step) = &step {
        readings.rows.truncate(step.row);
    }
    let readings = &readings;
    let refused = |cause: String, remedy: &str| {
        let refused = Refused::new(format!("{}: {cause}", readings.name), remedy);
        CalibrateError::from(refused.explained(diagnosis.clone()))
    };
    let poses = readings.distinct_poses();
    if let Some(cause) = too_few(poses, frame, step.as_ref()) {
        let remedy = "Measure about 20 poses, spread over the region in which the robot works.";
        return Err(refused(cause, remedy));
    }
    let Deviations {
        mut rows,
        attained,
        frame: fitted,
        read,
    } = deviations(robot, readings, known)?;
    let lengths = rows.iter().map(|row| (Some(row.deviation_mm), row.line));
    let deviation = PositionError::of(lengths);
    if deviation.lies_elsewhere(&robot.robot) {
        // The units, columns or frame are wrong.
        let cause = format!(
            "half of the measured positions are more than {:.0} mm from those computed with {}.",
            deviation.median, robot.name
        );
        return Err(refused(cause, where_else(frame)));
    }
    let fitted_again = match known {
        Some(_) if request.stored => deviations(robot, readings, None).ok(),
        _ => None,
    };
    let overstated = overstated(&rows, read);
    let warnings = warnings(
        robot,
        readings,
        request.frame,
        &rows,
        &deviation,
        overstated,
        fitted_again.map_or(f64::INFINITY, |own| rms(&own.rows)),
    );
    for row in rows.iter_mut().filter(|_| overstated.is_some()) {
        row.noise = None;
    }
    let (squares, noise) = by_poses(&rows);
    let rms_error = rms_error(&squares, noise.unwrap_or(0.0), read, request.limit);
    let convention = &robot.convention;
    let stated = |(computed, is): Attained| (convention.vector(&computed), convention.vector(&is));
    let attained: Vec<_> = attained.into_iter().map(|own| own.map(stated)).collect();
    let complete = attained.iter().flatten();
    let complete: Vec<_> = complete.map(|(computed, is)| is - computed).collect();
    let names = readings.labels.iter();
    let names = names.filter_map(|(line, own)| Some((*line, own.name.clone()?)));
    let along = |axis: usize| crate::geometry::range(rows.iter().map(|row| row.position[axis]));
    Ok(Validation {
        robot_file: robot.name.clone(),
        samples_file: readings.name.clone(),
        frame,
        verdict: match step {
            Some(_) => Verdict::NotJudged,
            None => Verdict::of(&rms_error.error, request.limit),
        },
        step,
        rms_error,
        largest_error: largest(&rows),
        deviation_mm: deviation,
        rotation_deg: rotations(robot, readings, known.or(fitted).as_ref()),
        axes_mm: if complete.is_empty() {
            Vec::new()
        } else {
            of_vectors(&complete).to_vec()
        },
        repeatability: Repeatability::of(readings, &attained),
        guard_band_mm: None,
        noise_mm: noise.map(f64::sqrt),
        row_count: rows.len(),
        pose_count: poses,
        region_mm: convention.ranges([0, 1, 2].map(along)),
        sensor_frame: fitted.map(|own| FrameReport::of(&own, convention)),
        warnings,
        names: names.collect(),
        rows,
        kind: readings.only_kind(),
        of_datum: request.frame == Frame::Sensor && !request.stored,
    })
}

/// rms and largest deviation of the rotations, degrees.
fn rotations(
    robot: &RobotFile,
    readings: &Readings,
    frame: Option<&RigidTransform<f64>>,
) -> Option<[f64; 2]> {
    let rods = robot.parallelograms?;
    let read = orientations((&robot.robot, &rods), frame, readings, |_| 1.0);
    let squares = read.iter().map(|own| own.column(NUMBERS).norm_squared());
    let (sum, most) = squares.fold((0.0, 0.0), |(sum, most), own| {
        (sum + own, f64::max(most, own))
    });
    let mean = sum / read.len() as f64;
    (!read.is_empty()).then(|| [mean, most].map(|own| degrees(own.sqrt())))
}

/// A mistake in all rows, and what happened during the measurement; `known`: the frame of the coordinates.
fn explained(
    robot: &RobotFile,
    readings: &Readings,
    known: Option<&RigidTransform<f64>>,
) -> (Option<Diagnosis>, Option<Step>) {
    let frame = known.map_or(Frame::Sensor, |_| Frame::Base);
    let options = Options::in_frame(frame);
    let in_base = known.map(|own| readings.turned(&own.inverse()));
    let readings = in_base.as_ref().unwrap_or(readings);
    let diagnosis = diagnose(robot, readings, &options);
    // A mistake in all rows needs no further explanation.
    let happened = || step(robot, readings, options, known);
    let step = diagnosis.is_none().then(happened).flatten();
    (diagnosis, step)
}

/// What is said of too few poses, `None` if there are enough.
fn too_few(poses: usize, frame: Frame, step: Option<&Step>) -> Option<String> {
    let least = match frame {
        Frame::Base => LEAST_POSES,
        Frame::Sensor => LEAST_POSES_OF_SENSOR,
    };
    if poses >= least {
        return None;
    }
    let mut found = count(poses, "different pose");
    if let Some(Step { text, .. }) = step {
        found = format!("{text}, and there are {found} before");
    }
    Some(format!("{found}; at least {least} are needed."))
}

/// The remedy if most positions lie elsewhere.
const fn where_else(frame: Frame) -> &'static str {
    match frame {
        Frame::Base => {
            "Check units and columns; use --frame sensor if the positions are in a sensor frame."
        }
        Frame::Sensor => "Check units and columns.",
    }
}

/// What happened during the measurement, if anything did: the robot is fitted to the readings and then explains them but for
/// a step.
fn step(
    robot: &RobotFile,
    readings: &Readings,
    options: Options,
    known: Option<&RigidTransform<f64>>,
) -> Option<Step> {
    let mut robot = robot.at_platform_point();
    // The frame is known, or fitted.
    robot.instruments.datum.clear();
    let case = Case::new(&robot, readings, options);
    search(&case)?.step(&case, known)
}

/// The frame of the coordinates if it is known: the base's, the stored one, or that of the datum points.
fn known_frame(
    robot: &RobotFile,
    request: Request,
) -> Result<Option<RigidTransform<f64>>, CalibrateError> {
    Datum::of(robot, request.frame)?;
    if request.frame == Frame::Base || !request.stored {
        return Ok(Datum::known_frame(robot, request.frame)?);
    }
    let missing = InputError::new(&robot.name, "the robot file has no [sensor_frame]");
    let remedy = "`calibrate --frame sensor` writes it; `validate --frame sensor` fits it again";
    let stored = robot.sensor_frame.ok_or(missing.with_remedy(remedy));
    Ok(Some(stored?))
}

/// The mean squared deviation of each pose, and the mean square of the noise. All rows of a pose share the robot's
/// error and count as one draw of it.
fn by_poses(rows: &[Deviation]) -> (Vec<f64>, Option<f64>) {
    let mut poses: BTreeMap<_, Vec<&Deviation>> = BTreeMap::new();
    for row in rows {
        // −0 and 0 are equal.
        let pose = row.joints.map(|q| (q + 0.0).to_bits());
        poses.entry(pose).or_default().push(row);
    }
    let mean = |rows: &Vec<&Deviation>, of: fn(&Deviation) -> Option<f64>| {
        let sum: Option<f64> = rows.iter().map(|row| of(row)).sum();
        sum.map(|sum| sum / rows.len() as f64)
    };
    let squares = poses
        .values()
        .filter_map(|rows| mean(rows, |row| Some(row.square())));
    let noises = poses
        .values()
        .map(|rows| mean(rows, |row| Some(row.noise?.mean_square)));
    let noise: Option<f64> = noises.sum();
    (squares.collect(), noise.map(|sum| sum / poses.len() as f64))
}

/// Deviations improbably small for the stated noise, as a fraction of it. That noise is not removed: if it is stated too
/// large, removing it would hide errors.
fn overstated(rows: &[Deviation], read: Read) -> Option<f64> {
    let noises = rows.iter().filter_map(|row| row.noise);
    let squares: Vec<_> = noises.map(|noise| noise.squares).collect();
    let freedom = read.coordinates * squares.len() as f64 - read.taken_up;
    let squares: f64 = squares.iter().sum();
    let chi_square = ChiSquared::new(freedom).ok()?;
    let improbable = chi_square.cdf(squares) < IMPROBABLE;
    improbable.then(|| (squares / freedom).sqrt())
}

fn rms(rows: &[Deviation]) -> f64 {
    let squares: f64 = rows.iter().map(Deviation::square).sum();
    (squares / rows.len() as f64).sqrt()
}

fn warnings(
    robot: &RobotFile,
    readings: &Readings,
    frame: Frame,
    rows: &[Deviation],
    deviation: &PositionError,
    overstated: Option<f64>,
    fitted_again: f64,
) -> Vec<String> {
    let largest = |row: &Deviation| Some(row.line) == deviation.max_at_line;
    let largest_is_noise = |row: &Deviation| largest(row) && row.is_noise(rows.len());
    let outlier = deviation.max > OUTLIER * deviation.median && !rows.iter().any(largest_is_noise);
    let outlier = deviation.max_at_line.filter(|_| outlier);
    let (poses, row_count) = (readings.distinct_poses(), readings.rows.len());
    let mut kinds = Kind::ALL.into_iter();
    let unstated = kinds.any(|kind| readings.holds(kind) && !is_stated(robot, kind));
    let warnings = [
        overstated.map(|ratio| format!(
            "Deviations are only {ratio:.2} × the stated [noise]: the noise is stated too large and was not removed."
        )),
        unstated.then(|| {
            "No [noise] stated: every figure includes the instrument's noise, so a robot can pass but not fail.".to_owned()
        }),
        unused_rotations(robot, readings).map(|own| own.1),
        (robot.sensor_frame.is_some() && frame == Frame::Base).then(|| {
            "[sensor_frame] of the robot file was not used; use --frame sensor if the positions are in that frame.".to_owned()
        }),
        (fitted_again < MOVED * rms(rows)).then(|| format!(
            "In a frame fitted again the deviations are {fitted_again:.3} mm rms: the sensor or the robot has moved since \
             [sensor_frame] was stored. --frame sensor fits it again."
        )),
        outlier.map(|line| format!(
            "Line {line}: {:.3} mm off; half of the samples are within {:.3} mm. This may be a wrong row: measure it again.",
            deviation.max, deviation.median
        )),
        (poses < row_count).then(|| format!(
            "{} at {}: rows of one pose share the robot's error and count as one.",
            count(row_count, "row"),
            count(poses, "different pose")
        )),
    ];
    warnings.into_iter().flatten().collect()
}
