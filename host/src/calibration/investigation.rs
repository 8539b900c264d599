//! What can be found out about samples that gave no calibration: which fit worst, and whether the
//! others agree. These are more fits; how many, and of how many samples, is bounded.

use super::case::Case;
use super::outliers::worst_samples;
use super::plausibility;
use crate::accuracy::position_error::{PositionError, distances};
use crate::fit::robust::calibrate_robust;
use delta_cal::Settings;
use delta_cal::robust::Loss;

/// More samples are not fitted again for the sake of a hint.
const MOST_SAMPLES: usize = 2000;

/// What was found out.
#[derive(Debug, Clone, Default)]
pub(crate) struct Findings {
    /// The samples that fit worst, in words.
    pub(crate) worst_samples: Option<String>,
    /// The lines of the samples without which a robust fit calibrates the robot.
    pub(crate) disagreeing: Option<Vec<u64>>,
}

/// Looks for wrong samples: at most 205 fits of at most 200 samples (see `outliers`), three of any
/// number, and a robust one of at most [`MOST_SAMPLES`].
pub(crate) fn investigate(case: &Case<'_>, settings: &Settings<f64>) -> Findings {
    Findings {
        worst_samples: worst_samples(case),
        disagreeing: disagreeing(case, settings),
    }
}

fn disagreeing(case: &Case<'_>, settings: &Settings<f64>) -> Option<Vec<u64>> {
    let options = case.options;
    if options.loss.is_some() || options.streaming.asked() || case.measured.len() > MOST_SAMPLES {
        return None;
    }
    let nominal = &case.robot.robot;
    let fit = calibrate_robust(
        nominal,
        &case.measured,
        settings,
        options.method,
        Loss::Tukey,
    )
    .ok()?;
    let calibrated = &fit.outcome.fit.robot;
    let fitted = case.samples.rows.iter().zip(&fit.samples);
    let suspected: Vec<_> = fitted
        .filter(|(_, sample)| sample.suspected)
        .map(|(row, _)| row.line)
        .collect();
    let apart = distances(calibrated, &case.measured);
    let error = PositionError::of_counted(&apart, &case.samples.rows, &fit.samples);
    let credible = case.robot.tolerance.is_some()
        || options.no_guess
        || plausibility::implausible(nominal, calibrated).is_none();
    (!suspected.is_empty() && credible && !error.lies_elsewhere(calibrated)).then_some(suspected)
}
