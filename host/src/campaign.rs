//! Simulation campaigns: many random robots, calibrated in every combination of settings in a file.
//!
//! ```text
//! campaign file ─→ Plan ─→ cases × robots ─→ rows ─→ CaseSummary
//! ```

mod evaluation;
pub mod paper;
mod plan;
mod row;
mod simulated;
mod summary;
mod trial;

pub use plan::{CampaignSolver, Case, OneCase, Plan, Spread};
pub use row::{RobotResult, Row, read_rows, rows_csv, run};
pub use simulated::HELD_OUT_POSES;
pub use summary::{CaseSummary, Distribution, Ratios, join, summarize};

/// An example campaign file with every key explained.
pub const EXAMPLE: &str = include_str!("../examples/campaign.toml");
