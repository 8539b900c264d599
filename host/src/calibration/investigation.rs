//! What can be found out about samples that gave no calibration: which fit worst, and whether the
//! others agree. These are more fits; how many, and of how many samples, is bounded.

use super::attempt::plain;
use super::case::Case;
use super::causes::{Cause, Subject, causes};
use super::objection::Objection;
use super::outliers::worst_samples;
use super::plausibility;
use super::shift::Shift;
use crate::accuracy::position_error::{PositionError, distances};
use crate::fit::options::CalibrationMethod;
use crate::fit::robust::calibrate_robust;
use crate::fit::weights::SampleWeight;
use delta_cal::robust::Loss;
use delta_cal::{Noise, Settings};

/// More samples are not fitted again for the sake of a hint.
const MOST_SAMPLES: usize = 2000;
/// A cause must explain this part of the residuals' squares to be the reason for a refusal.
const MOST_OF_IT: f64 = 0.5;

/// What was found out.
#[derive(Debug, Clone, Default)]
pub(crate) struct Findings {
    /// The samples that fit worst, in words.
    pub(crate) worst_samples: Option<String>,
    /// The samples without which a robust fit calibrates the robot.
    pub(crate) disagreeing: Option<Disagreeing>,
    /// What explains most of the residuals and is not in the model.
    pub(crate) causes: Vec<Cause>,
}

/// Samples without which a robust fit calibrates the robot.
#[derive(Debug, Clone)]
pub(crate) struct Disagreeing {
    /// Their lines.
    pub(crate) lines: Vec<u64>,
    /// If they are those before or after some line.
    pub(crate) shift: Option<Shift>,
}

/// Looks for wrong samples: at most 205 fits of at most 200 samples (see `outliers`), three of any
/// number, and a robust one of at most [`MOST_SAMPLES`].
pub(crate) fn investigate(
    case: &Case<'_>,
    settings: &Settings<f64>,
    objection: &Objection,
) -> Findings {
    let causes = objection
        .times_the_noise()
        .map(|ratio| unmodelled(case, settings, ratio));
    Findings {
        worst_samples: worst_samples(case),
        disagreeing: disagreeing(case, settings),
        causes: causes.unwrap_or_default(),
    }
}

/// The causes of residuals that are `ratio` times the stated noise, by a fit with so much noise.
fn unmodelled(case: &Case<'_>, settings: &Settings<f64>, ratio: f64) -> Vec<Cause> {
    if case.starts_elsewhere() {
        return Vec::new();
    }
    let stated = case.robot.noise;
    let as_found =
        stated.and_then(|noise| Noise::new(ratio * noise.position(), ratio * noise.joint()).ok());
    let Ok(outcome) = plain(case, &settings.with_noise(as_found)) else {
        return Vec::new();
    };
    let weights = vec![SampleWeight::FULL; case.measured.len()];
    let subject = Subject {
        nominal: &case.robot.robot,
        calibrated: &outcome.fit.robot,
        samples: &case.measured,
        directions: &case.directions,
        weights: &weights,
        noise: stated,
        estimated_noise: outcome.estimated_noise(),
        tolerance: case.robot.tolerance,
        aligned: case.sensor_frame.is_some(),
        arms_apart: case.options.method == CalibrationMethod::Ikm,
    };
    let found = causes(&subject, &[]);
    if found.explained > MOST_OF_IT {
        found.found
    } else {
        Vec::new()
    }
}

fn disagreeing(case: &Case<'_>, settings: &Settings<f64>) -> Option<Disagreeing> {
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
    (!suspected.is_empty() && credible && !error.lies_elsewhere(calibrated)).then(|| Disagreeing {
        shift: Shift::find(calibrated, case, &fit),
        lines: suspected,
    })
}
