//! Validates a robot file against independent measurements.
//!
//! ```text
//! RobotFile, SamplesFile, Request ─→ deviations ─→ rms and largest error with their intervals ─→ verdict
//! ```

mod interval;
mod readings;

use crate::accuracy::position_error::PositionError;
use crate::calibration::diagnosis::diagnose;
use crate::calibration::refusal::{CalibrateError, Refused};
use crate::calibration::report::FrameReport;
use crate::files::input::{InputError, InputText};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind, Readings};
use crate::fit::datum::Datum;
use crate::fit::{Frame, Options};
use crate::text::count;
pub use interval::{Bounded, RmsError, Verdict};
use interval::{Mean, Read, RowDeviation, largest};
use nalgebra::Vector3;
use readings::{Deviations, deviations};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::collections::BTreeMap;

/// Fewer distinct poses than this do not show how the error varies.
const LEAST_POSES: usize = 8;
/// The same when the sensor's frame is fitted, which uses up six coordinates.
const LEAST_POSES_OF_SENSOR: usize = 10;
/// The stated noise is too large if deviations this small are less probable than this: one-sided 3 σ (normal).
const IMPROBABLE: f64 = 0.00135;

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

/// The deviation of one row.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Deviation {
    /// Line in the samples file.
    pub line: u64,
    /// Distance between measured and computed position, including the instrument's noise.
    pub deviation_mm: f64,
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
    /// Over the measured region, without the noise.
    pub rms_error: RmsError,
    /// The largest position error at the measured poses, without the noise.
    pub largest_error: Bounded,
    /// Deviations over all rows, including the instrument's noise.
    pub deviation_mm: PositionError,
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
    /// Deviations in file order.
    #[serde(skip)]
    pub rows: Vec<Deviation>,
    /// The kind of the readings if they are all of one kind.
    #[serde(skip)]
    pub kind: Option<Kind>,
}

/// Checks that a robot was not calibrated from these samples: `calibrate` writes their SHA-256 to its file.
///
/// # Errors
/// The robot was calibrated from these samples.
pub fn check_independent(robot: &InputText, samples: &InputText) -> Result<(), InputError> {
    if !robot.text().contains(samples.sha256()) {
        return Ok(());
    }
    let cause = format!(
        "{} was calibrated from these very measurements",
        robot.name()
    );
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
    let (readings, request) = &in_known_frame(robot, readings, request)?;
    let request = *request;
    let options = Options {
        frame: request.frame,
        ..Options::default()
    };
    let poses = readings.distinct_poses();
    check_poses(robot, readings, poses, &options)?;
    let Deviations { rows, frame, read } = deviations(robot, readings, request.frame)?;
    let deviation = PositionError::of(rows.iter().map(|row| (Some(row.length()), row.line)));
    if deviation.lies_elsewhere(&robot.robot) {
        return Err(elsewhere(robot, readings, &options, &deviation));
    }
    let largest_is_noise =
        |row: &RowDeviation| Some(row.line) == deviation.max_at_line && row.is_noise(rows.len());
    let outlier = outlier(&deviation).filter(|_| !rows.iter().any(largest_is_noise));
    let mut warnings = warnings(robot, readings, request.frame, outlier, poses);
    let rows = match overstated(&rows, read) {
        Some(doubt) => {
            warnings.insert(0, doubt);
            let without = |row: RowDeviation| RowDeviation { noise: None, ..row };
            rows.into_iter().map(without).collect()
        }
        None => rows,
    };
    let (squares, noise) = by_poses(&rows);
    let rms_error = Mean::of(&squares, noise.unwrap_or(0.0), read).against(request.limit);
    let convention = &robot.convention;
    Ok(Validation {
        robot_file: robot.name.clone(),
        samples_file: readings.name.clone(),
        frame: request.frame,
        verdict: Verdict::of(&rms_error.error, request.limit),
        rms_error,
        largest_error: largest(&rows),
        deviation_mm: deviation,
        noise_mm: noise.map(f64::sqrt),
        row_count: rows.len(),
        pose_count: poses,
        region_mm: convention.ranges(region(&rows)),
        sensor_frame: frame.map(|own| FrameReport::of(&own, convention)),
        warnings,
        rows: rows.iter().map(shown).collect(),
        kind: only_kind(readings),
    })
}

fn shown(row: &RowDeviation) -> Deviation {
    Deviation {
        line: row.line,
        deviation_mm: row.length(),
    }
}

/// Identifies a pose by its joint angles; −0 and 0 are equal.
fn pose_of(joints: &[f64; 3]) -> [u64; 3] {
    joints.map(|q| (q + 0.0).to_bits())
}

fn only_kind(readings: &Readings) -> Option<Kind> {
    let kinds: Vec<_> = Kind::ALL
        .into_iter()
        .filter(|kind| readings.holds(*kind))
        .collect();
    match kinds[..] {
        [kind] => Some(kind),
        _ => None,
    }
}

