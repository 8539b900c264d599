//! Results for people and for programs.

pub mod calibration;
pub mod campaign;
pub mod document;
pub mod export;
pub mod plan;
pub mod printer;
pub mod validation;
pub mod workspace;

use serde::Serialize;

/// A report for programs: indented, ending in a new line.
pub fn json(report: &impl Serialize) -> String {
    let text = serde_json::to_string_pretty(report);
    // A report is a struct of numbers and texts, which always can be written.
    text.unwrap_or_default() + "\n"
}
