//! Results for people and programs.

pub mod calibration;
pub mod campaign;
pub mod export;
pub mod plan;
pub mod printer;
pub mod validation;
pub mod workspace;

pub use crate::files::document;
use document::Document;
use maud::{Markup, html};
use serde::Serialize;

/// The common header of all JSON reports.
#[derive(Debug, Serialize)]
pub(crate) struct Versioned<T> {
    schema_version: u32,
    program_version: &'static str,
    #[serde(flatten)]
    contents: T,
}

impl<T: Serialize> Versioned<T> {
    pub(crate) const fn new(schema_version: u32, contents: T) -> Self {
        Self {
            schema_version,
            program_version: env!("CARGO_PKG_VERSION"),
            contents,
        }
    }
}

/// A JSON report: indented, with a final newline.
pub fn json(report: &impl Serialize) -> String {
    let text = serde_json::to_string_pretty(report);
    // A struct of numbers and strings always serialises.
    text.unwrap_or_default() + "\n"
}

impl Document {
    /// The document's data for a page.
    fn page(&self) -> Markup {
        html! {
            dl.document {
                @for (name, value) in self.entries() { dt { (name) } dd { (value) } }
                @let files = [("Robot file", &self.robot), ("Samples file", &self.samples)].into_iter();
                @for (kind, source) in files.chain(self.beside.iter().map(|own| ("Second samples file", own))) {
                    dt { (kind) }
                    dd { (source.name) br; span.hash { "SHA-256 " (source.sha256) } }
                }
            }
        }
    }
}
