//! The per-arm calibrator: each arm by itself.

use super::Real;
use delta_cal::calibration::ArmOutcome;
use delta_cal::{ArmIndex, Calibrator, Progress, Refusal, RobotOutcome, RobotSolver};

macro_rules! family {
    ($name:literal) => {
        concat!("dcal_arms_", $name, suffix!())
    };
}
/// The calibrator with its solver.
pub type Own = crate::kind::Arms<Real>;
/// What it finds.
pub type Outcome = RobotOutcome<Real>;
type Samples = Calibrator<Real>;
type Solver = RobotSolver<Real>;

fn advance(solver: &mut Solver, samples: &Samples) -> Result<Progress, Refusal> {
    solver.step(samples)
}

fn found(solver: &Solver, _: &Samples) -> Result<Outcome, Refusal> {
    solver.outcome()
}

fn arm_of(outcome: &Outcome, arm: ArmIndex) -> ArmOutcome<Real> {
    outcome.arms[arm.index()]
}

#[path = "family.rs"]
mod family;
pub use family::*;
