//! Errors that more than one kind of object has.

/// A solve is in progress: call `step` until it has finished. Until then samples, merges and snapshots are refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("the calibrator is solving: first call step until it has finished")]
pub struct Busy;

/// Why a number cannot be a setting: a noise, a tolerance, the mean age of samples, the width of a gate, a joint limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SettingError {
    /// The position noise must be greater than 0, and not too large to be squared.
    #[error("the position noise must be greater than 0, and not too large to be squared")]
    PositionNoise,
    /// The joint noise must be 0 or greater, and not too large to be squared.
    #[error("the joint noise must be 0 or greater, and not too large to be squared")]
    JointNoise,
    /// The noise of a height must be greater than 0, and not too small or large to be squared.
    #[error("the noise of a height must be greater than 0, and its square in range")]
    HeightNoise,
    /// The noise of a distance must be greater than 0, and not too small or large to be squared.
    #[error("the noise of a distance must be greater than 0, and its square in range")]
    DistanceNoise,
    /// The tolerance of lengths must be greater than 0, and not too small or large to be squared.
    #[error("the tolerance of lengths must be greater than 0, and its square in range")]
    LengthTolerance,
    /// The tolerance of angles must be greater than 0, and not too small or large to be squared.
    #[error("the tolerance of angles must be greater than 0, and its square in range")]
    AngleTolerance,
    /// The tolerance of the joint zeros must be greater than 0, and not too small or large to be squared.
    #[error("the tolerance of the joints' zeros must be greater than 0, and its square in range")]
    JointZeroTolerance,
    /// The tolerance of the carriage zeros must be greater than 0, and not too small or large to be squared.
    #[error("the tolerance of the carriages' zero must be greater than 0, and its square in range")]
    CarriageZeroTolerance,
    /// The tolerance of scales must be greater than 0, and not too small or large to be squared.
    #[error("the tolerance of scales must be greater than 0, and its square in range")]
    ScaleTolerance,
    /// The tolerance of the common tower radius must be a finite number, 0 or greater.
    #[error("the tolerance of the towers' common radius must be a finite number, 0 or greater")]
    RadiusTolerance,
    /// The tolerance of the common forearm length must be a finite number, 0 or greater.
    #[error("the tolerance of the forearms' common length must be a finite number, 0 or greater")]
    ForearmTolerance,
    /// The mean age of samples is NaN, or less than one sample.
    #[error("the mean age of the samples must be one sample or more")]
    AgeTooShort,
    /// λ would be known to less than a hundredth of 1 − λ: above 65,536 samples in single precision.
    #[error("the mean age is too large for this arithmetic: add the samples without forgetting")]
    AgeTooLong,
    /// The width of the gate must be a finite number of σ greater than 0.
    #[error("the gate must be a finite number of sigma greater than 0")]
    GateWidth,
    /// A joint limit is NaN or infinite.
    #[error("a joint limit is not a finite number")]
    JointLimitNonFinite,
    /// The smallest joint limit is not below the largest.
    #[error("the smallest joint limit must be below the largest")]
    JointLimitsEmpty,
    /// The joint limits are more than a full turn apart.
    #[error("the joint limits span more than one turn")]
    JointLimitsTooWide,
}
