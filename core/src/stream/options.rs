//! Selection of samples, the fate of a sample, and refusals of a stream.

use super::gate::{Alarm, Verdict};
use crate::Real;
use crate::calibration::Refusal;
use crate::samples::Forgetting;
use crate::snapshot::Fingerprint;

/// Which samples are added, and the weight of older ones.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Selection<T> {
    /// All samples.
    All {
        /// If set, older samples lose weight.
        forgetting: Option<Forgetting<T>>,
    },
    /// Samples consistent with earlier ones. The gate tests each arm separately, with either estimator.
    Gated {
        /// If set, older samples lose weight.
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

    /// Everything that distinguishes this selection from others.
    pub(super) fn mark(&self, fingerprint: &mut Fingerprint) {
        fingerprint.count(match self {
            Selection::All { .. } => 0,
            Selection::Gated { .. } => 1,
        });
        fingerprint.optional(self.forgetting().map(|forgetting| [forgetting.mean_age()]));
    }
}

/// The fate of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Added<T> {
    /// Added without a test.
    Taken,
    /// The gate's verdict.
    Tested(Verdict<T>),
}

/// Why a stream of samples does not calibrate the robot. Keep its current parameters.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StreamRefusal {
    /// The calibration was refused.
    #[error(transparent)]
    Calibration(#[from] Refusal),
    /// The gate rejected a run of samples.
    #[error("{0}")]
    Alarm(Alarm),
    /// The gate rejected so many samples that it is unclear which are wrong.
    #[error(
        "the gate rejected {rejected} of {samples} samples: it is not known which of them are wrong"
    )]
    TooManyRejected {
        /// Number rejected.
        rejected: u64,
        /// Number received.
        samples: u64,
    },
}

impl StreamRefusal {
    /// A number that never changes, for a display or log; the same as the status code in C.
    pub const fn code(&self) -> u8 {
        match self {
            Self::Calibration(refusal) => refusal.code(),
            Self::Alarm(alarm) => alarm.code(),
            Self::TooManyRejected { .. } => 94,
        }
    }
}
