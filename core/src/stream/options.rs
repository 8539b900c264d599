//! How a stream of samples is calibrated, what becomes of a sample, and what comes out.

use super::forgetting::Forgetting;
use super::gate::{Alarm, Verdict};
use crate::Real;
use crate::calibration::{JointOutcome, Refusal, RobotOutcome};
use crate::robot::Robot;
use crate::samples::SampleError;
use crate::snapshot::Fingerprint;
use core::fmt;

/// How the parameters are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Estimator {
    /// Each arm by itself, with a [`Calibrator`](crate::Calibrator): a third of the work.
    #[default]
    Arms,
    /// All 24 parameters together, with a [`JointCalibrator`](crate::calibration::JointCalibrator): the least error that the
    /// measurements allow.
    Joint,
}

/// Which of the samples that come are taken in, and how much older samples count.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Selection<T> {
    /// All of them.
    All {
        /// If stated, older samples count less.
        forgetting: Option<Forgetting<T>>,
    },
    /// Those that agree with the samples before them; see [`Gate`](super::Gate). The gate tests each arm by itself,
    /// with either estimator.
    Gated {
        /// If stated, older samples count less.
        forgetting: Option<Forgetting<T>>,
    },
}

/// How a stream of samples is calibrated. The default: each arm by itself, from all samples.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StreamOptions<T> {
    /// How the parameters are estimated.
    pub estimator: Estimator,
    /// Which samples are taken in.
    pub selection: Selection<T>,
}

impl<T> Default for Selection<T> {
    fn default() -> Self {
        Self::All { forgetting: None }
    }
}

impl<T: Real> StreamOptions<T> {
    pub(super) const fn forgetting(&self) -> Option<Forgetting<T>> {
        let (Selection::All { forgetting } | Selection::Gated { forgetting }) = self.selection;
        forgetting
    }

    /// What distinguishes these options from others.
    pub(super) fn mark(&self, fingerprint: &mut Fingerprint) {
        fingerprint.byte(match self.estimator {
            Estimator::Arms => 0,
            Estimator::Joint => 1,
        });
        fingerprint.count(match self.selection {
            Selection::All { .. } => 0,
            Selection::Gated { .. } => 1,
        });
        fingerprint.optional(self.forgetting().map(|forgetting| [forgetting.mean_age()]));
    }
}

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
