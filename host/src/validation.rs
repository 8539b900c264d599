//! Whether a calibration still holds: a robot file against independent measurements.
//!
//! ```text
//! RobotFile, SamplesFile, Request ─→ deviations ─→ rms and largest error with their intervals ─→ verdict
//! ```

mod interval;
mod readings;

use crate::accuracy::position_error::PositionError;
use crate::calibration::diagnosis::diagnose;
use crate::calibration::refusal::{CalibrateError, Refused};
use crate::files::input::{InputError, InputText};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind, Readings};
use crate::fit::datum::Datum;
use crate::fit::{Frame, Options};
use crate::text::count;
use delta_cal::frame::RigidTransform;
pub use interval::{Bounded, RmsError, Verdict};
use interval::{Read, RowDeviation, largest, poses_to_decide};
use nalgebra::Vector3;
use readings::{Deviations, deviations};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::collections::BTreeMap;

/// Fewer different poses than this say too little of how the error varies.
const LEAST_POSES: usize = 8;
/// With the frame of the sensor, which takes up six coordinates.
const LEAST_POSES_OF_SENSOR: usize = 10;
/// A noise is stated too large if deviations as small are less probable: 3 σ of a normal distribution, one-sided.
const IMPROBABLE: f64 = 0.00135;

/// What is asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// Of the rms position error, mm.
    pub limit: f64,
    /// In which frame the positions were measured.
    pub frame: Frame,
    /// Whether that is the sensor's frame of the robot file, which is not fitted again.
    pub stored: bool,
}

/// One row of the measurements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Deviation {
    /// In the samples file.
    pub line: u64,
    /// Between measured and computed position, with the instrument's noise in it.
    pub deviation_mm: f64,
}

/// What measurements say of a calibrated robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Validation {
    /// The robot that was validated.
    pub robot: RobotFile,
    /// The measurements' name.
    pub samples_file: String,
    /// Of which readings, if all are of one kind.
    pub kind: Option<Kind>,
    /// What was asked.
    pub request: Request,
    /// In the file's order.
    pub rows: Vec<Deviation>,
    /// Different joint angles among the rows.
    pub poses: usize,
    /// Over the rows, with the instrument's noise in them.
    pub deviation: PositionError,
    /// The rms length of the noise that was removed from the deviations, mm; `None` if none was.
    pub noise: Option<f64>,
    /// The rms position error without the noise.
    pub error: RmsError,
    /// Its figures.
    pub rms: Bounded,
    /// The largest position error at the measured poses, without the noise.
    pub largest: Bounded,
    /// Where the robot was measured: the least and the largest x, y and z, mm.
    pub region: [(f64, f64); 3],
    /// From the robot's frame to the sensor's, if that was looked for.
    pub sensor_frame: Option<RigidTransform<f64>>,
    /// What follows of the limit.
    pub verdict: Verdict,
    /// How many poses would decide the rms, if it is undecided and some would.
    pub poses_to_decide: Option<usize>,
    /// Anything doubtful, in plain words.
    pub warnings: Vec<String>,
}

impl Validation {
    /// The confidence that the rms position error is below the limit, 0 to 1.
    pub fn confidence(&self) -> f64 {
        self.error.confidence_below(self.request.limit)
    }
}

/// That a robot was not calibrated from these samples: the file that `calibrate` writes names their SHA-256.
///
/// # Errors
/// It was.
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

/// Whether a robot is where its file says it is, within a limit.
///
/// # Errors
/// Too few poses, poses that do not fix the sensor's frame, joint angles that the robot does not reach, or samples
/// that are wrong as a whole.
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
    let Deviations {
        rows,
        frame,
        taken_up,
        coordinates,
    } = deviations(robot, readings, request.frame)?;
    let read = Read {
        coordinates,
        taken_up,
    };
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
    let error = RmsError::of(&squares, noise.unwrap_or(0.0), read);
    let largest = largest(&rows).unwrap_or(Bounded {
        value: f64::NAN,
        interval: (0.0, None),
    });
    let rms = error.bounded();
    let verdict = Verdict::of(&rms, request.limit);
    let more = (verdict == Verdict::Undecided)
        .then(|| poses_to_decide(&error, poses, request.limit))
        .flatten();
    Ok(Validation {
        robot: robot.clone(),
        samples_file: readings.name.clone(),
        kind: only_kind(readings),
        request,
        poses,
        deviation,
        noise: noise.map(f64::sqrt),
        error,
        rms,
        largest,
        region: robot.convention.ranges(region(&rows)),
        rows: rows.iter().map(shown).collect(),
        sensor_frame: frame,
        verdict,
        poses_to_decide: more,
        warnings,
    })
}

