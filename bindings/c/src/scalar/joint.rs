//! The joint calibrator: all 24 parameters together.

use super::Real;
use delta_cal::ArmIndex;
use delta_cal::calibration::{ArmOutcome, Estimator, Joint, JointOutcome};

macro_rules! family {
    ($name:literal) => {
        concat!("dcal_joint_", $name, suffix!())
    };
}
/// The calibrator.
pub type Own = crate::kind::Joint<Real>;
/// What it finds.
pub type Outcome = JointOutcome<Real>;

fn arm_of(outcome: &Outcome, arm: ArmIndex) -> ArmOutcome<Real> {
    Joint::arm(outcome, arm)
}

#[path = "family.rs"]
mod family;
pub use family::*;
