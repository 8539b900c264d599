//! From two files to a report: everything that is computed is computed here, by the core.

use super::attempt::{Attempt, attempt};
use super::case::Case;
use super::diagnosis::diagnose;
use super::error::CalibrateError;
use super::every_sample::every_sample;
use super::investigation::{Findings, investigate};
use super::judgement::Judgement;
use super::objection::Objection;
use super::reason::{Reason, Refused};
use super::refusal::Explainer;
use super::report::CalibrationReport;
use super::shift::Shift;
use super::warnings::warnings;
use crate::accuracy::expected_error::ExpectedError;
use crate::accuracy::position_error::SampleErrors;
use crate::accuracy::position_uncertainty::PositionUncertainty;
use crate::accuracy::sampled::MANY;
use crate::accuracy::uncertainty_map::UncertaintyMap;
use crate::accuracy::workspace_poses::WorkspacePoses;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{MOST_IN_MEMORY, Measurements, Row, SamplesFile, is_planned};
use crate::fit::fkm;
use crate::fit::options::{CalibrationMethod, Frame, Options};
use crate::fit::outcome::Outcome;
use crate::fit::shared_noise;
use crate::fit::stream::{StreamReport, Unweighed};
use crate::fit::weights::{Fit, Weights};
use crate::text::words::in_lines;
use delta_cal::frame::RigidTransform;
use delta_cal::{Noise, Sample, Settings};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::convert::Infallible;

/// Reads the samples of a robot that is to be calibrated. Where joint angles are outside its limits,
/// what would explain the file as a whole is said.
///
/// # Errors
/// As [`Measurements::read`].
pub fn read_samples(
    input: &InputText,
    robot: &RobotFile,
    options: Options,
) -> Result<Measurements, CalibrateError> {
    let measurements = Measurements::read(input, &robot.limits).map_err(|error| {
        let diagnosis = SamplesFile::read_any(input, robot.robot.drive())
            .ok()
            .and_then(|samples| diagnose(robot, &samples, options));
        CalibrateError::new(error, diagnosis)
    })?;
    check_rows(robot, &measurements)?;
    Ok(of_the_platform_point(robot, measurements, options)?)
}

/// Positions are observations if the robot's transmissions are to be found: these are no part of what the methods
/// for positions estimate.
///
/// # Errors
/// More rows than are kept in memory.
pub fn for_transmissions(
    robot: &RobotFile,
    measurements: Measurements,
) -> Result<Measurements, InputError> {
    match measurements {
        Measurements::Positions(samples) if robot.transmission.is_some() => {
            if samples.all.is_some() {
                let cause = format!(
                    "with transmission_deg in [tolerance] a file has {MOST_IN_MEMORY} rows at most"
                );
                return Err(InputError::new(&samples.name, cause).with_remedy(
                    "delete rows, evenly over the file, or the line transmission_deg",
                ));
            }
            Ok(Measurements::Observations(samples.into()))
        }
        measurements => Ok(measurements),
    }
}

/// That the rows were measured, each by itself.
fn check_rows(robot: &RobotFile, measurements: &Measurements) -> Result<(), Reason> {
    let planned = |joints: [f64; 3], position: [Option<f64>; 3]| {
        let [Some(x), Some(y), Some(z)] = position else {
            return false;
        };
        let position = Vector3::new(x, y, z);
        is_planned(&robot.robot, &Sample { joints, position })
    };
    let (name, count, identical, planned): (_, _, _, Vec<_>) = match measurements {
        Measurements::Positions(samples) => {
            let (mut lines, mut first, mut same) = (Vec::new(), None, true);
            let Ok(()) = samples.each_part(|_, rows| {
                same &= rows
                    .iter()
                    .all(|row| *first.get_or_insert(row.value) == row.value);
                let planned = rows.par_iter().filter(|row| {
                    let Sample { joints, position } = row.value;
                    planned(joints, position.data.0[0].map(Some))
                });
                lines.par_extend(planned.map(|row| row.line));
                Ok::<_, Infallible>(())
            });
            let count = samples.count();
            (&samples.name, count, same && count > 1, lines)
        }
        Measurements::Observations(file) => {
            let planned = file
                .rows
                .iter()
                .filter(|row| planned(row.value.joints, row.value.position));
            let planned = planned.map(|row| row.line).collect();
            (&file.name, file.rows.len(), identical(&file.rows), planned)
        }
    };
    if identical {
        return Err(Reason::Refused(Refused {
            cause: format!("{name}: all {count} rows are identical, so they are one measurement"),
            remedy: "measure different poses, and write each into a row of its own".to_owned(),
        }));
    }
    let Some(first) = planned.first() else {
        return Ok(());
    };
    let are = if planned.len() == 1 {
        "this row is still as planned, not measured: its x, y and z are".to_owned()
    } else {
        let lines = in_lines(&planned);
        format!(
            "{} rows are still as planned, not measured ({lines}): their x, y and z are",
            planned.len()
        )
    };
    let cause = format!("{are} those of {} to the last digit", robot.name);
    Err(InputError::new(name, cause)
        .at_line(*first)
        .with_remedy(
            "write the measured x, y and z into the row, or delete the rows that were not measured",
        )
        .into())
}

