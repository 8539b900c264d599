//! From two files to a report: everything that is computed is computed here, by the core.

use crate::refusal::{Circumstances, Refused, lies_elsewhere};
use crate::warnings::warnings;
use crate::{InputError, RobotFile, Row, SamplesFile, WorkspaceComparison};
use delta_cal::{Calibrator, Method, RigidTransform, Robot, RobotOutcome, Sample, Settings};
use std::error::Error;
use std::fmt;

/// How the parameters are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CalibrationMethod {
    /// Each arm's eight parameters from the closure of its own kinematic chain.
    #[default]
    Ikm,
}

/// Which frame the positions are measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Frame {
    /// The robot's own.
    #[default]
    Base,
    /// The sensor's, which stands anywhere; its place is found as well.
    Sensor,
}

/// How to calibrate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// How the parameters are estimated.
    pub method: CalibrationMethod,
    /// Levenberg–Marquardt or Gauss–Newton.
    pub solver: Method,
    /// The frame of the measured positions.
    pub frame: Frame,
}

/// How far the measured positions are from where a robot's geometry says they are, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionError {
    /// √ of the mean square distance over the samples that the geometry can reach; NaN if there
    /// is none, as are the other distances.
    pub rms: f64,
    /// The median distance, which an outlier does not move.
    pub median: f64,
    /// The largest distance.
    pub max: f64,
    /// The line in the samples file of the sample with the largest distance.
    pub max_at_line: Option<u64>,
    /// Samples whose joint angles have no position in this geometry; not part of the two figures.
    pub unreachable: usize,
}

/// A calibration, and what there is to know to trust it or not.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationReport {
    /// How it was calibrated.
    pub options: Options,
    /// The robot file.
    pub before: RobotFile,
    /// The calibrated robot with the limits, tolerance and noise of the file, and the sensor's
    /// frame if that was asked for.
    pub after: RobotFile,
    /// The samples file's name.
    pub samples_file: String,
    /// How many samples there were.
    pub samples: usize,
    /// The core's result.
    pub outcome: RobotOutcome<f64>,
    /// Over the samples, with the parameters before.
    pub error_before: PositionError,
    /// Over the same samples, with the calibrated parameters.
    pub error_after: PositionError,
    /// Over the workspace; `None` if the uncertainty is not known.
    pub workspace: Option<WorkspaceComparison>,
    /// Anything doubtful, in plain words.
    pub warnings: Vec<String>,
}

/// Why there is no calibration.
#[derive(Debug, Clone, PartialEq)]
pub enum CalibrateError {
    /// A number in an input file cannot be used.
    Input(InputError),
    /// The measurements cannot calibrate this robot.
    Refused(Refused),
}

impl fmt::Display for CalibrateError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(error) => error.fmt(formatter),
            Self::Refused(refused) => refused.fmt(formatter),
        }
    }
}

impl Error for CalibrateError {}

/// Calibrates the robot of a file from a file of samples.
///
/// # Errors
/// A sample that is out of all proportion, or measurements that cannot calibrate this robot: the
/// core refuses them, or the result is expected to be worse than what there was before.
pub fn calibrate(
    robot: &RobotFile,
    samples: &SamplesFile,
    options: Options,
) -> Result<CalibrationReport, CalibrateError> {
    let nominal = &robot.robot;
    let sensor_frame = match options.frame {
        Frame::Base => None,
        Frame::Sensor => Some(sensor_frame(nominal, samples).map_err(CalibrateError::Refused)?),
    };
    let measured = in_robot_frame(&samples.rows, sensor_frame.as_ref());
    let error_before = position_error(nominal, &measured, &samples.rows);

    let settings = Settings {
        noise: robot.noise,
        tolerance: robot.tolerance,
        method: options.solver,
        ..Settings::default()
    };
    let mut calibrator = Calibrator::new(nominal, &settings);
    calibrator
        .add_many(&measured)
        .map_err(|(index, error)| CalibrateError::Input(samples.fault(index, error.to_string())))?;
    let circumstances = Circumstances {
        robot,
        samples,
        options,
        error_before,
    };
    let outcome = calibrator
        .solve()
        .map_err(|refusal| CalibrateError::Refused(circumstances.explain(&refusal)))?;

    let error_after = position_error(&outcome.robot, &measured, &samples.rows);
    if lies_elsewhere(robot, &error_after) {
        let refused = circumstances.explain_not_reproduced(&error_after);
        return Err(CalibrateError::Refused(refused));
    }
    let workspace = WorkspaceComparison::of(nominal, &outcome, &robot.limits);
    // A stated tolerance already keeps what is not known near where it was.
    if robot.tolerance.is_none()
        && let Some(comparison) = &workspace
        && comparison.expected_worse()
    {
        let refused = circumstances.explain_worse(comparison);
        return Err(CalibrateError::Refused(refused));
    }

    let mut report = CalibrationReport {
        options,
        before: robot.clone(),
        after: RobotFile {
            robot: outcome.robot,
            sensor_frame,
            ..robot.clone()
        },
        samples_file: samples.name.clone(),
        samples: measured.len(),
        outcome,
        error_before,
        error_after,
        workspace,
        warnings: Vec::new(),
    };
    report.warnings = warnings(&report);
    Ok(report)
}

/// From the robot's frame to the sensor's: aligns where the nominal robot should have been with
/// where it was measured.
fn sensor_frame(
    nominal: &Robot<f64>,
    samples: &SamplesFile,
) -> Result<RigidTransform<f64>, Refused> {
    let pairs: Vec<_> = samples
        .rows
        .iter()
        .filter_map(|row| {
            let expected = nominal.forward(&row.value.joints).ok()?;
            Some((expected, row.value.position))
        })
        .collect();
    RigidTransform::align(pairs.iter().copied())
        .map_err(|error| Refused::alignment(&samples.name, error, pairs.len()))
}

fn in_robot_frame(
    rows: &[Row<Sample<f64>>],
    sensor_frame: Option<&RigidTransform<f64>>,
) -> Vec<Sample<f64>> {
    let to_robot = sensor_frame.map(RigidTransform::inverse);
    rows.iter()
        .map(|row| match &to_robot {
            Some(transform) => Sample {
                position: transform.apply(&row.value.position),
                ..row.value
            },
            None => row.value,
        })
        .collect()
}

fn position_error(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    rows: &[Row<Sample<f64>>],
) -> PositionError {
    let mut distances: Vec<(f64, u64)> = samples
        .iter()
        .zip(rows)
        .filter_map(|(sample, row)| {
            let position = robot.forward(&sample.joints).ok()?;
            Some(((sample.position - position).norm(), row.line))
        })
        .collect();
    distances.sort_by(|a, b| a.0.total_cmp(&b.0));
    let reached = distances.iter().fold(0.0, |count, _| count + 1.0);
    let squares: f64 = distances.iter().map(|(distance, _)| distance.powi(2)).sum();
    let last = distances.last();
    PositionError {
        rms: (squares / reached).sqrt(),
        median: distances
            .get(distances.len() / 2)
            .map_or(f64::NAN, |(distance, _)| *distance),
        max: last.map_or(f64::NAN, |(distance, _)| *distance),
        max_at_line: last.map(|(_, line)| *line),
        unreachable: samples.len() - distances.len(),
    }
}
