//! A calibration that is fitted and judged, and not yet reported or explained.

use super::case::Case;
use super::judgement::{Judgement, judge};
use super::objection::Objection;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::SamplesFile;
use crate::fit::fkm;
use crate::fit::options::{CalibrationMethod, Options};
use crate::fit::outcome::Outcome;
use crate::fit::robust::calibrate_robust;
use crate::fit::stream::{self, StreamReport};
use crate::fit::weights::Fit;
use delta_cal::{Calibrator, Settings};

/// A fit that is good.
pub(crate) struct Attempt {
    pub(crate) fit: Fit,
    pub(crate) stream: Option<StreamReport>,
    pub(crate) judgement: Judgement,
}

/// Fits and judges.
///
/// # Errors
/// What speaks against the calibration.
pub(crate) fn attempt(case: &Case<'_>, settings: &Settings<f64>) -> Result<Attempt, Objection> {
    let (fit, stream) = fitted(case, settings)?;
    let judgement = judge(case, &fit)?;
    Ok(Attempt {
        fit,
        stream,
        judgement,
    })
}

/// After a calibration: half of the samples are off by less than this, mm. `None` if it is refused.
pub(crate) fn position_error_after(
    robot: &RobotFile,
    samples: &SamplesFile,
    options: Options,
) -> Option<f64> {
    let case = Case::new(robot, samples, options).ok()?;
    let attempt = attempt(&case, &case.settings().ok()?).ok()?;
    Some(attempt.judgement.error_after.median)
}

fn fitted(
    case: &Case<'_>,
    settings: &Settings<f64>,
) -> Result<(Fit, Option<StreamReport>), Objection> {
    let (nominal, measured, options) = (&case.robot.robot, &case.measured, case.options);
    if options.streaming.asked() {
        let rows = &case.samples.rows;
        let (fit, report) =
            stream::calibrate(nominal, settings, measured, rows, options.streaming)?;
        return Ok((fit, Some(report)));
    }
    let mut calibrator = Calibrator::new(nominal, settings);
    calibrator
        .add_many(measured)
        .map_err(|(index, error)| Objection::Sample(index, error))?;
    let plain = |outcome| Fit::plain(outcome, measured.len());
    let fit = match (options.loss, options.method) {
        (Some(loss), method) => calibrate_robust(nominal, measured, settings, method, loss)?,
        (None, CalibrationMethod::Ikm) => plain(Outcome::from(calibrator.solve()?)),
        (None, CalibrationMethod::Fkm) => plain(fkm::calibrate(nominal, measured, settings)?),
    };
    Ok((fit, None))
}
