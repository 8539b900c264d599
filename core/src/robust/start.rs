//! Where a robust fit starts: the samples that agree best.
//!
//! ```text
//! minimise  Σ over the h smallest of  dₖ² = |W f|²
//! ```
//!
//! Least trimmed squares (Rousseeuw 1984) by concentration steps (Rousseeuw and Van Driessen, 2006):
//! fit some samples, keep the h that lie nearest to that fit, fit those. No step raises the sum.
//!
//! Wrong samples may agree with each other, as those after somebody moved the tracker do. Then no step
//! leads from a subset that holds some of them to the right fit. Random subsets are therefore as small as
//! the problem allows, and there are enough of them; and since such a change begins at some sample, all
//! samples before and after each of many places are subsets as well.

use super::median::of_rank;
use super::robot::{Correction, Fits};
use super::sample::WeighedSample;
use crate::Real;

/// Samples of a random subset: they determine the robot from its nominal parameters, and fewer do so
/// with a tolerance.
const SUBSET: usize = 9;
const SUBSET_WITH_TOLERANCE: usize = 6;
/// Random subsets. Of 30 % wrong samples four subsets of nine in a hundred hold none, of 40 % one.
const SUBSETS: usize = 150;
/// Places at which a change is supposed to begin.
const PLACES: usize = 24;
/// Concentration ends when a step leaves more than this part of the sum.
const PROGRESS: f64 = 0.999;
/// A fit that leaves so many times the least sum so far is not followed: the steps improve a fit of good
/// samples by less.
const HOPELESS: f64 = 100.0;
/// Concentration steps of each, and of the best.
const FIRST_STEPS: usize = 1;
const LAST_STEPS: usize = 10;
/// With more samples than this the start looks at an even selection of them.
const MOST: usize = 150;
/// Spare samples beyond half: the h of the highest breakdown point is (n + p + 1)/2, of three
/// residuals a sample and 24 parameters.
const BEYOND_HALF: usize = 9;
/// The search ends when the sum over what is kept is below this part of what a stated noise makes of as
/// many samples. The smallest half of good samples have a third of it.
const GOOD: f64 = 0.75;

/// The least trimmed squares' fit; `None` if no subset gives one.
pub(super) fn least_trimmed<T: Real>(
    fits: &Fits<'_, T>,
    samples: &mut [WeighedSample<T>],
) -> Option<Correction<T>> {
    let stride = samples.len() / MOST + 1;
    let mut starting = 0;
    for (index, sample) in samples.iter_mut().enumerate() {
        sample.starting = index % stride == 0;
        starting += usize::from(sample.starting);
    }
    let mut search = Search {
        fits,
        kept: usize::midpoint(starting, BEYOND_HALF).min(starting),
        best: None,
    };
    choose(samples, |_, sample| sample.starting);
    search.try_chosen(samples, FIRST_STEPS);
    // The samples that lie nearest to the robot before calibration.
    fits.measure(&[T::ZERO; 24], samples);
    choose_nearest(samples, search.kept);
    search.try_chosen(samples, FIRST_STEPS);
    search.try_changes(samples, starting);
    search.try_subsets(samples, starting);
    let (_, correction) = search.best?;
    fits.measure(&correction, samples);
    choose_nearest(samples, search.kept);
    search.try_chosen(samples, LAST_STEPS);
    search.best.map(|(_, correction)| correction)
}

struct Search<'a, T: Real> {
    fits: &'a Fits<'a, T>,
    /// How many samples are kept.
    kept: usize,
    /// The least sum so far, and its fit.
    best: Option<(T, Correction<T>)>,
}

