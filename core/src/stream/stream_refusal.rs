//! Why a stream does not calibrate the robot.

use super::gate::Alarm;
use crate::calibration::Refusal;
use core::fmt;

/// Why a stream of samples does not calibrate the robot. The robot keeps its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum StreamRefusal {
    /// The calibration itself is refused.
    Calibration(Refusal),
    /// The gate rejected a run of samples.
    Alarm(Alarm),
    /// The gate rejected so many of all samples that it is not known which are wrong.
    TooManyRejected {
        /// This many were rejected.
        rejected: u64,
        /// This many came.
        samples: u64,
    },
}

impl fmt::Display for StreamRefusal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Calibration(refusal) => refusal.fmt(formatter),
            Self::Alarm(alarm) => alarm.fmt(formatter),
            Self::TooManyRejected { rejected, samples } => write!(
                formatter,
                "the gate rejected {rejected} of {samples} samples: it is not known which of them are wrong"
            ),
        }
    }
}

impl core::error::Error for StreamRefusal {}

impl From<Refusal> for StreamRefusal {
    fn from(refusal: Refusal) -> Self {
        Self::Calibration(refusal)
    }
}
