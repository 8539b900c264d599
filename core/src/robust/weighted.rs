//! The samples of an arm with the weights that a robust fit gives them.

use crate::Real;
use crate::calibration::{ArmProblem, Linearize, Means, Normal, free_start, row_by_row};
use crate::robot::ArmIndex;
use crate::samples::{ArmFactor, ArmSample, Displacement, NominalArm, Waiting};

/// One sample in a robust fit's work space, and what the fit makes of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeighedSample<T: Real> {
    pub(super) arms: [WeighedArm<T>; 3],
    pub(super) suspected: bool,
    /// Whether the start looks at it.
    pub(super) starting: bool,
    /// Σ over the arms of the squared residuals, by which the start orders the samples.
    pub(super) distance: T,
}

/// What one arm has of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WeighedArm<T: Real> {
    pub(super) sample: ArmSample<T>,
    /// f/σf, in σ or internal units.
    pub(super) residual: T,
    /// ψ(r)/r.
    pub(super) weight: T,
    /// √ of the factor with which the sample enters the sum of squares.
    pub(super) root: T,
}

impl<T: Real> WeighedSample<T> {
    pub(crate) fn new(samples: [ArmSample<T>; 3]) -> Self {
        Self {
            arms: samples.map(|sample| WeighedArm {
                sample,
                residual: T::ZERO,
                weight: T::ONE,
                root: T::ONE,
            }),
            suspected: false,
            starting: true,
            distance: T::ZERO,
        }
    }

    /// A place that holds no sample.
    pub fn vacant() -> Self {
        Self::new([ArmSample::vacant(); 3])
    }

    /// What the sample counts in the fit, 0 to 1: the least of its weights in the three arms.
    pub fn weight(&self) -> T {
        let [first, second, third] = self.arms.map(|arm| arm.weight);
        let smaller = |a: T, b: T| if b < a { b } else { a };
        smaller(smaller(first, second), third)
    }

    /// How far the sample is off in σ, of the stated noise or of the one estimated from the
    /// residuals: the largest of the three arms', with its arm.
    pub fn residual(&self) -> (ArmIndex, T) {
        let mut largest = (ArmIndex::First, T::ZERO);
        for (arm, weighed) in ArmIndex::ALL.into_iter().zip(&self.arms) {
            if !(weighed.residual.magnitude() <= largest.1) {
                largest = (arm, weighed.residual.magnitude());
            }
        }
        largest
    }

    /// Whether the sample is wrong: its residual in some arm is
    /// [`SUSPECTED`](crate::calibration::limits::SUSPECTED) times the scale or more.
    pub fn suspected(&self) -> bool {
        self.suspected
    }

    pub(super) fn of(&self, arm: ArmIndex) -> &WeighedArm<T> {
        let [first, second, third] = &self.arms;
        match arm {
            ArmIndex::First => first,
            ArmIndex::Second => second,
            ArmIndex::Third => third,
        }
    }

    pub(super) fn of_mut(&mut self, arm: ArmIndex) -> &mut WeighedArm<T> {
        let [first, second, third] = &mut self.arms;
        match arm {
            ArmIndex::First => first,
            ArmIndex::Second => second,
            ArmIndex::Third => third,
        }
    }
}

/// One arm's problem.
#[derive(Debug, Clone, Copy)]
pub(super) struct WeightedArm<'a, T: Real> {
    pub(super) nominal: &'a NominalArm<T>,
    pub(super) samples: &'a [WeighedSample<T>],
    pub(super) arm: ArmIndex,
    pub(super) effective_samples: T,
}

impl<'a, T: Real> WeightedArm<'a, T> {
    /// The samples that count, each with its weight in the sum of squares.
    fn counted(&self) -> impl Iterator<Item = (&'a ArmSample<T>, T)> + use<'a, T> {
        let arm = self.arm;
        self.samples.iter().filter_map(move |sample| {
            let own = sample.of(arm);
            (own.root > T::ZERO).then_some((&own.sample, own.root))
        })
    }

    fn factor(&self) -> ArmFactor<T> {
        let mut factor = ArmFactor::new(*self.nominal);
        for (sample, root) in self.counted() {
            let mut weighted = *sample;
            weighted.weight *= root;
            factor.absorb(&[weighted]);
        }
        factor
    }
}

impl<T: Real> ArmProblem<T> for WeightedArm<'_, T> {
    fn nominal(&self) -> &NominalArm<T> {
        self.nominal
    }
    fn samples(&self) -> u64 {
        self.counted().count() as u64
    }
    fn effective_samples(&self) -> T {
        self.effective_samples
    }
}

impl<T: Real> Linearize<T> for WeightedArm<'_, T> {
    fn linearize(&self, at: &Displacement<T>, normal: &mut Normal<T>) -> T {
        row_by_row::linearize(self.counted(), at, normal)
    }

    fn sum_of_squares(&self, at: &Displacement<T>) -> T {
        row_by_row::sum_of_squares(self.counted(), at)
    }

    fn means(&self) -> Means<T> {
        row_by_row::means(self.counted())
    }

    /// Every sample is there from the start.
    fn absorb_waiting(&mut self, _: &Waiting<T>, _: ArmIndex) {}

    fn free_start(&self) -> Option<[T; 8]> {
        free_start(&self.factor())
    }

    fn least_sum_of_squares(&self) -> T {
        self.factor().least_sum_of_squares()
    }

    fn terms_squared(&self) -> T {
        self.rows_squared()
    }

    fn rows_squared(&self) -> T {
        row_by_row::rows_squared(self.counted())
    }
}

#[cfg(test)]
mod tests;
