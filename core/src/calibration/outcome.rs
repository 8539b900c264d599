use crate::Real;
use crate::robot::{Arm, ArmIndex, OF_ARM, Parameter, Robot};
use crate::samples::part;
use nalgebra::{SMatrix, SVector};

/// Why the iteration stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Termination {
    /// No step could reduce the sum of squares by more than rounding.
    GradientVanished,
    /// The last step, already at the level of rounding, no longer reduced it.
    RoundingReached,
}

/// The start that led to the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Start {
    /// The nominal robot.
    Nominal,
    /// The linear fit, without an initial guess.
    Free,
    /// A point displaced from an earlier solution along the combination that the samples determine least.
    Search,
}

/// Estimated values of N parameters and their uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate<T: Real, const N: usize> {
    /// Differences of the parameters from nominal, in the problem's units.
    pub correction: [T; N],
    /// Covariance in the caller's units; see [`ArmOutcome::covariance`].
    pub covariance: Option<SMatrix<T, N, N>>,
    /// √(Σ r² / residuals): in σ with a stated noise, otherwise a length.
    pub residual_rms: T,
    /// σ of a residual, estimated. Length. `None` with a stated noise, or without redundant samples.
    pub estimated_noise: Option<T>,
    /// Degrees of freedom: residuals minus the number of parameters determined by the samples rather than the prior.
    pub degrees_of_freedom: T,
    /// The effective number of samples.
    pub effective_samples: T,
    /// Number of samples added.
    pub samples: u64,
    /// Linearisations, summed over all starts.
    pub iterations: u16,
    /// Why the iteration stopped.
    pub termination: Termination,
    /// Where the iteration started.
    pub start: Start,
    /// Condition number of each arm's parameters; see [`ArmOutcome::condition`].
    pub conditions: [T; 3],
    /// Share of each parameter decided by the prior; see [`ArmOutcome::prior_share`].
    pub prior_share: [T; N],
}

impl<T: Real, const N: usize> Estimate<T, N> {
    /// K of the parameters, from one on, alone; the other figures are those of all.
    pub(crate) fn part<const K: usize>(&self, first: usize) -> Estimate<T, K> {
        let block = |all: &SMatrix<T, N, N>| {
            SMatrix::<T, K, K>::from_fn(|row, column| {
                let entry = all.get((first + row, first + column));
                entry.copied().unwrap_or(T::ZERO)
            })
        };
        Estimate {
            correction: part(&self.correction, first),
            covariance: self.covariance.as_ref().map(block),
            prior_share: part(&self.prior_share, first),
            residual_rms: self.residual_rms,
            estimated_noise: self.estimated_noise,
            degrees_of_freedom: self.degrees_of_freedom,
            effective_samples: self.effective_samples,
            samples: self.samples,
            iterations: self.iterations,
            termination: self.termination,
            start: self.start,
            conditions: self.conditions,
        }
    }

    /// A placeholder.
    #[inline(always)]
    pub(crate) const fn vacant() -> Self {
        Self {
            correction: [T::ZERO; N],
            covariance: None,
            residual_rms: T::ZERO,
            estimated_noise: None,
            degrees_of_freedom: T::ZERO,
            effective_samples: T::ZERO,
            samples: 0,
            iterations: 0,
            termination: Termination::GradientVanished,
            start: Start::Nominal,
            conditions: [T::ZERO; 3],
            prior_share: [T::ZERO; N],
        }
    }
}

