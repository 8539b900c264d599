use crate::robot::ArmIndex;
use core::fmt;

/// Which way a pose is singular.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Singularity {
    /// Type 1: upper arm and forearm are in line (in the arm plane); the joint cannot move the
    /// platform along the forearm. The edge of the workspace.
    Serial,
    /// Type 2: ∂f/∂X is singular, the forearms' directions lie in one plane; the joints do not
    /// hold the platform.
    Parallel,
}

/// Why a pose has no position, or a position no joint angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum KinematicsError {
    /// The forearms do not meet (forward; the named arm is the one that falls short most), or the
    /// arm does not reach the point (inverse).
    Unreachable(ArmIndex),
    /// The pose exists and is singular at the named arm. For [`Singularity::Parallel`] it is the
    /// arm whose forearm lies nearest to the plane of the other two.
    Singular(ArmIndex, Singularity),
    /// A joint angle or coordinate of this arm is NaN, infinite, or beyond the sine's range.
    NonFinite(ArmIndex),
}

impl KinematicsError {
    /// The arm at fault.
    pub const fn arm(&self) -> ArmIndex {
        match self {
            Self::Unreachable(arm) | Self::Singular(arm, _) | Self::NonFinite(arm) => *arm,
        }
    }
}

impl fmt::Display for KinematicsError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreachable(arm) => write!(formatter, "unreachable for {arm}"),
            Self::Singular(arm, Singularity::Serial) => write!(
                formatter,
                "singular (type 1): upper arm and forearm of {arm} are in line"
            ),
            Self::Singular(arm, Singularity::Parallel) => write!(
                formatter,
                "singular (type 2): the forearm of {arm} lies in the plane of the other two"
            ),
            Self::NonFinite(arm) => write!(formatter, "a number of {arm} is not finite"),
        }
    }
}

impl core::error::Error for KinematicsError {}