impl<T: Real> Search<'_, T> {
    /// Whether the stated noise alone explains the samples that are kept.
    fn is_good(&self) -> bool {
        let expected = T::from_f64(3.0 * GOOD) * T::from_count(self.kept as u64);
        self.fits.settings.noise.is_some()
            && self.best.as_ref().is_some_and(|(sum, _)| *sum < expected)
    }

    /// Supposes that a change begins at each of many samples.
    fn try_changes(&mut self, samples: &mut [WeighedSample<T>], starting: usize) {
        let places = PLACES.min(starting);
        for place in 1..places {
            let boundary = samples.len() * place / places;
            for before in [true, false] {
                if self.is_good() {
                    return;
                }
                let chosen = choose(samples, |index, sample| {
                    sample.starting && (index < boundary) == before
                });
                if chosen >= self.subset() {
                    self.try_chosen(samples, FIRST_STEPS);
                }
            }
        }
    }

    fn try_subsets(&mut self, samples: &mut [WeighedSample<T>], starting: usize) {
        let mut random = Random(0x9e37_79b9);
        for _ in 0..SUBSETS {
            if self.is_good() {
                return;
            }
            let (mut wanted, mut left) = (self.subset().min(self.kept), starting);
            choose(samples, |_, sample| {
                // Knuth's algorithm S: as many as are wanted, every choice equally likely.
                let chosen = sample.starting && random.below(left) < wanted;
                left = left.saturating_sub(usize::from(sample.starting));
                wanted = wanted.saturating_sub(usize::from(chosen));
                chosen
            });
            self.try_chosen(samples, FIRST_STEPS);
        }
    }

    fn subset(&self) -> usize {
        let settings = self.fits.settings;
        match (settings.start, settings.tolerance) {
            (crate::calibration::Start::Free, _) => 12,
            (crate::calibration::Start::Nominal, None) => SUBSET,
            (crate::calibration::Start::Nominal, Some(_)) => SUBSET_WITH_TOLERANCE,
        }
    }

    /// Fits the chosen samples, and the nearest to that fit, and so on.
    fn try_chosen(&mut self, samples: &mut [WeighedSample<T>], steps: usize) {
        let mut last: Option<T> = None;
        for _ in 0..=steps {
            let chosen = samples.iter().filter(|sample| sample.factor > T::ZERO);
            let count = T::from_count(chosen.count() as u64);
            let Some(correction) = self.fits.rough_fit(samples, count) else {
                return;
            };
            self.fits.measure(&correction, samples);
            let Some(sum) = choose_nearest(samples, self.kept) else {
                return;
            };
            let least = self.best.as_ref().map_or(T::INFINITY, |(least, _)| *least);
            if sum < least {
                self.best = Some((sum, correction));
            }
            if sum > T::from_f64(HOPELESS) * least {
                return;
            }
            if last.is_some_and(|last| !(sum < last * T::from_f64(PROGRESS))) {
                return;
            }
            last = Some(sum);
        }
    }
}

/// Lets those samples count alike and the others not at all; how many count.
fn choose<T: Real>(
    samples: &mut [WeighedSample<T>],
    mut chosen: impl FnMut(usize, &WeighedSample<T>) -> bool,
) -> usize {
    let mut count = 0;
    for (index, sample) in samples.iter_mut().enumerate() {
        let counts = chosen(index, sample);
        sample.factor = if counts { T::ONE } else { T::ZERO };
        count += usize::from(counts);
    }
    count
}

/// Chooses as many samples as are to be kept, and sums up their squared distances.
fn choose_nearest<T: Real>(samples: &mut [WeighedSample<T>], kept: usize) -> Option<T> {
    let distances = samples
        .iter()
        .filter(|sample| sample.starting)
        .map(|sample| sample.distance);
    let farthest = of_rank(distances, kept.saturating_sub(1))?;
    let mut sum = T::ZERO;
    choose(samples, |_, sample| {
        let near = sample.starting && sample.distance <= farthest;
        if near {
            sum += sample.distance.squared();
        }
        near
    });
    sum.finite().then_some(sum)
}

/// Marsaglia's xorshift (2003): the same subsets everywhere.
struct Random(u32);

impl Random {
    /// A number below `bound`, all alike; 0 for a bound of 0.
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        let scaled = (u64::from(self.0) * bound as u64) >> 32;
        usize::try_from(scaled).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests;
