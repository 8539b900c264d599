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

use super::fits::Fits;
use super::median::of_rank;
use super::sample::WeighedSample;
use crate::Real;
use crate::calibration::Settings;

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
/// Linearisations of a fit at the start.
const ITERATIONS: u16 = 15;
/// The search ends when the sum over what is kept is below this part of what a stated noise makes of as
/// many samples. The smallest half of good samples have a third of it.
const GOOD: f64 = 0.75;

/// The least trimmed squares' fit; `None` if no subset gives one.
pub(super) fn least_trimmed<T: Real, F: Fits<T>>(
    fits: &mut F,
    samples: &mut [WeighedSample<T>],
) -> Option<F::Correction> {
    let stride = samples.len() / MOST + 1;
    let mut starting = 0;
    for (index, sample) in samples.iter_mut().enumerate() {
        sample.starting = index % stride == 0 && sample.dimensions > 0;
        starting += usize::from(sample.starting);
    }
    let settings = Settings {
        iteration_limit: fits.settings().iteration_limit.min(ITERATIONS),
        ..*fits.settings()
    };
    // The h of the highest breakdown point: (n + p + 1)/2.
    let kept = usize::midpoint(starting, fits.parameters() + 1).min(starting);
    let nominal = fits.nominal();
    let mut search = Search {
        fits,
        settings,
        kept,
        best: None,
    };
    choose(samples, |_, sample| sample.starting);
    search.try_chosen(samples, FIRST_STEPS);
    // The samples that lie nearest to the robot before calibration.
    search.fits.measure(&nominal, samples);
    choose_nearest(samples, search.kept);
    search.try_chosen(samples, FIRST_STEPS);
    search.try_changes(samples, starting);
    search.try_subsets(samples, starting);
    let (_, correction) = search.best?;
    search.fits.measure(&correction, samples);
    choose_nearest(samples, search.kept);
    search.try_chosen(samples, LAST_STEPS);
    search.best.map(|(_, correction)| correction)
}

struct Search<'a, T: Real, F: Fits<T>> {
    fits: &'a mut F,
    /// For fits of the start.
    settings: Settings<T>,
    /// How many samples are kept.
    kept: usize,
    /// The least sum so far, and its fit.
    best: Option<(T, F::Correction)>,
}

impl<T: Real, F: Fits<T>> Search<'_, T, F> {
    /// Whether the stated noise alone explains the samples that are kept.
    fn is_good(&self, samples: &[WeighedSample<T>]) -> bool {
        let starting = || samples.iter().filter(|sample| sample.starting);
        let residuals = starting().map(|sample| u64::from(sample.dimensions)).sum();
        let each = T::from_count(residuals) / T::from_count(starting().count() as u64);
        let expected = T::from_f64(GOOD) * each * T::from_count(self.kept as u64);
        self.settings.noise.is_some() && self.best.as_ref().is_some_and(|(sum, _)| *sum < expected)
    }

    /// Supposes that a change begins at each of many samples.
    fn try_changes(&mut self, samples: &mut [WeighedSample<T>], starting: usize) {
        let places = PLACES.min(starting);
        for place in 1..places {
            let boundary = samples.len() * place / places;
            for before in [true, false] {
                if self.is_good(samples) {
                    return;
                }
                let chosen = choose(samples, |index, sample| {
                    sample.starting && (index < boundary) == before
                });
                if chosen >= self.fits.subset() {
                    self.try_chosen(samples, FIRST_STEPS);
                }
            }
        }
    }

    fn try_subsets(&mut self, samples: &mut [WeighedSample<T>], starting: usize) {
        let mut random = Random(0x9e37_79b9);
        for _ in 0..SUBSETS {
            if self.is_good(samples) {
                return;
            }
            let (mut wanted, mut left) = (self.fits.subset().min(self.kept), starting);
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

    /// Fits the chosen samples, and the nearest to that fit, and so on.
    fn try_chosen(&mut self, samples: &mut [WeighedSample<T>], steps: usize) {
        let mut last: Option<T> = None;
        for _ in 0..=steps {
            let chosen = samples.iter().filter(|sample| sample.factor > T::ZERO);
            let count = T::from_count(chosen.count() as u64);
            let Some(correction) = self.fits.fit(&self.settings, samples, count) else {
                return;
            };
            self.fits.measure(&correction, samples);
            let Some(sum) = choose_nearest(samples, self.kept) else {
                return;
            };
            let sum = sum + self.fits.prior_cost(&correction);
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
