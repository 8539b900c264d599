//! The joint calibrator: all 24 parameters together.

use super::Real;
use delta_cal::calibration::{ArmOutcome, JointCalibrator, JointOutcome, JointSolver};
use delta_cal::{ArmIndex, Progress, Refusal};

macro_rules! family {
    ($name:literal) => {
        concat!("dcal_joint_", $name, suffix!())
    };
}
/// The calibrator with its solver.
pub type Own = crate::kind::Joint<Real>;
/// What it finds.
pub type Outcome = JointOutcome<Real>;
type Samples = JointCalibrator<Real>;
type Solver = JointSolver<Real>;

#[allow(clippy::unnecessary_wraps)] // the per-arm solver refuses as it goes
fn advance(solver: &mut Solver, samples: &Samples) -> Result<Progress, Refusal> {
    Ok(solver.step(samples))
}

fn found(solver: &Solver, samples: &Samples) -> Result<Outcome, Refusal> {
    solver.outcome(samples)
}

fn arm_of(outcome: &Outcome, arm: ArmIndex) -> ArmOutcome<Real> {
    outcome.arm(arm)
}

#[path = "family.rs"]
mod family;
pub use family::*;
