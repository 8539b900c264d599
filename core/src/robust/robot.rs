use super::median::median;
use super::sample::WeighedSample;
use crate::Real;
use crate::calibration::{
    JointCalibrator, JointOutcome, Minimizer, Problem, Progress, Refusal, Settings,
    tolerance_weights,
};
use crate::robot::ArmIndex;
use crate::samples::{JointFactor, Sample};

/// The median length of three normal residuals with σ = 1.
const MEDIAN: f64 = 1.538_172;
/// Samples that the fit uses up: 24 parameters are the residuals of eight samples, and the start chooses the
/// smallest half besides, which of few good samples names one in two hundred if it is not made up for.
const FITTED: f64 = 12.0;
/// Linearisations of a fit at the start.
const START_ITERATIONS: u16 = 15;
/// The scale of exact samples, in ε: what rounding leaves.
const ROUNDING: f64 = 32.0;

/// A correction of all parameters, in internal units.
pub(super) type Correction<T> = [T; 24];

/// What the samples are fitted with.
pub(super) struct Fits<'a, T: Real> {
    pub(super) settings: &'a Settings<T>,
    pub(super) samples: &'a [Sample<T>],
    /// Without samples.
    pub(super) empty: JointFactor<T>,
}

impl<T: Real> Fits<'_, T> {
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

    fn fit_with(
        &self,
        settings: &Settings<T>,
        weighed: &[WeighedSample<T>],
        effective: T,
    ) -> Option<Correction<T>> {
        let factor = self.factor(weighed, effective);
        let prior = tolerance_weights(&factor, settings);
        let mut minimizer = Minimizer::with_prior(&factor, ArmIndex::First, prior, settings)
            .ok()?
            .for_its_end();
        while minimizer.step(&factor) == Progress::Working {}
        minimizer.end()
    }

    /// The fit as the samples are weighed; `None` if it does not settle. What is judged is the last fit
    /// alone.
    pub(super) fn fit(&self, weighed: &[WeighedSample<T>], effective: T) -> Option<Correction<T>> {
        self.fit_with(self.settings, weighed, effective)
    }

    /// The same, roughly, for the start.
    pub(super) fn rough_fit(
        &self,
        weighed: &[WeighedSample<T>],
        effective: T,
    ) -> Option<Correction<T>> {
        let settings = Settings {
            iteration_limit: self.settings.iteration_limit.min(START_ITERATIONS),
            ..*self.settings
        };
        self.fit_with(&settings, weighed, effective)
    }

    /// The judged fit.
    pub(super) fn outcome(
        &self,
        weighed: &[WeighedSample<T>],
        effective: T,
    ) -> Result<JointOutcome<T>, Refusal> {
        JointCalibrator::of_factor(self.factor(weighed, effective), self.settings).solve()
    }

    /// Every sample's distance at a correction.
    #[inline(never)]
    pub(super) fn measure(&self, correction: &Correction<T>, weighed: &mut [WeighedSample<T>]) {
        let at = Problem::displaced(&self.empty, correction);
        for (sample, own) in self.samples.iter().zip(weighed) {
            let mut sum = T::ZERO;
            for residual in self.empty.prepare(sample).residuals(&at) {
                sum += residual.squared();
            }
            own.distance = sum.square_root();
        }
    }

    /// The scale of the distances: their median over that of normal residuals. 24 parameters make them
    /// smaller than they are for others.
    pub(super) fn scale(&self, weighed: &[WeighedSample<T>]) -> T {
        let count = T::from_count(weighed.len() as u64);
        let fitted = (count / (count - T::from_f64(FITTED))).square_root() / T::from_f64(MEDIAN);
        let least = match self.settings.noise {
            Some(_) => T::ONE,
            None => T::from_f64(ROUNDING) * T::EPSILON,
        };
        least.larger(median(weighed.iter().map(|own| own.distance)) * fitted)
    }
}