/// Readings of the platform point, in the robot's frame if the sensor's is known: stored, or from datum points.
fn in_known_frame(
    robot: &RobotFile,
    readings: &Readings,
    request: Request,
) -> Result<(Readings, Request), CalibrateError> {
    let datum = Datum::of(robot, request.frame)?;
    let frame = match (request.stored, datum) {
        (true, _) => Some(robot.sensor_frame.ok_or_else(|| {
            InputError::new(&robot.name, "the robot file has no [sensor_frame]").with_remedy(
                "`calibrate --frame sensor` writes it; `validate --frame sensor` fits it again",
            )
        })?),
        (false, datum) => datum.map(|datum| datum.frame),
    };
    let target = robot.instruments.target.unwrap_or_default();
    let Some(frame) = frame else {
        // A fitted frame's position absorbs the target offset.
        let shift = if request.frame == Frame::Base {
            -target
        } else {
            Vector3::zeros()
        };
        return Ok((readings.clone().moved(&shift), request));
    };
    let request = Request {
        frame: Frame::Base,
        ..request
    };
    Ok((readings.turned(&frame.inverse()).moved(&-target), request))
}

/// The mean squared deviation of each pose, and the mean square of the noise. All rows of a pose share the robot's
/// error and count as one draw of it.
fn by_poses(rows: &[RowDeviation]) -> (Vec<f64>, Option<f64>) {
    let mut poses: BTreeMap<[u64; 3], (f64, Option<f64>, f64)> = BTreeMap::new();
    for row in rows {
        let (square, noise, count) =
            poses
                .entry(pose_of(&row.measured.joints))
                .or_insert((0.0, Some(0.0), 0.0));
        *square += row.square();
        *noise = noise.zip(row.noise).map(|(sum, own)| sum + own.mean_square);
        *count += 1.0;
    }
    let squares: Vec<_> = poses
        .values()
        .map(|(square, _, count)| square / count)
        .collect();
    let number = squares.iter().fold(0.0, |count, _| count + 1.0);
    let noise: Option<f64> = poses
        .values()
        .map(|(_, noise, count)| noise.map(|sum| sum / count))
        .sum();
    (squares, noise.map(|sum| sum / number))
}

fn region(rows: &[RowDeviation]) -> [(f64, f64); 3] {
    [0, 1, 2].map(|axis| {
        let values = rows.iter().map(|row| row.measured.position[axis]);
        crate::geometry::range(values)
    })
}

fn check_poses(
    robot: &RobotFile,
    readings: &Readings,
    poses: usize,
    options: &Options,
) -> Result<(), CalibrateError> {
    let least = match options.frame {
        Frame::Base => LEAST_POSES,
        Frame::Sensor => LEAST_POSES_OF_SENSOR,
    };
    if poses >= least {
        return Ok(());
    }
    let cause = format!(
        "{}: {}; at least {least} are needed",
        readings.name,
        count(poses, "different pose"),
    );
    let remedy = "measure some 20 poses, spread over the region in which the robot works";
    Err(Refused::new(cause, remedy)
        .explained(diagnose(robot, readings, options))
        .into())
}

/// The sample that deviates far more than the others, if any.
fn outlier(error: &PositionError) -> Option<String> {
    let line = error.max_at_line.filter(|_| error.is_outlier(error.max))?;
    Some(format!(
        "line {line}: {:.3} mm off; half of the samples are within {:.3} mm",
        error.max, error.median
    ))
}

/// Half of the points are far off: the units, columns or frame are wrong.
fn elsewhere(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
    deviation: &PositionError,
) -> CalibrateError {
    let cause = format!(
        "{}: half of the measured positions are more than {:.0} mm from those computed with {}",
        readings.name, deviation.median, robot.name
    );
    let remedy = match options.frame {
        Frame::Base => {
            "check units and columns; use --frame sensor if the positions are in a sensor's frame"
        }
        Frame::Sensor => "check units and columns",
    };
    Refused::new(cause, remedy)
        .explained(diagnose(robot, readings, options))
        .into()
}

/// Warns of deviations improbably small for the stated noise. That noise is not removed: if it is stated too large,
/// removing it would hide errors.
fn overstated(rows: &[RowDeviation], read: Read) -> Option<String> {
    let noises: Vec<_> = rows.iter().filter_map(|row| row.noise).collect();
    let count = noises.iter().fold(0.0, |count, _| count + 1.0);
    let freedom = read.coordinates * count - read.taken_up;
    let squares: f64 = noises.iter().map(|noise| noise.squares).sum();
    let chi_square = ChiSquared::new(freedom).ok()?;
    (chi_square.cdf(squares) < IMPROBABLE).then(|| {
        format!(
            "deviations are only {:.2} × the stated [noise]: the noise is stated too large and was not removed",
            (squares / freedom).sqrt()
        )
    })
}

fn warnings(
    robot: &RobotFile,
    readings: &Readings,
    frame: Frame,
    outlier: Option<String>,
    poses: usize,
) -> Vec<String> {
    let mut warnings = Vec::new();
    if robot.noise.is_none() {
        warnings.push(
            "no [noise] stated: every figure includes the instrument's noise, so a robot can pass but not fail"
                .to_owned(),
        );
    }
    if robot.sensor_frame.is_some() && frame == Frame::Base {
        warnings.push(
            "[sensor_frame] of the robot file was not used; use --frame sensor if the positions are in that frame"
                .to_owned(),
        );
    }
    if let Some(outlier) = outlier {
        warnings.push(format!(
            "{outlier}. This may be a wrong row: measure it again"
        ));
    }
    if poses < readings.rows.len() {
        warnings.push(format!(
            "{} at {}: rows of one pose share the robot's error and count as one",
            count(readings.rows.len(), "row"),
            count(poses, "different pose")
        ));
    }
    warnings
}