/// One calibrated arm and its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmOutcome<T: Real> {
    /// The calibrated arm.
    pub arm: Arm<T>,
    /// Covariance of the eight parameters: (JᵀJ)⁻¹ of the weighted Jacobian, prior included. Length², length · radian,
    /// radian². Without a stated noise it is scaled by the residual variance and by ν/(ν − 2), the variance of
    /// Student's t with ν degrees of freedom. `None` if fewer than three redundant samples are available to estimate
    /// it.
    pub covariance: Option<SMatrix<T, 8, 8>>,
    /// √(Σ (f/σf)² / samples): in σ with a stated noise, otherwise the distance f/(2 Lb) along the forearm, a length.
    pub residual_rms: T,
    /// σ of the distance error along the forearm, estimated from the residuals. Length. `None` with a stated noise, or
    /// without redundant samples. Imprecise with few degrees of freedom.
    pub estimated_noise: Option<T>,
    /// Degrees of freedom: samples minus the number of parameters determined by the samples rather than the prior.
    pub degrees_of_freedom: T,
    /// Number of samples added.
    pub samples: u64,
    /// Linearisations, summed over all starts.
    pub iterations: u16,
    /// Why the iteration stopped.
    pub termination: Termination,
    /// Where the iteration started.
    pub start: Start,
    /// Condition number of the weighted Jacobian with columns scaled to unit length, prior included: ‖A‖‖A⁻¹‖/8 in
    /// Frobenius norms, 1 for orthogonal columns. The condition number in the 2-norm is between one and eight times
    /// this.
    pub condition: T,
    /// Share of each parameter decided by the tolerance rather than the samples: (σ/tolerance)² with the fit's weights
    /// of samples and tolerance, between 0 and 1; 0 without a tolerance.
    pub prior_share: SVector<T, 8>,
}

impl<T: Real> ArmOutcome<T> {
    /// From an estimate of this arm alone.
    #[inline(always)]
    pub(super) fn of(arm: Arm<T>, estimate: &Estimate<T, 8>) -> Self {
        let [condition, ..] = estimate.conditions;
        Self {
            arm,
            covariance: estimate.covariance,
            residual_rms: estimate.residual_rms,
            estimated_noise: estimate.estimated_noise,
            degrees_of_freedom: estimate.degrees_of_freedom,
            samples: estimate.samples,
            iterations: estimate.iterations,
            termination: estimate.termination,
            start: estimate.start,
            condition,
            prior_share: SVector::from(estimate.prior_share),
        }
    }

    /// σ of a parameter: length or radians. `None` if the covariance is `None`.
    pub fn standard_deviation(&self, parameter: Parameter) -> Option<T> {
        sigma(self.covariance.as_ref(), parameter.index())
    }
}

/// The root of a variance.
fn sigma<T: Real, const N: usize>(
    covariance: Option<&SMatrix<T, N, N>>,
    index: usize,
) -> Option<T> {
    Some(covariance?.get((index, index))?.square_root())
}

/// A calibrated robot.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotOutcome<T: Real> {
    /// The calibrated robot.
    pub robot: Robot<T>,
    /// Each arm's result.
    pub arms: [ArmOutcome<T>; 3],
}

/// A robot whose arms were calibrated jointly.
#[derive(Debug, Clone, PartialEq)]
pub struct JointOutcome<T: Real> {
    /// The calibrated robot.
    pub robot: Robot<T>,
    /// All 24 parameters, eight per arm, and their uncertainty. Residual and noise refer to each coordinate of the
    /// position, in the directions in which the noise propagates.
    pub estimate: Estimate<T, 24>,
}

impl<T: Real> From<&JointOutcome<T>> for RobotOutcome<T> {
    /// Splits the result by arm; correlations between arms are dropped.
    fn from(outcome: &JointOutcome<T>) -> Self {
        let [first, second, third] = ArmIndex::ALL;
        Self {
            robot: outcome.robot.clone(),
            arms: [outcome.arm(first), outcome.arm(second), outcome.arm(third)],
        }
    }
}

impl<T: Real> JointOutcome<T> {
    /// The result for one arm. Residual and noise are those of the robot; the degrees of freedom are the samples minus
    /// the arm's parameters.
    pub fn arm(&self, arm: ArmIndex) -> ArmOutcome<T> {
        let own = self.estimate.part(OF_ARM * arm.index());
        let mut determined = T::from_count(OF_ARM as u64);
        for share in own.prior_share {
            determined -= share;
        }
        let condition = own.conditions.get(arm.index());
        ArmOutcome {
            degrees_of_freedom: (own.effective_samples - determined).larger(T::ZERO),
            condition: condition.copied().unwrap_or(T::INFINITY),
            ..ArmOutcome::of(*self.robot.arm(arm), &own)
        }
    }

    /// σ of a parameter: length or radians. `None` if the covariance is `None`.
    pub fn standard_deviation(&self, arm: ArmIndex, parameter: Parameter) -> Option<T> {
        let index = OF_ARM * arm.index() + parameter.index();
        sigma(self.estimate.covariance.as_ref(), index)
    }
}
