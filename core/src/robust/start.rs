//! Where a robust fit starts: the samples that agree best.
//!
//! ```text
//! minimise  Σ over the h smallest of  dₖ² = Σ over the arms of (f/σf)²
//! ```
//!
//! Least trimmed squares (Rousseeuw 1984) by concentration steps (Rousseeuw and Van Driessen, 2006):
//! fit some samples, keep the h that lie nearest to that fit, fit those. No step raises the sum. A
//! sample is right or wrong as a whole, so that one arm in which a wrong position is conspicuous
//! keeps it from the other two.

use super::arms::Arms;
use super::median::of_rank;
use super::weighted::WeighedSample;
use crate::Real;

/// Samples of a random subset: they determine an arm without a guess.
const SUBSET: usize = 12;
/// Random subsets. One in fifteen has no wrong sample if a fifth of all samples is wrong; the steps
/// mend most of the others.
const SUBSETS: usize = 40;
/// Concentration ends when a step leaves more than this part of the sum.
const PROGRESS: f64 = 0.999;
/// Concentration steps of each, and of the best.
const FIRST_STEPS: usize = 2;
const LAST_STEPS: usize = 10;
/// With more samples than this the start looks at an even selection of them.
const MOST: usize = 300;
/// Spare samples beyond half: the h of the highest breakdown point is (n + p + 1)/2.
const BEYOND_HALF: usize = 9;

pub(super) type Corrections<T> = [[T; 8]; 3];

/// The least trimmed squares' fit; `None` if no subset gives one.
pub(super) fn least_trimmed<T: Real>(
    arms: &Arms<'_, T>,
    samples: &mut [WeighedSample<T>],
) -> Option<Corrections<T>> {
    let stride = samples.len() / MOST + 1;
    let mut starting = 0;
    for (index, sample) in samples.iter_mut().enumerate() {
        sample.starting = index % stride == 0;
        starting += usize::from(sample.starting);
    }
    let kept = usize::midpoint(starting, BEYOND_HALF).min(starting);
    let mut best = None;
    choose(samples, |sample| sample.starting);
    keep_better(&mut best, concentrate(arms, samples, kept, FIRST_STEPS));
    // The samples that lie nearest to the robot before calibration.
    arms.residuals(&[[T::ZERO; 8]; 3], samples);
    choose_nearest(samples, kept);
    keep_better(&mut best, concentrate(arms, samples, kept, FIRST_STEPS));
    let mut random = Random(0x9e37_79b9);
    for _ in 0..SUBSETS {
        let (mut wanted, mut left) = (SUBSET.min(kept), starting);
        choose(samples, |sample| {
            // Knuth's algorithm S: as many as are wanted, every choice equally likely.
            let chosen = sample.starting && random.below(left) < wanted;
            left = left.saturating_sub(usize::from(sample.starting));
            wanted = wanted.saturating_sub(usize::from(chosen));
            chosen
        });
        keep_better(&mut best, concentrate(arms, samples, kept, FIRST_STEPS));
    }
    let (_, corrections) = best?;
    arms.residuals(&corrections, samples);
    choose_nearest(samples, kept);
    keep_better(&mut best, concentrate(arms, samples, kept, LAST_STEPS));
    best.map(|(_, corrections)| corrections)
}

/// A trimmed sum and the fit that has it.
type Trimmed<T> = (T, Corrections<T>);

fn keep_better<T: Real>(best: &mut Option<Trimmed<T>>, found: Option<Trimmed<T>>) {
    if let Some((sum, _)) = &found
        && best.as_ref().is_none_or(|(least, _)| sum < least)
    {
        *best = found;
    }
}

/// Fits the chosen samples, and the nearest to that fit, and so on; the best sum and its fit.
fn concentrate<T: Real>(
    arms: &Arms<'_, T>,
    samples: &mut [WeighedSample<T>],
    kept: usize,
    steps: usize,
) -> Option<Trimmed<T>> {
    let mut best: Option<Trimmed<T>> = None;
    for _ in 0..=steps {
        let chosen = samples.iter().filter(|sample| {
            let [first, ..] = &sample.arms;
            first.root > T::ZERO
        });
        let count = T::from_count(chosen.count() as u64);
        let Some(corrections) = arms.start_fits(samples, count) else {
            break;
        };
        arms.residuals(&corrections, samples);
        let Some(sum) = choose_nearest(samples, kept) else {
            break;
        };
        if let Some((least, _)) = &best
            && !(sum < *least * T::from_f64(PROGRESS))
        {
            break;
        }
        best = Some((sum, corrections));
    }
    best
}

fn choose<T: Real>(
    samples: &mut [WeighedSample<T>],
    mut chosen: impl FnMut(&WeighedSample<T>) -> bool,
) {
    for sample in samples {
        let root = if chosen(sample) { T::ONE } else { T::ZERO };
        for arm in &mut sample.arms {
            arm.root = root;
        }
    }
}

/// Chooses as many samples as are to be kept, and sums up their squared distances.
fn choose_nearest<T: Real>(samples: &mut [WeighedSample<T>], kept: usize) -> Option<T> {
    let distances = samples
        .iter()
        .filter(|sample| sample.starting)
        .map(|sample| sample.distance);
    let farthest = of_rank(distances, kept.saturating_sub(1))?;
    let mut sum = T::ZERO;
    choose(samples, |sample| {
        let near = sample.starting && sample.distance <= farthest;
        if near {
            sum += sample.distance;
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
