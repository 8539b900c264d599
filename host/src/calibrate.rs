//! From two files to a report: everything that is computed is computed here, by the core.

use crate::position_error::distances;
use crate::position_uncertainty::UncertaintyMap;
use crate::refusal::{Circumstances, Refused, lies_elsewhere};
use crate::warnings::warnings;
use crate::{
    CalibrationReport, Diagnosis, InputError, NoiseTest, Outcome, PositionError, RobotFile,
    RobustFit, Row, SampleErrors, SampleWeight, SamplesFile, Streaming, WorkspaceComparison,
    calibrate_robust, fkm, plausibility, sensor_frame, stream,
};
use delta_cal::{
    Calibrator, Loss, Method, Noise, Refusal, RigidTransform, RobotOutcome, Sample, Settings, Start,
};
use std::error::Error;
use std::fmt;

/// How the parameters are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CalibrationMethod {
    /// Each arm's eight parameters from the closure of its own kinematic chain.
    #[default]
    Ikm,
    /// All 24 parameters at once from the distances between measured and computed positions.
    Fkm,
}

impl CalibrationMethod {
    /// As it is written: `ikm` or `fkm`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ikm => "ikm",
            Self::Fkm => "fkm",
        }
    }
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
    /// How residuals count; `None` is the squared loss, the plain least squares.
    pub loss: Option<Loss>,
    /// What is done because the samples came one after the other; of the IKM method alone, and with
    /// the squared loss.
    pub streaming: Streaming,
    /// The frame of the measured positions.
    pub frame: Frame,
    /// Do not use the robot file as a start value: the fit starts without one, and any geometry is
    /// accepted.
    /// Needs 12 samples.
    pub no_guess: bool,
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

impl From<Refused> for CalibrateError {
    fn from(refused: Refused) -> Self {
        Self::Refused(refused)
    }
}

/// Calibrates the robot of a file from a file of samples.
///
/// # Errors
/// A tolerance about a robot file that is not used as a start value, a sample that is out of all proportion, or
/// measurements that cannot calibrate this robot: the core refuses them, the result is not credible
/// without a stated tolerance, or it is expected to be worse than what there was before.
pub fn calibrate(
    robot: &RobotFile,
    samples: &SamplesFile,
    options: Options,
) -> Result<CalibrationReport, CalibrateError> {
    match attempt(robot, samples, options) {
        Ok(report) => Ok(report.diagnosed(Diagnosis::of(robot, samples, options))),
        Err(CalibrateError::Refused(refused)) => {
            let diagnosis = Diagnosis::of(robot, samples, options);
            Err(refused.with_diagnosis(diagnosis).into())
        }
        Err(error) => Err(error),
    }
}

/// After a calibration: half of the samples are off by less than this, mm. `None` if it is refused.
pub(crate) fn position_error_after(
    robot: &RobotFile,
    samples: &SamplesFile,
    options: Options,
) -> Option<f64> {
    let report = attempt(robot, samples, options).ok()?;
    Some(report.error_after.median)
}

fn attempt(
    robot: &RobotFile,
    samples: &SamplesFile,
    options: Options,
) -> Result<CalibrationReport, CalibrateError> {
    let settings = settings(robot, options).map_err(CalibrateError::Input)?;
    let nominal = &robot.robot;
    let sensor_frame = match options.frame {
        Frame::Base => None,
        Frame::Sensor => Some(
            sensor_frame::find(robot, samples, options)
                .map_err(|cause| Refused::sensor_frame(samples, &cause))?,
        ),
    };
    let measured = in_robot_frame(&samples.rows, sensor_frame.as_ref());
    let circumstances = Circumstances {
        robot,
        samples,
        measured: &measured,
        options,
        error_before: PositionError::of(&distances(nominal, &measured), &samples.rows),
        find_frame: "--frame sensor",
        robust_fit: "--loss tukey",
    };

    if options.streaming.asked() {
        let rows = &samples.rows;
        let (fit, stream) =
            stream::calibrate(nominal, &settings, &measured, rows, options.streaming)
                .map_err(|refusal| circumstances.explain_stream(&refusal))?;
        let mut report = judged(&circumstances, robot, fit, sensor_frame)?;
        report.stream = Some(stream);
        return Ok(report);
    }
    let mut calibrator = Calibrator::new(nominal, &settings);
    calibrator
        .add_many(&measured)
        .map_err(|(index, error)| CalibrateError::Input(samples.fault(index, error.to_string())))?;
    let fit = match (options.loss, options.method) {
        (Some(loss), method) => calibrate_robust(nominal, &measured, &settings, method, loss)
            .map_err(|refusal| circumstances.explain_robust(&refusal))?,
        (None, CalibrationMethod::Ikm) => plain(
            calibrator
                .solve()
                .map(Outcome::from)
                .map_err(|refusal| circumstances.explain(&refusal))?,
            &measured,
        ),
        (None, CalibrationMethod::Fkm) => plain(
            fkm::calibrate(nominal, &measured, &settings)
                .map_err(|refusal| circumstances.explain(&refusal))?,
            &measured,
        ),
    };
    Ok(judged(&circumstances, robot, fit, sensor_frame)?)
}

/// Every sample counts alike.
fn plain(outcome: Outcome, measured: &[Sample<f64>]) -> RobustFit {
    RobustFit {
        outcome,
        samples: vec![SampleWeight::FULL; measured.len()],
        settled: true,
    }
}