fn identical<T: PartialEq>(rows: &[Row<T>]) -> bool {
    rows.len() > 1 && rows.windows(2).all(|pair| pair[0].value == pair[1].value)
}

/// Positions of the platform point in place of those of the [target], which the core knows nothing of.
fn of_the_platform_point(
    robot: &RobotFile,
    measurements: Measurements,
    options: Options,
) -> Result<Measurements, InputError> {
    let Some(target) = robot.instruments.target else {
        return Ok(measurements);
    };
    if options.frame == Frame::Sensor {
        let cause = "with --frame sensor the sensor's frame takes in the target's place, since the \
                     platform does not turn";
        return Err(InputError::new(&robot.name, cause)
            .at_key("[target]")
            .with_remedy("delete the section [target], or leave out --frame sensor"));
    }
    let frame = robot.sensor_frame.as_ref();
    let shift = frame.map_or(target, |frame| frame.rotation * target);
    Ok(match measurements {
        Measurements::Positions(samples) => Measurements::Positions(samples.moved(&-shift)),
        Measurements::Observations(mut file) => {
            for row in &mut file.rows {
                for (coordinate, shift) in row.value.position.iter_mut().zip(shift.iter()) {
                    *coordinate = coordinate.map(|value| value - shift);
                }
            }
            Measurements::Observations(file)
        }
    })
}

/// Calibrates the robot of a file from a file of samples.
///
/// # Errors
/// Options that exclude each other, a tolerance about a robot file that is not used as a start value, transmissions
/// that are [to be found](for_transmissions), a sample that is out of all proportion, or measurements that cannot calibrate this robot: the core refuses them, the
/// result is not credible without a stated tolerance, or it is expected to be worse than what there
/// was before.
pub fn calibrate(
    robot: &RobotFile,
    samples: &SamplesFile,
    options: Options,
) -> Result<CalibrationReport, CalibrateError> {
    let result = Case::new(robot, samples, options).and_then(|case| {
        let settings = case.settings()?;
        attempt(&case, &settings)
            .map(|attempt| report(&case, attempt))
            .map_err(|objection| explained(&case, &objection))
    });
    if let Some(all) = &samples.all {
        all.fault(&samples.name)?;
    }
    diagnosed(result, || diagnose(robot, samples, options))
}

/// A calibration that is accepted, without a report.
#[derive(Debug, Clone, PartialEq)]
pub struct Accepted {
    /// The method's result.
    pub outcome: Outcome,
    /// As the report states it; `None` if the uncertainty is not known.
    pub expected: Option<ExpectedError>,
    /// From the robot's frame to the sensor's, if that was looked for.
    pub sensor_frame: Option<RigidTransform<f64>>,
}

/// As [`calibrate`], for campaigns: only what it decides and expects. `None` where it refuses.
pub fn accepted(robot: &RobotFile, samples: &SamplesFile, options: Options) -> Option<Accepted> {
    let case = Case::new(robot, samples, options).ok()?;
    let attempt = attempt(&case, &case.settings().ok()?).ok()?;
    let outcome = attempt.fit.outcome;
    let expected = outcome.covariance.as_ref().and_then(|covariance| {
        let (robot, reach) = (&outcome.fit.robot, robot.reach());
        let uncertainty = PositionUncertainty { robot, covariance };
        ExpectedError::of(&uncertainty, &reach, &WorkspacePoses::within(robot, &reach))
    });
    Some(Accepted {
        outcome,
        expected,
        sensor_frame: case.sensor_frame,
    })
}

/// What was found elsewhere.
#[derive(Debug)]
pub struct Elsewhere {
    /// The parameters, and how well they are known.
    pub outcome: Outcome,
    /// What the samples count, and what there is to say of it, if the calibration had options of streams.
    pub stream: Option<(Weights, StreamReport)>,
    /// Of each sample, whether a gate rejected it.
    pub rejected: Vec<bool>,
}

