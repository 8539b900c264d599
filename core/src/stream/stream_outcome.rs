//! What becomes of a sample in a stream, and the outcome of the stream's calibration.

use super::gate::Verdict;
use crate::Real;
use crate::calibration::{JointOutcome, RobotOutcome};
use crate::robot::Robot;
use crate::samples::SampleError;
use core::fmt;

/// What became of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Added<T> {
    /// It was taken in; nothing tested it.
    Taken,
    /// The gate tested it, or could not.
    Tested(Verdict<T>),
}

impl<T: Real> Added<T> {
    /// The same in another scalar type.
    pub fn cast<U: Real>(&self) -> Added<U> {
        match self {
            Self::Taken => Added::Taken,
            Self::Tested(verdict) => Added::Tested(verdict.cast()),
        }
    }
}

/// Why a sample is not taken. Nothing has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AddError {
    /// It is impossible.
    Sample(SampleError),
    /// Something is being solved: first call [`StreamCalibrator::step`](super::StreamCalibrator::step) until it has finished.
    Busy,
}

impl fmt::Display for AddError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sample(error) => error.fmt(formatter),
            Self::Busy => {
                formatter.write_str("the calibrator is solving: samples wait until it has finished")
            }
        }
    }
}

impl core::error::Error for AddError {}

impl From<SampleError> for AddError {
    fn from(error: SampleError) -> Self {
        Self::Sample(error)
    }
}

/// A calibrated robot, by either estimator.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant)] // no allocation
pub enum StreamOutcome<T: Real> {
    /// Each arm by itself.
    Arms(RobotOutcome<T>),
    /// All 24 parameters together.
    Joint(JointOutcome<T>),
}

impl<T: Real> StreamOutcome<T> {
    /// The calibrated robot.
    pub const fn robot(&self) -> &Robot<T> {
        match self {
            Self::Arms(outcome) => &outcome.robot,
            Self::Joint(outcome) => &outcome.robot,
        }
    }
}
