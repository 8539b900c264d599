//! Simulation campaigns: many random robots, calibrated in every way that a file asks for.
//!
//! ```text
//! campaign file ─→ Plan ─→ cases × robots ─→ rows ─→ CaseSummary
//! ```

mod file;
pub mod paper;
mod plan;
mod row;
mod simulated;
mod summary;
mod trial;

pub use plan::{CampaignSolver, Case, Plan, Spread};
pub use row::{RobotResult, Row, read_rows, rows_csv, run};
pub use simulated::HELD_OUT_POSES;
pub use summary::{CaseSummary, Distribution, Ratios, join, summarize};

/// A small campaign with every key, and what it means.
pub const EXAMPLE: &str = include_str!("../examples/campaign.toml");
