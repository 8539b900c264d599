//! Which poses to measure: those that leave the parameters least uncertain for a stated noise and
//! tolerance.
//!
//! ```text
//! RobotFile ─→ candidates ─→ rows of each ─→ exchange ─→ travel ─→ PosePlan
//!                                                  └→ expectation, beside random poses
//! ```

mod accuracy;
mod assumptions;
mod candidates;
mod clearance;
mod error;
mod expectation;
mod next;
mod plan;
mod random;
mod region;
mod request;
mod search;
mod travel;

pub use crate::planning::design::Criterion;
pub use accuracy::{MANY, PosesNeeded, poses_needed};
pub use assumptions::Assumptions;
pub(super) use candidates::Selection;
pub use clearance::Margin;
pub use error::PlanError;
pub use expectation::{Expectation, RANDOM_SETS};
pub(super) use expectation::{determined, made_to_tolerance, unknown_parameter};
pub use next::{NextPoses, next_poses};
pub use plan::{PosePlan, expected, plan, poses};
pub use region::{Region, RegionError};
pub use request::{LEAST_POSES, MOST_POSES, PlanRequest};
pub(super) use travel::ordered_by;
pub use travel::{distance, length, ordered};
