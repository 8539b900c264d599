//! The per-arm calibrator: each arm by itself.

use super::Real;
use delta_cal::ArmIndex;
use delta_cal::RobotOutcome;
use delta_cal::calibration::{ArmOutcome, Estimator, Ikm};

macro_rules! family {
    ($name:literal) => {
        concat!("dcal_arms_", $name, suffix!())
    };
}
/// The calibrator.
pub type Own = crate::kind::Arms<Real>;
/// What it finds.
pub type Outcome = RobotOutcome<Real>;

fn arm_of(outcome: &Outcome, arm: ArmIndex) -> ArmOutcome<Real> {
    Ikm::arm(outcome, arm)
}

#[path = "family.rs"]
mod family;
pub use family::*;
