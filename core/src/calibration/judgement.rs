//! Whether the end point of an iteration is a calibration: it is good, or refused with the cause.

use super::identifiability::Identifiability;
use super::iteration::Iteration;
use super::limits::{
    CONDITION_OF_A_VALLEY, LARGEST_SIGMA, LARGEST_TOLERANCES, LEAST_FREEDOM, NOISE_MARGIN,
    chi_square_quantile,
};
use super::outcome::{ArmOutcome, StartUsed, Termination};
use super::problem::ArmProblem;
use super::refusal::Refusal;
use crate::Real;
use crate::robot::{ArmIndex, Parameter, ParameterKind};
use crate::samples::{NominalArm, corrected_arm};
use nalgebra::{SMatrix, SVector};

/// An end point, and what it is judged by.
pub(super) struct Judgement<'a, T: Real> {
    pub(super) arm: ArmIndex,
    pub(super) iteration: &'a Iteration<T>,
    /// How the iteration ended and where it had started; `None` if it did not settle.
    pub(super) end: Option<(Termination, StartUsed)>,
    /// 1/tolerance in internal units, zero without a tolerance.
    pub(super) tolerance_weights: &'a [T; 8],
    /// The same as weighted against the residuals.
    pub(super) prior: [T; 8],
    pub(super) has_tolerance: bool,
    pub(super) iterations: u16,
}

