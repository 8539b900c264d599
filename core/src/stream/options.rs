//! Selection of samples.

use crate::Real;
use crate::samples::Forgetting;
use crate::snapshot::Fingerprint;

/// Which samples are added, and the weight of older ones. By default all, and none loses weight.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Selection<T> {
    /// Only samples consistent with earlier ones. The gate tests each arm separately, with either estimator.
    pub gated: bool,
    /// If set, older samples lose weight.
    pub forgetting: Option<Forgetting<T>>,
}

impl<T: Real> Selection<T> {
    /// Everything that distinguishes this selection from others.
    pub(super) fn mark(&self, fingerprint: &mut Fingerprint) {
        fingerprint.count(u64::from(self.gated));
        fingerprint.optional(self.forgetting.map(|forgetting| [forgetting.mean_age()]));
    }
}
