//! From readings to a good calibration, or to the reasons why there is none.
//!
//! ```text
//! RobotFile, Readings, Options ─→ fit::solve ─→ Solution ─→ judge ─→ Judged ─→ findings ─→ Report
//!                                                   └→ Objection ─→ refusal, with what explains it
//! and, whatever comes of it, diagnose ─→ Diagnosis
//! ```

mod calibrate;
pub mod credibility;
pub mod diagnosis;
mod findings;
pub(crate) mod judge;
pub mod known;
pub mod refusal;
pub mod report;
mod wrong_rows;

pub use calibrate::{calibrate, read_samples};
pub use refusal::{CalibrateError, Refused};
pub use report::Report;
use serde::Serialize;
use serde_json::Value;

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// The result may mislead.
    Warning,
    /// Worth knowing.
    Note,
}

/// A finding of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// `warning` or `note`.
    pub level: Level,
    /// The finding in words.
    pub text: String,
    /// Its kind: `copies`, `outlier`, `noise_understated` and so on.
    pub kind: &'static str,
    /// The kind's figures, by name.
    #[serde(flatten)]
    pub figures: Value,
}

fn warning(kind: &'static str, figures: Value, text: impl Into<String>) -> Finding {
    Finding {
        level: Level::Warning,
        text: text.into(),
        kind,
        figures,
    }
}

fn note(kind: &'static str, figures: Value, text: impl Into<String>) -> Finding {
    Finding {
        level: Level::Note,
        ..warning(kind, figures, text)
    }
}
