//! Whether a fit is good: credible, reproduced by the robot, and expected to improve it.

use super::case::Case;
use super::noise_test::NoiseTest;
use super::objection::Objection;
use super::plausibility;
use super::prior_test::PriorTest;
use crate::accuracy::position_error::{PositionError, distances};
use crate::accuracy::workspace_comparison::{Calibrated, WorkspaceComparison};
use crate::fit::options::{CalibrationMethod, Frame};
use crate::fit::outcome::Outcome;
use crate::fit::weights::Fit;
use delta_cal::Settings;

/// What a fit was judged by.
pub(crate) struct Judgement {
    /// How far each sample is off with the parameters before; `None` where they cannot reach it.
    pub(crate) distances_before: Vec<Option<f64>>,
    /// The same with the calibrated ones.
    pub(crate) distances_after: Vec<Option<f64>>,
    pub(crate) error_before: PositionError,
    pub(crate) error_after: PositionError,
    pub(crate) workspace: Option<WorkspaceComparison>,
    pub(crate) noise_test: Option<NoiseTest>,
    /// Of the stated tolerance.
    pub(crate) prior_test: Option<PriorTest>,
}

/// Judges a fit with these settings, of whose residuals `noise_test` tells.
///
/// # Errors
/// What speaks against it.
pub(crate) fn judge(
    case: &Case<'_>,
    settings: &Settings<f64>,
    fit: &Fit,
    noise_test: Option<NoiseTest>,
) -> Result<Judgement, Objection> {
    let robot = case.robot;
    let calibrated = fit.outcome.fit.robot;
    let error_of =
        |distances: &[_]| PositionError::of_counted(distances, &case.samples.rows, &fit.samples);
    let distances_before = distances(&case.before.robot, &case.measured);
    let distances_after = distances(&calibrated, &case.measured);
    let error_after = error_of(&distances_after);
    // A stated tolerance already keeps what is not known near where it was.
    let credible_by_itself = settings.tolerance.is_some() || case.options.no_guess;
    if !credible_by_itself
        && let Some(change) = plausibility::implausible(&robot.robot, &calibrated)
    {
        return Err(Objection::Implausible(change));
    }
    if error_after.lies_elsewhere(&calibrated) {
        return Err(Objection::NotReproduced(error_after));
    }
    let freedom = degrees_of_freedom(&fit.outcome, case.options.method);
    let workspace = fit.outcome.covariance.as_ref().and_then(|covariance| {
        let calibrated = Calibrated {
            before: &case.before.robot,
            after: &calibrated,
            covariance,
            tolerance: settings.tolerance.as_ref(),
            degrees_of_freedom: settings.noise.is_none().then_some(freedom),
            relative: case.options.frame == Frame::Sensor,
        };
        WorkspaceComparison::of(&calibrated, &robot.reach())
    });
    let has_tolerance = settings.tolerance.is_some();
    let arms = fit.outcome.fit.arms.iter();
    if !has_tolerance && arms.map(|arm| arm.degrees_of_freedom).sum::<f64>() < 1.0 {
        return Err(Objection::UnknownError);
    }
    let prior_test = settings.tolerance.as_ref().and_then(|tolerance| {
        let (nominal, noise) = (&robot.robot, settings.noise.as_ref());
        let outcome = &fit.outcome;
        PriorTest::of(
            nominal,
            tolerance,
            outcome,
            &case.measured,
            &fit.samples,
            noise,
            case.options.frame,
        )
    });
    if let Some(test) = &prior_test
        && test.contradicts()
        && !(case.on_controller && test.samples_decide())
    {
        return Err(Objection::BeyondTolerance(*test));
    }
    if let Some(test) = &noise_test
        && test.beyond_tolerance()
    {
        return Err(Objection::NoiseBeyondTolerance(*test));
    }
    match &workspace {
        Some(comparison) if comparison.is_harmful(has_tolerance) => {
            return Err(Objection::Worse(*comparison, error_after));
        }
        Some(comparison) if comparison.chance_of_harm.is_some() => {}
        _ if settings.noise.is_none() => return Err(Objection::UnknownError),
        _ => {}
    }
    Ok(Judgement {
        error_before: error_of(&distances_before),
        distances_before,
        distances_after,
        error_after,
        workspace,
        noise_test,
        prior_test,
    })
}

/// Of the estimated noise: with arms calibrated apart each has its own.
fn degrees_of_freedom(outcome: &Outcome, method: CalibrationMethod) -> f64 {
    let arms = outcome.fit.arms.iter().map(|arm| arm.degrees_of_freedom);
    match method {
        CalibrationMethod::Ikm => arms.fold(f64::INFINITY, f64::min),
        _ => arms.sum(),
    }
}
