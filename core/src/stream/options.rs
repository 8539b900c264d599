//! Which samples of a stream count, what becomes of a sample, and why there is no result.

use super::gate::{Alarm, Verdict};
use crate::Real;
use crate::calibration::Refusal;
use crate::samples::Forgetting;
use crate::snapshot::Fingerprint;
use core::fmt;

/// Which of the samples that come are taken in, and how much older samples count.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Selection<T> {
    /// All of them.
    All {
        /// If stated, older samples count less.
        forgetting: Option<Forgetting<T>>,
    },
    /// Those that agree with the samples before them. The gate tests each arm by itself, with either estimator.
    Gated {
        /// If stated, older samples count less.
        forgetting: Option<Forgetting<T>>,
    },
}

impl<T> Default for Selection<T> {
    fn default() -> Self {
        Self::All { forgetting: None }
    }
}

impl<T: Real> Selection<T> {
    pub(super) const fn forgetting(&self) -> Option<Forgetting<T>> {
        let (Selection::All { forgetting } | Selection::Gated { forgetting }) = *self;
        forgetting
    }

    /// What distinguishes this selection from others.
    pub(super) fn mark(&self, fingerprint: &mut Fingerprint) {
        fingerprint.count(match self {
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
