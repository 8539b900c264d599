//! Whether a fit is good: credible, reproduced by the robot, and expected to improve it.

use super::case::Case;
use super::noise_test::NoiseTest;
use super::objection::Objection;
use super::plausibility;
use crate::accuracy::position_error::{PositionError, distances};
use crate::accuracy::workspace_comparison::WorkspaceComparison;
use crate::fit::weights::Fit;

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
}

/// Judges a fit.
///
/// # Errors
/// What speaks against it.
pub(crate) fn judge(case: &Case<'_>, fit: &Fit) -> Result<Judgement, Objection> {
    let robot = case.robot;
    let calibrated = fit.outcome.fit.robot;
    let error_of =
        |distances: &[_]| PositionError::of_counted(distances, &case.samples.rows, &fit.samples);
    let distances_before = distances(&case.before.robot, &case.measured);
    let distances_after = distances(&calibrated, &case.measured);
    let error_after = error_of(&distances_after);
    // A stated tolerance already keeps what is not known near where it was.
    let credible_by_itself = robot.tolerance.is_some() || case.options.no_guess;
    if !credible_by_itself
        && let Some(change) = plausibility::implausible(&robot.robot, &calibrated)
    {
        return Err(Objection::Implausible(change));
    }
    if error_after.lies_elsewhere(&calibrated) {
        return Err(Objection::NotReproduced(error_after));
    }
    let workspace = WorkspaceComparison::of(&case.before.robot, &fit.outcome, &robot.limits);
    if robot.tolerance.is_none()
        && let Some(comparison) = &workspace
        && comparison.expected_worse()
    {
        return Err(Objection::Worse(*comparison, error_after));
    }
    let noise_test = NoiseTest::of(
        case.before,
        case.options.method,
        &fit.outcome,
        &case.measured,
    );
    if let Some(test) = &noise_test
        && test.beyond_tolerance()
    {
        return Err(Objection::NoiseBeyondTolerance(*test));
    }
    Ok(Judgement {
        error_before: error_of(&distances_before),
        distances_before,
        distances_after,
        error_after,
        workspace,
        noise_test,
    })
}
