//! Results for people and programs.

pub mod calibration;
pub mod campaign;
pub mod export;
pub mod plan;
pub mod printer;
pub mod validation;
pub mod workspace;

use crate::accuracy::repeats::Repeatability;
pub use crate::files::document;
use crate::render::{Section, Table};
use crate::text::significant;
use document::Document;
use maud::{Markup, html};
use serde::Serialize;

/// Pose accuracy and repeatability of repeated poses, for pages and the terminal.
pub(crate) fn repeatability(found: &Repeatability) -> Section {
    let mm = |value: f64| significant(value, 2);
    let signed = |own: f64| format!("{:+.4}", own + 0.0);
    let approached = found.poses.iter().any(|own| own.approach.is_some());
    let table = Table::of(&found.poses)
        .column("pose", |own| own.name.clone())
        .column_if(approached, "approach", |own| {
            own.approach.clone().unwrap_or_default()
        })
        .column("repetitions", |own| own.count)
        .column("AP, mm", |own| mm(own.ap_mm))
        .vector(["x", "y", "z"], |own| own.ap_xyz_mm.map(signed))
        .column("RP, mm", |own| mm(own.rp_mm));
    let optional = |name: &'static str, value: Option<f64>| Some((name, mm(value?)));
    let facts = [
        Some((
            "Pose accuracy AP (VDI 2861: position deviation)",
            mm(found.ap_mm),
        )),
        Some((
            "Pose repeatability RP (VDI 2861: position scatter)",
            mm(found.rp_mm),
        )),
        optional(
            "Multi-directional pose accuracy variation vAP (VDI 2861: reversal error)",
            found.vap_mm,
        ),
        optional("Drift of pose accuracy dAP", found.drift_ap_mm),
        optional("Drift of pose repeatability dRP", found.drift_rp_mm),
    ];
    Section::new("Pose accuracy and repeatability (ISO 9283), mm")
        .table(Table::facts(facts.into_iter().flatten()))
        .table(table)
        .note(
            "Largest of all poses. Drift: from the first half of a pose's repetitions to the last. ISO 9283 asks for five poses \
             and 30 repetitions at rated load and speed.",
        )
}

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
