//! How many poses reach a wanted accuracy.

use super::{Expectation, LEAST_POSES, PlanError, PlanRequest, expected};

/// Poses up to which plans are made; beyond, σ is taken to fall with √N.
pub const MANY: usize = 64;

/// How many poses reach an accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosesNeeded {
    /// The wanted σ of the position, mm.
    pub accuracy: f64,
    /// For the rms over the workspace (over the region, if there is one).
    pub rms: usize,
    /// For the worst place in it.
    pub everywhere: usize,
}

/// How many poses bring the position's σ, √tr(J C Jᵀ), down to `accuracy` (mm): found by planning,
/// and beyond [`MANY`] poses by σ ∝ 1/√N from there.
///
/// # Errors
/// As [`plan`](super::plan).
pub fn poses_needed(request: &PlanRequest<'_>, accuracy: f64) -> Result<PosesNeeded, PlanError> {
    let mut plans = Vec::new();
    Ok(PosesNeeded {
        accuracy,
        rms: least(request, accuracy, &mut plans, |found| over(found).0)?,
        everywhere: least(request, accuracy, &mut plans, |found| over(found).1)?,
    })
}

/// rms and largest σ, where it matters.
fn over(expectation: &Expectation) -> (f64, f64) {
    let sigma = expectation.region.unwrap_or(expectation.workspace);
    (sigma.rms, sigma.max)
}

/// Bisection: more poses are taken to be better.
fn least(
    request: &PlanRequest<'_>,
    accuracy: f64,
    plans: &mut Vec<(usize, Expectation)>,
    sigma: impl Fn(&Expectation) -> f64,
) -> Result<usize, PlanError> {
    let mut of = |count: usize| -> Result<f64, PlanError> {
        if let Some((_, known)) = plans.iter().find(|(planned, _)| *planned == count) {
            return Ok(sigma(known));
        }
        let planned = expected(&PlanRequest { count, ..*request })?;
        let found = sigma(&planned);
        plans.push((count, planned));
        Ok(found)
    };
    let best = of(MANY)?;
    if !(best <= accuracy) {
        let ratio = best / accuracy;
        #[allow(clippy::cast_precision_loss)] // 64
        let count = (MANY as f64 * ratio * ratio).ceil();
        // Saturates, far beyond what anybody measures.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        return Ok(count as usize);
    }
    let (mut too_few, mut enough) = (LEAST_POSES - 1, MANY);
    while enough - too_few > 1 {
        let middle = usize::midpoint(too_few, enough);
        let reached = match of(middle) {
            Ok(found) => found <= accuracy,
            Err(PlanError::NotDetermined { .. } | PlanError::Singular) => false,
            Err(error) => return Err(error),
        };
        if reached {
            enough = middle;
        } else {
            too_few = middle;
        }
    }
    Ok(enough)
}
