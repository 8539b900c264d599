//! From two files to a report: everything that is computed is computed here, by the core.

use super::attempt::{Attempt, attempt};
use super::case::Case;
use super::diagnosis::diagnose;
use super::error::CalibrateError;
use super::investigation::{Findings, investigate};
use super::judgement::judge;
use super::objection::Objection;
use super::reason::Reason;
use super::refusal::Explainer;
use super::report::CalibrationReport;
use super::warnings::warnings;
use crate::accuracy::position_error::SampleErrors;
use crate::accuracy::position_uncertainty::UncertaintyMap;
use crate::files::input_text::InputText;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::SamplesFile;
use crate::fit::fkm;
use crate::fit::options::Options;
use crate::fit::outcome::Outcome;
use crate::fit::weights::Fit;
use delta_cal::{Noise, Refusal, RobotOutcome, Sample};

/// Reads the samples of a robot that is to be calibrated. Where joint angles are outside its limits,
/// what would explain the file as a whole is said.
///
/// # Errors
/// As [`SamplesFile::read`].
pub fn read_samples(
    input: &InputText,
    robot: &RobotFile,
    options: Options,
) -> Result<SamplesFile, CalibrateError> {
    SamplesFile::read(input, &robot.limits).map_err(|error| {
        let diagnosis = SamplesFile::read_any(input)
            .ok()
            .and_then(|samples| diagnose(robot, &samples, options));
        CalibrateError::new(error, diagnosis)
    })
}

/// Calibrates the robot of a file from a file of samples.
///
/// # Errors
/// Options that exclude each other, a tolerance about a robot file that is not used as a start value, a sample that is out
/// of all proportion, or measurements that cannot calibrate this robot: the core refuses them, the
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
    diagnosed(result, || diagnose(robot, samples, options))
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
) -> Result<CalibrationReport, CalibrateError> {
    let case = Case::on_controller(robot, before, samples, options);
    let judged = result.map_err(Objection::Fit).and_then(|outcome| {
        let fit = Fit::plain(Outcome::from(outcome), case.measured.len());
        let judgement = judge(&case, &fit)?;
        Ok(Attempt {
            fit,
            stream: None,
            judgement,
        })
    });
    let result = judged
        .map(|attempt| report(&case, attempt))
        .map_err(|objection| explained(&case, &objection));
    diagnosed(result, || diagnose(robot, samples, options))
}

fn explained(case: &Case<'_>, objection: &Objection) -> Reason {
    let findings = match case.settings() {
        Ok(settings) if objection.may_be_wrong_samples() => investigate(case, &settings),
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
        judgement,
    } = attempt;
    let outcome = fit.outcome;
    let estimated_noise = || Noise::new(outcome.estimated_noise()?, 0.0).ok();
    let noise = case.robot.noise.or_else(estimated_noise);
    let after = RobotFile {
        robot: outcome.fit.robot,
        sensor_frame: case.sensor_frame,
        ..case.robot.clone()
    };
    let uncertainty = outcome
        .covariance
        .as_ref()
        .and_then(|covariance| UncertaintyMap::new(&after, covariance));
    let distances = judgement
        .distances_before
        .into_iter()
        .zip(judgement.distances_after);
    let in_sigmas = in_sigmas(&after, &case.measured, noise.as_ref());
    let sample_errors = case
        .samples
        .rows
        .iter()
        .zip(&case.measured)
        .zip(distances)
        .zip(in_sigmas.into_iter().zip(&fit.samples))
        .map(
            |(((row, measured), (before, after)), (after_in_sigmas, weight))| SampleErrors {
                line: row.line,
                measured: *measured,
                before,
                after,
                after_in_sigmas,
                weight: *weight,
            },
        )
        .collect();
    let mut report = CalibrationReport {
        options: case.options,
        before: case.before.clone(),
        after,
        samples_file: case.samples.name.clone(),
        samples: case.measured.len(),
        distinct_poses: distinct_poses(&case.measured),
        outcome,
        error_before: judgement.error_before,
        error_after: judgement.error_after,
        noise,
        noise_test: judgement.noise_test,
        sample_errors,
        workspace: judgement.workspace,
        uncertainty,
        stream,
        diagnosis: None,
        warnings: Vec::new(),
    };
    report.warnings = warnings(&report);
    if !fit.settled {
        report.warnings.push(
            "the weights of the robust fit did not settle entirely: at least one sample is at the \
             edge between right and wrong"
                .to_owned(),
        );
    }
    report
}

fn in_sigmas(
    after: &RobotFile,
    measured: &[Sample<f64>],
    noise: Option<&Noise<f64>>,
) -> Vec<Option<f64>> {
    noise.map_or_else(
        || vec![None; measured.len()],
        |noise| fkm::residuals_in_sigmas(&after.robot, measured, noise),
    )
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
