use super::fits::Fits;
use super::sample::WeighedSample;
use crate::Real;
use crate::calibration::{
    JointCalibrator, JointOutcome, Minimizer, Problem, Progress, Refusal, Settings, Start,
    tolerance_prior,
};
use crate::robot::ArmIndex;
use crate::samples::{JointFactor, Sample};

/// Samples that determine the robot from its nominal parameters, and fewer do so with a tolerance.
const SUBSET: usize = 9;
const SUBSET_WITH_TOLERANCE: usize = 6;
const SUBSET_WITHOUT_GUESS: usize = 12;
/// With few samples good ones lie many scales off the start's fit, and come back as long as the scales are wide.
const WIDENED: f64 = 20.0;
/// 24 parameters are the residuals of eight samples.
const PARAMETERS: usize = 8;

/// Positions, by the joint calibration.
pub(super) struct Positions<'a, T: Real> {
    pub(super) settings: &'a Settings<T>,
    pub(super) samples: &'a [Sample<T>],
    /// Without samples.
    pub(super) empty: JointFactor<T>,
}

impl<T: Real> Positions<'_, T> {
    /// The samples that count, in one factor.
    #[inline(never)]
    fn factor(&self, weighed: &[WeighedSample<T>], effective: T) -> JointFactor<T> {
        let mut factor = self.empty;
        for (sample, own) in self.samples.iter().zip(weighed) {
            factor.absorb_weighted(sample, own.factor);
        }
        factor.count_as(effective);
        factor
    }
}

impl<T: Real> Fits<T> for Positions<'_, T> {
    type Correction = [T; 24];
    type Outcome = JointOutcome<T>;

    fn settings(&self) -> &Settings<T> {
        self.settings
    }

    fn widened(&self) -> T {
        T::from_f64(WIDENED)
    }

    fn nominal(&self) -> [T; 24] {
        [T::ZERO; 24]
    }

    fn subset(&self) -> usize {
        match (self.settings.start, self.settings.tolerance) {
            (Start::Free, _) => SUBSET_WITHOUT_GUESS,
            (Start::Nominal, None) => SUBSET,
            (Start::Nominal, Some(_)) => SUBSET_WITH_TOLERANCE,
        }
    }

    /// Every sample has three residuals, which say more than a tolerance does.
    fn prior_cost(&self, _: &[T; 24]) -> T {
        T::ZERO
    }

    fn parameters(&self) -> usize {
        PARAMETERS
    }

    fn fit(
        &mut self,
        settings: &Settings<T>,
        weighed: &[WeighedSample<T>],
        effective: T,
    ) -> Option<[T; 24]> {
        let factor = self.factor(weighed, effective);
        let prior = tolerance_prior(&factor, settings);
        let mut minimizer = Minimizer::with_prior(&factor, ArmIndex::First, prior, settings)
            .ok()?
            .for_its_end();
        while minimizer.step(&factor) == Progress::Working {}
        minimizer.end()
    }

    fn outcome(
        &mut self,
        weighed: &[WeighedSample<T>],
        effective: T,
    ) -> Result<JointOutcome<T>, Refusal> {
        JointCalibrator::of_factor(self.factor(weighed, effective), self.settings).solve()
    }

    fn measure(&self, correction: &[T; 24], weighed: &mut [WeighedSample<T>]) {
        let at = Problem::displaced(&self.empty, correction);
        for (sample, own) in self.samples.iter().zip(weighed) {
            own.distance = self.empty.residual(sample, &at);
        }
    }
}

#[cfg(test)]
mod tests;
