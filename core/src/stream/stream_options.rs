//! How a stream of samples is calibrated.

use super::forgetting::Forgetting;
use crate::Real;
use crate::snapshot::Fingerprint;

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
