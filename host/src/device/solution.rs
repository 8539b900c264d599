//! What a controller found.

use super::number::Number;
use delta_cal::ArmIndex;
use delta_cal_protocol::{ArmReport, CovarianceBlock, Geometry, Places};

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
    /// The numbers of the robot.
    pub fn geometry(&self) -> Geometry<T> {
        let transmissions = self.arms.map(|arm| arm.transmission);
        let exact = transmissions.iter().all(Option::is_none);
        Geometry {
            arms: self.arms.map(|arm| arm.parameters),
            transmissions: (!exact).then(|| transmissions.map(|own| own.unwrap_or([T::ZERO; 5]))),
        }
    }

    /// What names it in [`Request::Apply`](delta_cal_protocol::Request::Apply).
    pub fn fingerprint(&self) -> u32 {
        self.geometry().fingerprint()
    }
}
