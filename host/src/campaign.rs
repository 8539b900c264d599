//! Simulation campaigns: many random robots, calibrated in every way that a file asks for.
//!
//! ```text
//! campaign file ─→ Plan ─→ scenarios × robots ─→ robots.csv ─→ CaseSummary ─→ summary.csv
//!                             (in parallel)       (in order)
//! ```
//!
//! A robot's random numbers depend on the campaign's seed, its scenario's values and its own number,
//! on nothing else: the rows are the same to the bit for any number of threads, cut into shards or
//! not, interrupted or not. All methods, solvers, weights and priors of a scenario see the same robots
//! and the same measurements.

mod error;
mod file;
mod folder;
mod merge;
mod mixing;
mod plan;
mod planned;
mod quantiles;
mod readings;
mod row;
mod run;
mod simulation;
mod status;
mod summary;
mod trial;

pub use error::CampaignError;
pub use folder::{PARAMETERS, PLAN, ROBOTS, SUMMARY, TIMING};
pub use merge::merge;
pub use plan::{
    CampaignMethod, CampaignSolver, LengthAngle, Measure, NoiseLevel, Plan, Scenario, Shard,
    Spread, Variant,
};
pub use quantiles::Quantiles;
pub use row::CaseColumns;
pub use run::{RunOptions, run};
pub use simulation::HELD_OUT_POSES;
pub use summary::{CaseSummary, ParameterGain};

/// A small campaign with every key, and what it means.
pub const EXAMPLE: &str = include_str!("../examples/campaign.toml");