impl<T: Real> Judgement<'_, T> {
    #[inline(never)]
    pub(super) fn outcome<P: ArmProblem<T>>(&self, problem: &P) -> Result<ArmOutcome<T>, Refusal> {
        let arm = self.arm;
        let mut identifiability = Identifiability::of(&self.iteration.normal);
        // Beyond this no digit of the weakest combination survives the arithmetic.
        let largest_condition = T::ONE / (T::from_f64(64.0) * T::EPSILON);
        if !(identifiability.condition < largest_condition) {
            return Err(identifiability.undetermined(arm));
        }
        let nominal = problem.nominal();
        let samples = problem.effective_samples();
        let stated = nominal.noise().is_some();
        let Some((termination, start)) = self.end else {
            return Err(self.not_converged(problem, &mut identifiability));
        };
        if stated {
            self.check_residual(samples)?;
        }
        self.check_tolerances()?;

        let degrees_of_freedom =
            (samples - identifiability.determined_parameters(&self.prior)).larger(T::ZERO);
        let sum = self.iteration.sum_of_squares;
        let estimated_noise = (!stated && degrees_of_freedom >= T::HALF)
            .then(|| (sum / degrees_of_freedom).square_root());
        let residual_sigma = if stated {
            Some(T::ONE)
        } else {
            let spare = degrees_of_freedom - T::from_f64(LEAST_FREEDOM);
            (spare > T::from_f64(1e-2)).then(|| (sum / spare).square_root())
        };
        let mut prior_share = SVector::<T, 8>::zeros();
        for ((share, weight), variance) in prior_share
            .iter_mut()
            .zip(self.prior)
            .zip(identifiability.covariance.diagonal().iter())
        {
            *share = (weight.squared() * *variance).larger(T::ZERO);
            if *share > T::ONE {
                *share = T::ONE;
            }
        }
        let covariance = &mut identifiability.covariance;
        if let Some(sigma) = residual_sigma {
            to_units(covariance, nominal, sigma);
            self.check_sigmas(covariance, nominal.arm().upper_arm_length())?;
        }
        let residual_unit = if stated { T::ONE } else { nominal.scale() };
        Ok(ArmOutcome {
            arm: corrected_arm(nominal, &self.iteration.correction)
                .map_err(|error| Refusal::ImpossibleGeometry { arm, error })?,
            covariance: residual_sigma.map(|_| identifiability.covariance),
            residual_rms: (sum / samples).square_root() * residual_unit,
            estimated_noise: estimated_noise.map(|noise| noise * nominal.scale()),
            degrees_of_freedom,
            samples: problem.samples(),
            iterations: self.iterations,
            termination,
            start,
            condition: identifiability.condition,
            prior_share,
        })
    }

    /// Why an iteration did not settle: along a flat valley it is the poses, or the stated noise,
    /// that leave it no firm minimum.
    #[inline(never)]
    fn not_converged<P: ArmProblem<T>>(
        &self,
        problem: &P,
        identifiability: &mut Identifiability<T>,
    ) -> Refusal {
        if !(identifiability.condition < T::from_f64(CONDITION_OF_A_VALLEY)) {
            return identifiability.undetermined(self.arm);
        }
        let nominal = problem.nominal();
        if nominal.noise().is_some() {
            to_units(&mut identifiability.covariance, nominal, T::ONE);
            let upper_arm = nominal.arm().upper_arm_length();
            if let Err(uncertain) = self.check_sigmas(&identifiability.covariance, upper_arm) {
                return uncertain;
            }
        }
        Refusal::NotConverged {
            arm: self.arm,
            iterations: self.iterations,
        }
    }

    /// χ² test of the whole cost: with a prior it has as many degrees of freedom as there are
    /// samples, without one eight fewer.
    fn check_residual(&self, samples: T) -> Result<(), Refusal> {
        let freedom = if self.has_tolerance {
            samples
        } else {
            samples - T::from_f64(8.0)
        }
        .larger(T::ONE);
        let Iteration {
            cost,
            sum_of_squares,
            ..
        } = *self.iteration;
        if cost <= chi_square_quantile(freedom) * T::from_f64(NOISE_MARGIN) {
            return Ok(());
        }
        Err(if cost - sum_of_squares > sum_of_squares {
            self.far_from_nominal()
        } else {
            Refusal::ResidualContradictsNoise {
                arm: self.arm,
                ratio: to_single((sum_of_squares / freedom).square_root()),
            }
        })
    }

    fn check_tolerances(&self) -> Result<(), Refusal> {
        if self.farthest().1 <= T::from_f64(LARGEST_TOLERANCES) {
            Ok(())
        } else {
            Err(self.far_from_nominal())
        }
    }

    #[inline(never)]
    fn check_sigmas(&self, covariance: &SMatrix<T, 8, 8>, upper_arm: T) -> Result<(), Refusal> {
        for (parameter, variance) in Parameter::ALL.into_iter().zip(&covariance.diagonal()) {
            let unit = match parameter.kind() {
                ParameterKind::Length => upper_arm,
                ParameterKind::Angle => T::ONE,
            };
            if !(variance.square_root() <= T::from_f64(LARGEST_SIGMA) * unit) {
                return Err(Refusal::Uncertain {
                    arm: self.arm,
                    parameter,
                    sigma: to_single(variance.square_root()),
                });
            }
        }
        Ok(())
    }

    /// The parameter furthest from nominal, in tolerances; 0 without a tolerance.
    #[inline(never)]
    fn farthest(&self) -> (Parameter, T) {
        let mut farthest = (Parameter::Dx, T::ZERO);
        for ((weight, delta), parameter) in self
            .tolerance_weights
            .iter()
            .zip(self.iteration.correction)
            .zip(Parameter::ALL)
        {
            let tolerances = (*weight * delta).magnitude();
            if tolerances > farthest.1 {
                farthest = (parameter, tolerances);
            }
        }
        farthest
    }

    fn far_from_nominal(&self) -> Refusal {
        let (parameter, tolerances) = self.farthest();
        Refusal::FarFromNominal {
            arm: self.arm,
            parameter,
            tolerances: to_single(tolerances),
        }
    }
}

impl<T: Real> Identifiability<T> {
    /// The refusal of a problem whose Jacobian is singular, or nearly so.
    pub(super) fn undetermined(&self, arm: ArmIndex) -> Refusal {
        Refusal::Undetermined {
            arm,
            parameter: Parameter::ALL
                .get(self.weakest)
                .copied()
                .unwrap_or(Parameter::Dx),
            condition: to_single(self.condition),
        }
    }
}

/// Brings a covariance into the user's units and multiplies it by σ².
#[inline(never)]
fn to_units<T: Real>(covariance: &mut SMatrix<T, 8, 8>, nominal: &NominalArm<T>, sigma: T) {
    let units = Parameter::ALL.map(|parameter| nominal.unit_of(parameter) * sigma);
    for (column, unit) in covariance.as_mut_slice().chunks_exact_mut(8).zip(units) {
        scale_column(column, unit, &units);
    }
}

#[inline(never)]
fn scale_column<T: Real>(column: &mut [T], column_unit: T, row_units: &[T]) {
    for (entry, row_unit) in column.iter_mut().zip(row_units) {
        // The product of the units first: both halves are rounded alike.
        *entry *= column_unit * *row_unit;
    }
}

/// A figure for a message.
fn to_single<T: Real>(value: T) -> f32 {
    <f32 as Real>::from_f64(value.to_f64())
}
