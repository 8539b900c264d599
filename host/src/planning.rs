//! What to measure: the set of measurements after which positions are known best, for any mixture of heights,
//! distances and coordinates; and what the rows of a file determine.
//!
//! ```text
//! PlanRequest ─→ Setup ─→ Candidates ─→ Information of each (the core's) ─→ exchange ─→ Plan
//!                                                                             └→ Judge: expected error
//! ```
//!
//! There is one criterion: the variance of the platform's position over the workspace, after the best rigid motion
//! or absolute.

mod candidates;
mod clearance;
mod error;
mod exchange;
mod information;
mod instrument;
mod judge;
mod kind;
mod order;
mod plan;
mod region;
mod samples;
mod search;
mod selection;
mod setup;

pub use candidates::random_measurements;
pub use error::PlanError;
pub use instrument::{COUNTS, Comparison, Instrument, compare};
pub use judge::Precision;
pub use kind::{Kind, LEAST, MOST, Wish, Wishes};
pub use order::Order;
pub use plan::{Plan, PlanRequest, plan, plan_for};
pub use region::{Region, RegionError};
pub(crate) use samples::covariance_after;
pub use samples::{Determined, SamplesRequest};
pub use setup::{PLANE, PlaneAt, Planned, PointAt, Setup};
