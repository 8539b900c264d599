//! What a controller found.

use super::number::Number;
use delta_cal::ArmIndex;
use delta_cal_protocol::{ArmReport, CovarianceBlock, Places, fingerprint};

/// What a controller found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution<T> {
    /// Each arm.
    pub arms: [ArmReport<T>; 3],
    /// Of a joint calibration, the covariance of the first arm with the second, of the first with the third and of the
    /// second with the third.
    pub across: Option<[CovarianceBlock<T>; 3]>,
    /// Of a calibration from observations, where the instruments are.
    pub places: Option<Places<T>>,
}

/// The pairs of arms whose covariance a [`Solution`] holds: rows and columns.
pub(super) const ACROSS: [(ArmIndex, ArmIndex); 3] = [
    (ArmIndex::First, ArmIndex::Second),
    (ArmIndex::First, ArmIndex::Third),
    (ArmIndex::Second, ArmIndex::Third),
];

impl<T: Number> Solution<T> {
    /// The parameters of the three arms.
    pub fn parameters(&self) -> [[T; 8]; 3] {
        self.arms.map(|arm| arm.parameters)
    }

    /// What names it in [`Request::Apply`](delta_cal_protocol::Request::Apply).
    pub fn fingerprint(&self) -> u32 {
        fingerprint(&self.parameters())
    }
}
