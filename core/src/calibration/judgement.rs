//! Decides whether the end point of an iteration is a calibration, or is refused and why.

use super::identifiability::Identifiability;
use super::limits::{
    CONDITION_OF_A_VALLEY, LARGEST_SIGMA, LARGEST_TOLERANCES, LEAST_FREEDOM, NOISE_MARGIN,
    chi_square_quantile,
};
use super::outcome::{Estimate, Start, Termination};
use super::point::Point;
use super::problem::{Extent, Judged};
use super::refusal::Refusal;
use super::tolerance::Tolerance;
use super::tolerance_prior::TolerancePrior;
use crate::Real;
use crate::robot::{ArmIndex, OF_ARM, OF_ROBOT, Parameter, ParameterKind};
use crate::samples::Unknowns;
use nalgebra::SMatrix;

/// An end point and the criteria for judging it.
pub(super) struct Judgement<'a, T: Unknowns<N>, const N: usize> {
    /// The arm of the first eight parameters.
    pub(super) first_arm: ArmIndex,
    pub(super) point: &'a Point<T, N>,
    pub(super) identifiability: &'a Identifiability<T, N>,
    /// How the iteration ended and where it started; `None` if it did not converge.
    pub(super) end: Option<(Termination, Start)>,
    pub(super) prior: &'a TolerancePrior<T, N>,
    pub(super) tolerance: Option<&'a Tolerance<T>>,
    /// σ of the residuals, which weights the prior against them.
    pub(super) residual_sigma: T,
    pub(super) iterations: u16,
}