/// The report of what a controller found from the same samples: `before` is its current geometry,
/// `robot` the file with its nominal one.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrated_elsewhere(
    robot: &RobotFile,
    before: &RobotFile,
    samples: &SamplesFile,
    options: Options,
    found: Result<Elsewhere, Unweighed>,
) -> Result<CalibrationReport, CalibrateError> {
    let case = Case::on_controller(robot, before, samples, options);
    let judged = found.map_err(Objection::from).and_then(|found| {
        let outcome = found.outcome;
        let (mut fit, stream) = match found.stream {
            None => (Fit::plain(outcome, case.all()), None),
            Some((weights, report)) => (Fit::weighed(outcome, case.all(), &weights), Some(report)),
        };
        fit.reject(case.all(), &found.rejected);
        if options.method == CalibrationMethod::Ikm {
            let samples = (case.measured.as_slice(), case.stands_for());
            shared_noise::complete(&mut fit, samples, robot.noise.as_ref());
        }
        let settings = Settings::default()
            .with_noise(robot.noise)
            .with_tolerance(robot.tolerance);
        Attempt::of(&case, &settings, fit, stream)
    });
    let result = judged
        .map(|attempt| report(&case, attempt))
        .map_err(|objection| explained(&case, &objection));
    diagnosed(result, || diagnose(robot, samples, options))
}

fn explained(case: &Case<'_>, objection: &Objection) -> Reason {
    let findings = match case.settings() {
        Ok(settings) if objection.may_be_wrong_samples() => investigate(case, &settings, objection),
        _ => Findings::default(),
    };
    let explainer = Explainer {
        case,
        findings: &findings,
    };
    explainer.explain(objection)
}

/// Samples may be wrong as a whole, whether they were accepted or refused.
fn diagnosed(
    result: Result<CalibrationReport, Reason>,
    diagnosis: impl FnOnce() -> Option<super::diagnosis::Diagnosis>,
) -> Result<CalibrationReport, CalibrateError> {
    match result {
        Ok(report) => Ok(report.diagnosed(diagnosis())),
        Err(reason @ Reason::Refused(_)) => Err(CalibrateError::new(reason, diagnosis())),
        Err(reason) => Err(reason.into()),
    }
}

fn report(case: &Case<'_>, attempt: Attempt) -> CalibrationReport {
    let Attempt {
        fit,
        stream,
        causes,
        widening,
        judgement,
        widened,
    } = attempt;
    let outcome = fit.outcome.clone();
    let estimated_noise = || Noise::new(outcome.estimated_noise()?, 0.0).ok();
    let noise = case.robot.noise.or_else(estimated_noise);
    let after = RobotFile {
        robot: outcome.fit.robot,
        sensor_frame: case.sensor_frame,
        record: case.robot.record.of_the_robot(),
        ..case.robot.clone()
    };
    let uncertainty = outcome
        .covariance
        .as_ref()
        .and_then(|covariance| UncertaintyMap::new(&after, covariance));
    let sample_errors = sample_errors(case, &judgement, &fit, &after, noise.as_ref());
    let every = fit.all.as_ref().map(|weights| {
        let medians = [&judgement.error_before, &judgement.error_after].map(|error| error.median);
        every_sample(
            case,
            &after,
            noise.as_ref(),
            weights,
            &sample_errors,
            medians,
        )
    });
    let shift = case
        .options
        .loss
        .and_then(|_| Shift::find(&after.robot, case, &fit));
    let mut report = CalibrationReport {
        options: case.options,
        before: case.before.clone(),
        after,
        samples_file: case.samples.name.clone(),
        samples: case.samples.count(),
        distinct_poses: distinct_poses(&case.measured),
        outcome,
        error_before: judgement.error_before,
        error_after: judgement.error_after,
        noise,
        noise_test: judgement.noise_test,
        causes,
        widening,
        prior_test: widened.or(judgement.prior_test),
        tolerance_widened: widened.is_some(),
        sample_errors,
        sampled: None,
        workspace: judgement.workspace,
        uncertainty,
        stream,
        diagnosis: None,
        shift,
        warnings: Vec::new(),
    };
    if let Some(every) = every {
        report.error_before = every.error_before;
        report.error_after = every.error_after;
        report.distinct_poses = every.distinct_poses;
        report.sample_errors = every.shown;
        report.sampled = Some(every.sampled);
    }
    report.warnings = warnings(&report);
    if !fit.settled {
        report.warnings.push(
            "the weights of the robust fit did not settle entirely: at least one sample is at the \
             edge between right and wrong"
                .to_owned(),
        );
    }
    report.with_at_most(MANY)
}

/// Of the samples in memory.
fn sample_errors(
    case: &Case<'_>,
    judgement: &Judgement,
    fit: &Fit,
    calibrated: &RobotFile,
    noise: Option<&Noise<f64>>,
) -> Vec<SampleErrors> {
    let before = judgement.distances_before.iter();
    let distances = before.zip(&judgement.distances_after);
    let rows = case.samples.rows.iter().zip(&case.measured);
    rows.zip(distances)
        .zip(&fit.samples)
        .map(
            |(((row, measured), (before, after)), weight)| SampleErrors {
                line: row.line,
                measured: *measured,
                before: *before,
                after: *after,
                after_in_sigmas: noise
                    .and_then(|noise| fkm::residual_in_sigmas(&calibrated.robot, measured, noise)),
                weight: *weight,
            },
        )
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
