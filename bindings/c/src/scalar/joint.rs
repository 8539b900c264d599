//! The joint calibrator: all 24 parameters at once.

use super::Real;
use crate::error::Error;
use delta_cal::calibration::{ArmOutcome, JointOutcome};
use delta_cal::{ArmIndex, Robot};

macro_rules! family {
    ($name:literal) => {
        concat!("dcal_joint_", $name, suffix!())
    };
}
/// The calibrator.
pub type Own = crate::kind::Joint<Real>;
/// What it finds.
pub type Outcome = JointOutcome<Real>;

fn found(own: &Own) -> Result<&Outcome, Error> {
    Ok(own.outcome()?)
}

fn robot_of(outcome: &Outcome) -> &Robot<Real> {
    &outcome.robot
}

fn arm_of(outcome: &Outcome, arm: ArmIndex) -> ArmOutcome<Real> {
    outcome.arm(arm)
}

#[path = "positions.rs"]
mod positions;
pub use positions::*;

#[path = "family.rs"]
mod family;
pub use family::*;

#[path = "stored.rs"]
mod stored;
pub use stored::*;

#[path = "outcomes.rs"]
mod outcomes;
pub use outcomes::*;