impl<T: Unknowns<N>, const N: usize> Judgement<'_, T, N> {
    /// Judges an estimate whose covariance is known in internal units, and converts it to the caller's units.
    #[inline(never)] // with the others here 0.9 kB of joint flash
    pub(super) fn complete(
        &self,
        problem: &impl Judged<T, N>,
        place: &mut Estimate<T, N>,
    ) -> Result<(), Refusal> {
        let Some(covariance) = &mut place.covariance else {
            return Err(Refusal::Unfinished);
        };
        if !self.point.cost.finite() {
            return Err(Refusal::NonFinite {
                arm: self.first_arm,
            });
        }
        // Beyond this, rounding leaves no correct digit of the weakest combination.
        let largest_condition = T::ONE / (T::from_f64(64.0) * T::EPSILON);
        if !(self.identifiability.largest_condition() < largest_condition) {
            return Err(self.undetermined(problem));
        }
        let extent = problem.extent();
        let Extent {
            samples,
            effective_samples,
            residuals,
            unit,
            ..
        } = extent;
        let stated = unit.is_none();
        let Some((termination, start)) = self.end else {
            return Err(self.not_converged(problem, covariance));
        };
        self.check_residual(problem, &extent)?;
        self.check_tolerances(problem)?;

        let mut prior_share = self
            .prior
            .shares(&self.point.correction, covariance.as_slice());
        let mut determined = T::from_count(N as u64);
        for share in &mut prior_share {
            *share = (*share * self.residual_sigma.squared()).larger(T::ZERO);
            // The square of a large weight can overflow to NaN or infinity.
            if !(*share <= T::ONE) {
                *share = T::ONE;
            }
            determined -= *share;
        }
        let degrees_of_freedom = (residuals - determined).larger(T::ZERO);
        let sum = self.point.sum_of_squares;
        let sigma = if stated {
            Some(T::ONE)
        } else {
            let spare = degrees_of_freedom - T::from_f64(LEAST_FREEDOM);
            (spare > T::from_f64(1e-2)).then(|| (sum / spare).square_root())
        };
        if let Some(sigma) = sigma {
            self.check_sigmas(covariance, sigma, problem)?;
        }
        let unit = unit.unwrap_or(T::ONE);
        place.correction.copy_from_slice(&self.point.correction);
        place.prior_share = prior_share;
        place.residual_rms = (sum / residuals).square_root() * unit;
        place.estimated_noise = (!stated && degrees_of_freedom >= T::HALF)
            .then(|| (sum / degrees_of_freedom).square_root() * unit);
        place.degrees_of_freedom = degrees_of_freedom;
        place.effective_samples = effective_samples;
        place.samples = samples;
        place.iterations = self.iterations;
        place.termination = termination;
        place.start = start;
        place.conditions = [0, 1, 2].map(|arm| self.identifiability.condition(arm));
        match sigma {
            Some(sigma) => in_units(covariance, problem, sigma),
            None => place.covariance = None,
        }
        Ok(())
    }

    /// Why an iteration did not converge: in a flat valley, the poses or the stated noise leave no well-defined
    /// minimum.
    fn not_converged(&self, problem: &impl Judged<T, N>, covariance: &SMatrix<T, N, N>) -> Refusal {
        let condition = self.identifiability.largest_condition();
        if !(condition < T::from_f64(CONDITION_OF_A_VALLEY)) {
            return self.undetermined(problem);
        }
        if problem.extent().unit.is_none()
            && let Err(uncertain) = self.check_sigmas(covariance, T::ONE, problem)
        {
            return uncertain;
        }
        Refusal::NotConverged {
            arm: self.place(problem, self.identifiability.weakest).0,
            iterations: self.iterations,
        }
    }

    /// The refusal of a problem whose Jacobian is singular, or nearly so.
    fn undetermined(&self, problem: &impl Judged<T, N>) -> Refusal {
        let weakest = self.identifiability.weakest;
        if let Some(instrument) = problem.instrument_of(weakest) {
            return Refusal::UndeterminedInstrument(instrument);
        }
        let (arm, parameter) = self.place(problem, weakest);
        Refusal::Undetermined {
            arm,
            parameter,
            condition: to_single(self.identifiability.condition(weakest / OF_ARM)),
        }
    }

    /// The arm and parameter at an index.
    fn place(&self, problem: &impl Judged<T, N>, index: usize) -> (ArmIndex, Parameter) {
        let arm = ArmIndex::ALL.get(self.first_arm.index() + index / OF_ARM);
        let places = problem.arm(0).drive().places();
        let parameter = places.get(index % OF_ARM).copied().flatten();
        (
            arm.copied().unwrap_or(self.first_arm),
            parameter.unwrap_or(Parameter::Dx),
        )
    }

    /// χ² test of the total cost. Each parameter combination that the prior does not hold takes one degree of freedom
    /// from the number of residuals.
    ///
    /// Without a stated noise, residuals of any size would pass for noise, and a large noise keeps any robot near
    /// nominal whatever the samples are: they must not be larger than the tolerance makes those of the nominal robot.
    fn check_residual(
        &self,
        problem: &impl Judged<T, N>,
        extent: &Extent<T>,
    ) -> Result<(), Refusal> {
        let mut variance = T::ONE;
        if let Some(unit) = extent.unit {
            let Some(tolerance) = self.tolerance else {
                return Ok(());
            };
            variance = tolerance.of_closure(problem.arm(0).drive(), unit);
        }
        let unheld = T::from_count(self.prior.unheld() as u64);
        let freedom = (extent.residuals - unheld).larger(T::ONE);
        let Point {
            cost,
            sum_of_squares,
            ..
        } = *self.point;
        if cost <= chi_square_quantile(freedom) * T::from_f64(NOISE_MARGIN) * variance {
            return Ok(());
        }
        let ratio = to_single((sum_of_squares / (freedom * variance)).square_root());
        Err(if cost - sum_of_squares > sum_of_squares {
            self.far_from_nominal(problem)
        } else {
            Refusal::ResidualContradictsNoise {
                arm: (N == OF_ARM).then_some(self.first_arm),
                ratio,
            }
        })
    }

    fn check_tolerances(&self, problem: &impl Judged<T, N>) -> Result<(), Refusal> {
        if self.farthest().1 <= T::from_f64(LARGEST_TOLERANCES) {
            Ok(())
        } else {
            Err(self.far_from_nominal(problem))
        }
    }

    /// Checks that no σ is too large; `sigma` is that of a residual of 1.
    #[inline(never)] // see `complete`
    fn check_sigmas(
        &self,
        covariance: &SMatrix<T, N, N>,
        sigma: T,
        problem: &impl Judged<T, N>,
    ) -> Result<(), Refusal> {
        let variances = covariance.as_slice().iter().step_by(N + 1);
        let places = problem.arm(0).drive().places();
        let mut upper_arm = T::ONE;
        let judged = variances.zip(problem.units()).enumerate();
        for (index, (variance, own)) in judged.take(OF_ROBOT) {
            if index % OF_ARM == 0 {
                upper_arm = problem.arm(index).upper_arm_length();
            }
            let parameter = places.get(index % OF_ARM).copied().flatten();
            let unit = match parameter.map_or(ParameterKind::Length, Parameter::kind) {
                ParameterKind::Length => upper_arm,
                ParameterKind::Angle | ParameterKind::Ratio => T::ONE,
            };
            let own = own * sigma;
            let variance = *variance * (own * own);
            // Comparing squares is faster than computing each root.
            if !(variance <= (T::from_f64(LARGEST_SIGMA) * unit).squared()) {
                let (arm, parameter) = self.place(problem, index);
                return Err(Refusal::Uncertain {
                    arm,
                    parameter,
                    sigma: to_single(variance.square_root()),
                });
            }
        }
        Ok(())
    }

    /// The parameter furthest from nominal, in tolerances; 0 without a tolerance.
    #[inline(never)] // see `complete`
    fn farthest(&self) -> (usize, T) {
        let mut farthest = (0, T::ZERO);
        let distances = self.prior.distances(&self.point.correction);
        for (parameter, tolerances) in distances.into_iter().enumerate().take(OF_ROBOT) {
            if tolerances > farthest.1 {
                farthest = (parameter, tolerances);
            }
        }
        farthest
    }

    fn far_from_nominal(&self, problem: &impl Judged<T, N>) -> Refusal {
        let (index, tolerances) = self.farthest();
        let (arm, parameter) = self.place(problem, index);
        Refusal::FarFromNominal {
            arm,
            parameter,
            tolerances: to_single(tolerances),
        }
    }
}

