use crate::Real;
use crate::robot::{Arm, Parameter, Robot};
use nalgebra::{SMatrix, SVector};

/// Why the iteration stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Termination {
    /// No step could reduce the sum of squares by more than its rounding.
    GradientVanished,
    /// The last step, already of the size of rounding errors, no longer reduced it.
    RoundingReached,
}

/// Which start led to the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum StartUsed {
    /// The nominal robot.
    Nominal,
    /// The linear fit, without a guess.
    Free,
    /// Beside an earlier solution, along the combination that the samples determine least.
    Search,
    /// The IKM method's solution, from which another method starts.
    Ikm,
}

/// One calibrated arm and how far it can be trusted.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ArmOutcome<T: Real> {
    /// The calibrated arm.
    pub arm: Arm<T>,
    /// Covariance of the eight parameters, (JᵀJ)⁻¹ of the weighted Jacobian, prior included:
    /// length², length · radian, radian². Without a stated noise it is scaled by the residual
    /// variance and by ν/(ν − 2), ν the degrees of freedom: the variance of Student's t. `None` if
    /// fewer than three samples are left over to estimate that from.
    pub covariance: Option<SMatrix<T, 8, 8>>,
    /// √(Σ (f/σf)² / samples): in σ with a stated noise, otherwise the distance f/(2 Lb) along the
    /// forearm, in length.
    pub residual_rms: T,
    /// One σ of the distance error along the forearm: length. Estimated from the residuals; `None`
    /// with a stated noise, or if no sample is left over. Rough with few degrees of freedom.
    pub estimated_noise: Option<T>,
    /// Samples less parameters, as far as the samples and not the prior determine them.
    pub degrees_of_freedom: T,
    /// Samples taken in.
    pub samples: u64,
    /// Linearisations of all starts together.
    pub iterations: u16,
    /// Why the iteration stopped.
    pub termination: Termination,
    /// Where it had started.
    pub start: StartUsed,
    /// Condition number of the weighted Jacobian with columns scaled to unit length, prior
    /// included: ‖A‖‖A⁻¹‖/8 in Frobenius norms, 1 for orthogonal columns. The condition number in
    /// the 2-norm lies between this and eight times this.
    pub condition: T,
    /// For each parameter the share of the result that the tolerance decided and not the samples:
    /// (σ/tolerance)² as the samples and the tolerance were weighed in the fit, between 0 and 1; 0
    /// without a tolerance.
    pub prior_share: SVector<T, 8>,
}

impl<T: Real> ArmOutcome<T> {
    /// One σ of a parameter: length or radians. `None` where the covariance is.
    pub fn standard_deviation(&self, parameter: Parameter) -> Option<T> {
        let index = parameter.index();
        self.covariance
            .as_ref()
            .and_then(|covariance| covariance.get((index, index)))
            .map(|variance| variance.square_root())
    }
}

/// A calibrated robot.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RobotOutcome<T: Real> {
    /// The calibrated robot.
    pub robot: Robot<T>,
    /// Each arm's result.
    pub arms: [ArmOutcome<T>; 3],
}
