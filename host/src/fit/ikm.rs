//! The IKM method: each arm's eight parameters from its own closures. The calibration itself is the core's.

use crate::fit::outcome::Outcome;
use crate::fit::samples::Samples;
use crate::fit::weights::Weights;
use delta_cal::{ArmIndex, Calibrator, Refusal, Robot, Settings};

/// Calibrates a robot from samples that count alike or as they were weighed.
///
/// # Errors
/// Every [`Refusal`] of the core's calibration of separate arms.
pub fn calibrate_weighted(
    robot: &Robot<f64>,
    samples: Samples<'_>,
    weights: Option<&Weights>,
    settings: &Settings<f64>,
) -> Result<Outcome, Refusal> {
    let mut calibrator = Calibrator::new(robot, settings);
    samples
        .each_part(|first, samples| match weights {
            None => calibrator.add_many(samples),
            Some(weights) => {
                let factors = weights.factors.iter().copied().skip(first);
                calibrator.add_weighted(samples.iter().zip(factors), weights.effective_samples)
            }
        })
        .map_err(|_| Refusal::NonFinite {
            arm: ArmIndex::First,
        })?;
    Ok(Outcome::from(calibrator.solve()?))
}