/// The report of what a controller found from the same samples: `before` is its current geometry,
/// `robot` the file with its nominal one.
///
/// # Errors
/// As [`calibrate`].
pub(crate) fn calibrated_elsewhere(
    robot: &RobotFile,
    before: &RobotFile,
    samples: &SamplesFile,
    options: Options,
    result: &Result<RobotOutcome<f64>, Refusal>,
) -> Result<CalibrationReport, Refused> {
    let measured = in_robot_frame(&samples.rows, None);
    let circumstances = Circumstances {
        robot,
        samples,
        measured: &measured,
        options,
        error_before: PositionError::of(&distances(&robot.robot, &measured), &samples.rows),
        find_frame: "delta-cal calibrate --frame sensor",
        robust_fit: "delta-cal calibrate --loss tukey",
    };
    let judged = match result {
        Ok(outcome) => {
            let fit = plain(Outcome::from(*outcome), &measured);
            judged(&circumstances, before, fit, None)
        }
        Err(refusal) => Err(circumstances.explain(refusal)),
    };
    let diagnosis = Diagnosis::of(robot, samples, options);
    match judged {
        Ok(report) => Ok(report.diagnosed(diagnosis)),
        Err(refused) => Err(refused.with_diagnosis(diagnosis)),
    }
}

/// The report of a calibration that is good; otherwise why it is not.
fn judged(
    circumstances: &Circumstances<'_>,
    before: &RobotFile,
    fit: RobustFit,
    sensor_frame: Option<RigidTransform<f64>>,
) -> Result<CalibrationReport, Refused> {
    let RobustFit {
        outcome,
        samples: weights,
        settled,
    } = fit;
    let &Circumstances {
        robot,
        samples,
        measured,
        options,
        ..
    } = circumstances;
    let calibrated = outcome.robot.robot;
    let distances_before = distances(&before.robot, measured);
    let distances_after = distances(&calibrated, measured);
    let error_of = |distances| PositionError::of_counted(distances, &samples.rows, &weights);
    let error_after = error_of(&distances_after);
    // A stated tolerance already keeps what is not known near where it was.
    let credible_by_itself = robot.tolerance.is_some() || options.no_guess;
    if !credible_by_itself && let Some(cause) = plausibility::implausible(&robot.robot, &calibrated)
    {
        return Err(circumstances.explain_implausible(&cause));
    }
    if lies_elsewhere(&calibrated, &error_after) {
        return Err(circumstances.explain_not_reproduced(&error_after));
    }
    let workspace = WorkspaceComparison::of(&before.robot, &outcome, &robot.limits);
    if robot.tolerance.is_none()
        && let Some(comparison) = &workspace
        && comparison.expected_worse()
    {
        return Err(circumstances.explain_worse(comparison, &error_after));
    }

    let estimated_noise = || Noise::new(outcome.estimated_noise()?, 0.0).ok();
    let noise = robot.noise.or_else(estimated_noise);
    let after_in_sigmas = noise.map_or_else(
        || vec![None; measured.len()],
        |noise| fkm::residuals_in_sigmas(&calibrated, measured, &noise),
    );
    let sample_errors = samples
        .rows
        .iter()
        .zip(measured)
        .zip(distances_before.iter().zip(&distances_after))
        .zip(after_in_sigmas.iter().zip(&weights))
        .map(
            |(((row, measured), (before, after)), (in_sigmas, weight))| SampleErrors {
                line: row.line,
                measured: *measured,
                before: *before,
                after: *after,
                after_in_sigmas: *in_sigmas,
                weight: *weight,
            },
        )
        .collect();
    let after = RobotFile {
        robot: calibrated,
        sensor_frame,
        ..robot.clone()
    };
    let uncertainty = outcome
        .covariance
        .as_ref()
        .and_then(|covariance| UncertaintyMap::new(&after, covariance));
    let mut report = CalibrationReport {
        options,
        before: before.clone(),
        after,
        samples_file: samples.name.clone(),
        samples: measured.len(),
        distinct_poses: distinct_poses(measured),
        outcome,
        error_before: error_of(&distances_before),
        error_after,
        noise,
        noise_test: None,
        sample_errors,
        workspace,
        uncertainty,
        stream: None,
        diagnosis: None,
        warnings: Vec::new(),
    };
    report.noise_test = NoiseTest::of(&report);
    if let Some(test) = &report.noise_test
        && test.beyond_tolerance()
    {
        return Err(circumstances.explain_noise_beyond_tolerance(test));
    }
    report.warnings = warnings(&report);
    if !settled {
        report.warnings.push(
            "the weights of the robust fit did not settle entirely: at least one sample is at the \
             edge between right and wrong"
                .to_owned(),
        );
    }
    Ok(report)
}

pub(crate) fn settings(robot: &RobotFile, options: Options) -> Result<Settings<f64>, InputError> {
    if options.no_guess && robot.tolerance.is_some() {
        let cause = "the [tolerance] is about the values of the robot file, but --no-guess says \
                     not to use them";
        return Err(InputError::new(&robot.name, cause)
            .at_key("[tolerance]")
            .with_remedy("leave out --no-guess, or delete the section [tolerance]"));
    }
    Ok(Settings {
        noise: robot.noise,
        tolerance: robot.tolerance,
        method: options.solver,
        start: options.start(),
        ..Settings::default()
    })
}

impl Options {
    pub(crate) fn start(self) -> Start {
        if self.no_guess {
            Start::Free
        } else {
            Start::Reference
        }
    }
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

fn distinct_poses(samples: &[Sample<f64>]) -> usize {
    let mut poses: Vec<_> = samples
        .iter()
        // −0 and 0 are the same angle.
        .map(|sample| sample.joints.map(|q| (q + 0.0).to_bits()))
        .collect();
    poses.sort_unstable();
    poses.dedup();
    poses.len()
}