fn shown(row: &RowDeviation) -> Deviation {
    Deviation {
        line: row.line,
        deviation_mm: row.length(),
    }
}

/// −0 and 0 are the same angle.
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

/// Readings of the platform point, in the robot's frame if that of the sensor is known: stored, or by datum points.
fn in_known_frame(
    robot: &RobotFile,
    readings: &Readings,
    request: Request,
) -> Result<(Readings, Request), CalibrateError> {
    let datum = Datum::of(robot, request.frame)?;
    let frame = match (request.stored, datum) {
        (true, _) => Some(robot.sensor_frame.ok_or_else(|| {
            InputError::new(&robot.name, "the robot file has no [sensor_frame]").with_remedy(
                "calibrate with --frame sensor writes one; --frame sensor fits it again",
            )
        })?),
        (false, datum) => datum.map(|datum| datum.frame),
    };
    let target = robot.instruments.target.unwrap_or_default();
    let Some(frame) = frame else {
        // The place of a frame that is found takes the target in.
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

/// The mean squared deviation of every pose, and the mean square of the noise. Rows of one pose share the robot's
/// error, so that together they are one draw of it.
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
        "{}: {}, and at least {least} are needed",
        readings.name,
        count(poses, "different pose"),
    );
    let remedy = "measure some 20 poses, spread over the region in which the robot works";
    Err(Refused::new(cause, remedy)
        .explained(diagnose(robot, readings, options))
        .into())
}

/// The sample that is much further off than the others, if there is one.
fn outlier(error: &PositionError) -> Option<String> {
    let line = error.max_at_line.filter(|_| error.is_outlier(error.max))?;
    Some(format!(
        "line {line}: {:.3} mm off, while half of the samples are within {:.3} mm",
        error.max, error.median
    ))
}

/// Half of the points are out of all proportion: units, columns or the frame are wrong.
fn elsewhere(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
    deviation: &PositionError,
) -> CalibrateError {
    let cause = format!(
        "{}: half of the measured positions are more than {:.0} mm from those of {}",
        readings.name, deviation.median, robot.name
    );
    let remedy = match options.frame {
        Frame::Base => {
            "check units and columns, or give --frame sensor if the positions are in the frame of a sensor"
        }
        Frame::Sensor => "check units and columns",
    };
    Refused::new(cause, remedy)
        .explained(diagnose(robot, readings, options))
        .into()
}

/// Deviations that are improbably small for the stated noise: it is then not removed, since a noise stated too
/// large would hide errors.
fn overstated(rows: &[RowDeviation], read: Read) -> Option<String> {
    let noises: Vec<_> = rows.iter().filter_map(|row| row.noise).collect();
    let count = noises.iter().fold(0.0, |count, _| count + 1.0);
    let freedom = read.coordinates * count - read.taken_up;
    let squares: f64 = noises.iter().map(|noise| noise.squares).sum();
    let chi_square = ChiSquared::new(freedom).ok()?;
    (chi_square.cdf(squares) < IMPROBABLE).then(|| {
        format!(
            "deviations are only {:.2} × the stated [noise], so that it is stated too large; it was not removed",
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
            "no [noise] stated: the instrument's noise is part of every figure, so that a robot can pass but not fail"
                .to_owned(),
        );
    }
    if robot.sensor_frame.is_some() && frame == Frame::Base {
        warnings.push(
            "[sensor_frame] of the robot file was not used; if the positions are in that frame, give --frame sensor"
                .to_owned(),
        );
    }
    if let Some(outlier) = outlier {
        warnings.push(format!(
            "{outlier}: it may be a wrong row; measure it again"
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
