//! Selection of samples.

use crate::Real;
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
