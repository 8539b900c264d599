//! What is said beside the figures of a result: a sentence with its severity and figures.

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

pub(crate) fn warning(kind: &'static str, figures: Value, text: impl Into<String>) -> Finding {
    Finding {
        level: Level::Warning,
        text: text.into(),
        kind,
        figures,
    }
}

pub(crate) fn note(kind: &'static str, figures: Value, text: impl Into<String>) -> Finding {
    Finding {
        level: Level::Note,
        ..warning(kind, figures, text)
    }
}
