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
mod error;
mod exchange;
mod expectation;
mod next;
mod plan;
mod random;
mod region;
mod request;
mod rows;
mod search;
mod travel;

pub use accuracy::{MANY, PosesNeeded, poses_needed};
pub use assumptions::Assumptions;
pub use candidates::Margin;
pub use error::PlanError;
pub use expectation::{Expectation, RANDOM_SETS};
pub use next::{NextPoses, next_poses};
pub use plan::{PosePlan, expected, plan};
pub use region::{Region, RegionError};
pub use request::{Criterion, LEAST_POSES, MOST_POSES, PlanRequest};
pub use travel::{distance, length, ordered};
