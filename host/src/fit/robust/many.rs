//! The robust fit of more samples than are kept in memory.

use crate::fit::joint;
use crate::fit::outcome::Outcome;
use crate::fit::samples::OnDisk;
use crate::fit::weights::{Weights, WeightsOnDisk};
use delta_cal::calibration::limits::{LARGEST_SUSPECTED, SUSPECTED};
use delta_cal::calibration::{JointCalibrator, JointOutcome, Problem as _};
use delta_cal::robust::{Loss, RobustRefusal, WeighedSample, robust_fit};
use delta_cal::{Robot, Sample, Settings};
use rayon::prelude::*;

/// The start is the robust fit of so many samples.
const START: usize = 2500;
/// Rounds over all samples at most; most fits take 4.
const ROUNDS: usize = 20;
/// The rounds end when no parameter moves by more than this part of its σ.
const SETTLED: f64 = 0.01;

/// A joint fit, and what every sample counts in it.
pub(super) struct Found {
    pub(super) outcome: Outcome,
    pub(super) weights: Weights,
    pub(super) settled: bool,
    divisor: f64,
    suspected: Vec<bool>,
}

impl Found {
    /// What each sample counts, of samples that counted less before.
    pub(super) fn all(&self, before: Option<&Weights>) -> WeightsOnDisk {
        WeightsOnDisk {
            factors: self.weights.factors.clone(),
            divisor: self.divisor,
            remembered: before.map_or_else(Vec::new, |before| before.factors.clone()),
            suspected: self.suspected.clone(),
        }
    }
}

/// Starts from the robust fit of some samples, whose scale and κ of the weights hold for all: they are known to some
/// percent, and neither changes where the minimum is by as much as its σ. Then weighs and fits all samples until no
/// parameter moves.
///
/// # Errors
/// As the core's robust fit.
pub(super) fn fit(
    robot: &Robot<f64>,
    samples: &OnDisk<'_>,
    before: Option<&Weights>,
    settings: &Settings<f64>,
    loss: Loss,
) -> Result<Found, RobustRefusal> {
    let counts = |index: usize| match before {
        None => 1.0,
        Some(before) => before.factors.get(index).copied().unwrap_or(0.0),
    };
    let counted: Vec<_> = samples
        .chosen()
        .filter(|(index, _)| counts(*index) > 0.0)
        .map(|(_, sample)| *sample)
        .collect();
    let every = counted.len().div_ceil(START).max(1);
    let some: Vec<_> = counted.into_iter().step_by(every).collect();
    let mut work = vec![WeighedSample::vacant(); some.len()];
    let start = robust_fit(robot, settings, &some, loss, &mut work)?;
    let right = number(work.iter().filter(|sample| sample.weight() > 0.0).count());
    let worth = start.effective_samples / right;

    let empty = *JointCalibrator::new(robot, settings).factor();
    let width = start.scale * loss.stretch::<f64>(3);
    let count = samples.count();
    let mut weights = Weights::full(count);
    let mut suspected = vec![false; count];
    let (mut outcome, mut settled) = (start.fit, false);
    for _ in 0..ROUNDS {
        let at = empty.displaced(&outcome.estimate.correction);
        let mut halves = [empty; 2];
        let mut right = 0.0;
        let weigh = |index: usize, sample: &Sample<f64>| {
            let (before, distance) = (counts(index), empty.residual(sample, &at));
            let suspected = before > 0.0 && !(distance < SUSPECTED * width);
            let weight = if suspected {
                0.0
            } else {
                loss.weight(distance / width)
            };
            (before * weight / start.divisor, suspected)
        };
        let taken = samples.each_part(|first, samples| {
            let places = first..first + samples.len();
            let own = &mut weights.factors[places.clone()];
            samples
                .par_iter()
                .zip(own.par_iter_mut())
                .zip(suspected[places.clone()].par_iter_mut())
                .zip(places)
                .for_each(|(((sample, factor), suspected), index)| {
                    (*factor, *suspected) = weigh(index, sample);
                });
            right += number(own.iter().filter(|factor| **factor > 0.0).count());
            halves = joint::with_part(halves, (first, samples), Some(&weights))?;
            Ok(())
        });
        weights.effective_samples = worth * right * before.map_or(1.0, Weights::mean_of_counted);
        let factor = taken.and_then(|()| joint::of_halves(halves, Some(&weights)));
        let factor = factor.map_err(|(index, error)| RobustRefusal::Sample(index, error))?;
        let last = outcome;
        outcome = JointCalibrator::of_factor(factor, settings).solve()?;
        settled = moved(&last, &outcome) < SETTLED;
        if settled {
            break;
        }
    }
    let wrong = suspected.iter().filter(|own| **own).count();
    let all = (0..count).filter(|index| counts(*index) > 0.0).count();
    if number(wrong) > LARGEST_SUSPECTED * number(all) {
        return Err(RobustRefusal::TooManySuspected {
            suspected: wrong,
            samples: all,
        });
    }
    Ok(Found {
        outcome: Outcome::from(outcome),
        weights,
        settled,
        divisor: start.divisor,
        suspected,
    })
}

/// By how much a parameter moved at most, in its σ; infinitely far where that is not known.
fn moved(from: &JointOutcome<f64>, to: &JointOutcome<f64>) -> f64 {
    let Some(covariance) = &to.estimate.covariance else {
        return f64::INFINITY;
    };
    let values = |outcome: &JointOutcome<f64>| outcome.robot.parameters().into_iter().flatten();
    let differences = values(to)
        .zip(values(from))
        .map(|(to, from)| (to - from).abs());
    let sigmas = (0..24).map(|index| covariance[(index, index)].sqrt());
    let in_sigmas = differences.zip(sigmas).filter(|(_, sigma)| *sigma > 0.0);
    in_sigmas
        .map(|(moved, sigma)| moved / sigma)
        .fold(0.0, f64::max)
}

#[allow(clippy::cast_precision_loss)] // samples of a file
fn number(samples: usize) -> f64 {
    samples as f64
}
