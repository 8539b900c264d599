//! Output of a calibration: terminal, HTML page, JSON, and the comment of the resulting robot file.

mod figures;
mod html;
mod text;

pub(super) use text::verdict;

use crate::calibration::refusal::CalibrateError;
pub use crate::calibration::report::*;
use crate::explain::Diagnosis;
use crate::files::Readings;
use maud::Markup;
use serde::Serialize;

impl Report {
    /// Text for a terminal.
    pub fn to_text(&self) -> String {
        text::render(self)
    }

    /// One HTML page that opens from disk.
    pub fn to_html(&self) -> String {
        html::render(self, None)
    }

    /// The page with `first` at the top.
    pub(super) fn to_html_below(&self, first: &Markup) -> String {
        html::render(self, Some(first))
    }

    /// JSON for programs.
    pub fn to_json(&self) -> String {
        crate::report::json(self)
    }
}

#[derive(Serialize)]
struct RefusalReport<'a> {
    schema_version: u32,
    refused: String,
    remedy: String,
    diagnosis: Option<&'a Diagnosis>,
}

impl CalibrateError {
    /// JSON for programs.
    pub fn to_json(&self) -> String {
        crate::report::json(&RefusalReport {
            schema_version: SCHEMA_VERSION,
            refused: self.to_string(),
            remedy: self.remedy().unwrap_or_default(),
            diagnosis: self.diagnosis(),
        })
    }
}

/// Comment of a calibrated robot file: the samples used and the result.
pub fn comment(report: &Report, readings: &Readings) -> String {
    let error = report.position_error_mm.map_or_else(String::new, |error| {
        format!(
            ", position error {:.4} mm rms before and {:.4} mm after",
            error.before.rms, error.after.rms
        )
    });
    let document = report
        .document
        .as_ref()
        .map_or_else(String::new, |own| format!("\n{}", own.comment()));
    let origin = report
        .origin
        .map_or_else(String::new, |own| format!("\n{own}"));
    format!(
        "Calibrated by delta-cal {} from {} and {}:\n{} samples{error}; {} method.{origin}{document}",
        env!("CARGO_PKG_VERSION"),
        report.robot_file,
        readings.name,
        report.sample_count,
        report.method.title(),
    )
}