/// Converts a covariance to the caller's units and multiplies it by σ².
#[inline(never)] // see `complete`
fn in_units<T: Unknowns<N>, const N: usize>(
    covariance: &mut SMatrix<T, N, N>,
    problem: &impl Judged<T, N>,
    sigma: T,
) {
    let units = problem.units().map(|unit| unit * sigma);
    let (columns, _) = covariance.as_mut_slice().as_chunks_mut::<N>();
    for (column, unit) in columns.iter_mut().zip(units) {
        scale_column(column, unit, &units);
    }
}

#[inline(never)] // see `complete`
fn scale_column<T: Real>(column: &mut [T], column_unit: T, row_units: &[T]) {
    for (entry, row_unit) in column.iter_mut().zip(row_units) {
        // Multiplies the units first, so that both halves are rounded alike.
        *entry *= column_unit * *row_unit;
    }
}

/// A figure for a message.
fn to_single<T: Real>(value: T) -> f32 {
    <f32 as Real>::from_f64(value.to_f64())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::{Identifiability, Judged, Judgement, Point, TolerancePrior};
    use crate::calibration::Refusal;
    use crate::fixtures::{empty, robot};
    use crate::robot::{ArmIndex, Parameter, ParameterKind};
    use nalgebra::SMatrix;

    /// The limits are a tenth of the arm's own upper arm for the σ of a length, and a tenth of a radian for that of an
    /// angle; the arms' lengths differ.
    #[test]
    fn every_parameter_is_judged_by_its_own_upper_arm() {
        let factor = empty(None);
        let (point, identifiability) = (Point::unstarted(), Identifiability::unstarted());
        let judgement = Judgement::<f64, 24> {
            first_arm: ArmIndex::First,
            point: &point,
            identifiability: &identifiability,
            end: None,
            prior: &TolerancePrior::of_weights([0.0; 24]),
            tolerance: None,
            residual_sigma: 1.0,
            iterations: 0,
        };
        for (number, arm) in ArmIndex::ALL.into_iter().enumerate() {
            for (place, parameter) in Parameter::ROTARY.into_iter().enumerate() {
                let limit = match parameter.kind() {
                    ParameterKind::Length => 0.1 * robot().arm(arm).upper_arm_length(),
                    _ => 0.1,
                };
                let judged = |sigma: f64| {
                    let mut covariance = SMatrix::<f64, 24, 24>::zeros();
                    let index = 8 * number + place;
                    let unit = factor.units()[index];
                    covariance[(index, index)] = (sigma / unit).powi(2);
                    judgement.check_sigmas(&covariance, 1.0, &factor)
                };
                assert_eq!(judged(0.999 * limit), Ok(()));
                let refusal = judged(1.001 * limit).unwrap_err();
                assert!(
                    matches!(refusal, Refusal::Uncertain { arm: named, parameter: of, sigma }
                    if named == arm && of == parameter && (f64::from(sigma) / limit - 1.001).abs() < 1e-6),
                    "{refusal:?}"
                );
            }
        }
    }
}
