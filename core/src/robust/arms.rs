use super::median::median;
use super::weighted::{WeighedSample, WeightedArm};
use crate::Real;
use crate::calibration::{ArmSolver, Progress, Settings};
use crate::robot::ArmIndex;
use crate::samples::{Displacement, NominalArm};

/// The median of |r| of a normal r with σ = 1.
const MEDIAN: f64 = 0.6745;
/// Linearisations of a fit at the start.
const START_ITERATIONS: u16 = 15;
/// The scale of exact samples, in ε: what rounding leaves.
const ROUNDING: f64 = 32.0;

/// A correction of each arm, in internal units.
pub(super) type Corrections<T> = [[T; 8]; 3];

/// What the three arms are fitted with.
pub(super) struct Arms<'a, T: Real> {
    pub(super) settings: &'a Settings<T>,
    pub(super) nominal_arms: [&'a NominalArm<T>; 3],
}

impl<'a, T: Real> Arms<'a, T> {
    fn nominal(&self, arm: ArmIndex) -> &'a NominalArm<T> {
        let [first, second, third] = self.nominal_arms;
        match arm {
            ArmIndex::First => first,
            ArmIndex::Second => second,
            ArmIndex::Third => third,
        }
    }

    pub(super) fn problem<'b>(
        &self,
        arm: ArmIndex,
        samples: &'b [WeighedSample<T>],
        effective: &[T; 3],
    ) -> WeightedArm<'b, T>
    where
        'a: 'b,
    {
        WeightedArm {
            nominal: self.nominal(arm),
            samples,
            arm,
            effective_samples: effective.get(arm.index()).copied().unwrap_or(T::ZERO),
        }
    }

    /// The three arms' fits as the samples are weighed; `None` if one does not settle. What is judged
    /// is the last fit alone.
    fn fits_with(
        &self,
        settings: &Settings<T>,
        samples: &[WeighedSample<T>],
        effective: &[T; 3],
    ) -> Option<Corrections<T>> {
        let mut corrections = [[T::ZERO; 8]; 3];
        for (correction, arm) in corrections.iter_mut().zip(ArmIndex::ALL) {
            let problem = self.problem(arm, samples, effective);
            let mut solver = ArmSolver::new(&problem, arm, settings).ok()?;
            while solver.step(&problem) == Progress::Working {}
            *correction = solver.end()?;
        }
        Some(corrections)
    }

    pub(super) fn fits(
        &self,
        samples: &[WeighedSample<T>],
        effective: &[T; 3],
    ) -> Option<Corrections<T>> {
        self.fits_with(self.settings, samples, effective)
    }

    pub(super) fn start_fits(
        &self,
        samples: &[WeighedSample<T>],
        count: T,
    ) -> Option<Corrections<T>> {
        let settings = Settings {
            iteration_limit: self.settings.iteration_limit.min(START_ITERATIONS),
            ..*self.settings
        };
        self.fits_with(&settings, samples, &[count; 3])
    }

    /// Every sample's residuals at a correction of each arm.
    pub(super) fn residuals(&self, corrections: &Corrections<T>, samples: &mut [WeighedSample<T>]) {
        for sample in samples.iter_mut() {
            sample.distance = T::ZERO;
        }
        for (correction, arm) in corrections.iter().zip(ArmIndex::ALL) {
            let nominal = self.nominal(arm);
            let at = Displacement::new(nominal, correction);
            let unit = residual_unit(nominal);
            for sample in samples.iter_mut() {
                let own = sample.of_mut(arm);
                own.residual = at.weighted_constraint(&own.sample);
                let residual = own.residual * unit;
                sample.distance += residual.squared();
            }
        }
    }

    /// The largest of the arms' scales, in the unit of each arm's residuals.
    pub(super) fn scales(&self, samples: &[WeighedSample<T>]) -> [T; 3] {
        let count = T::from_count(samples.len() as u64);
        let fitted = (count / (count - T::from_f64(8.0))).square_root() / T::from_f64(MEDIAN);
        let mut largest = T::ZERO;
        for arm in ArmIndex::ALL {
            let sizes = samples
                .iter()
                .map(move |sample| sample.of(arm).residual.magnitude());
            largest = largest.larger(median(sizes) * residual_unit(self.nominal(arm)));
        }
        ArmIndex::ALL.map(|arm| {
            let nominal = self.nominal(arm);
            let least = match nominal.noise() {
                Some(_) => T::ONE,
                None => T::from_f64(ROUNDING) * T::EPSILON,
            };
            least.larger(largest / residual_unit(nominal) * fitted)
        })
    }
}

/// Length of a residual's unit without a stated noise; with one it is in σ.
pub(super) fn residual_unit<T: Real>(nominal: &NominalArm<T>) -> T {
    match nominal.noise() {
        Some(_) => T::ONE,
        None => nominal.scale(),
    }
}
