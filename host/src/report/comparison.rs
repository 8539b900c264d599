//! A [`Comparison`] for the terminal and as JSON.

use super::Versioned;
use crate::render::{Section, Table, terminal};
use crate::text::{capitalised, count, significant};
use crate::validation::Comparison;

const SCHEMA_VERSION: u32 = 1;

/// For the terminal.
pub fn text(found: &Comparison) -> String {
    let mut sections = vec![Section::new("").text(format!(
        "{} compared with {} at {} over the workspace",
        found.to,
        found.from,
        count(found.poses, "pose")
    ))];
    let kinds = [
        ("absolute", "in the frame of the base", &found.absolute_mm),
        (
            "relative",
            "after the best rigid motion",
            &found.relative_mm,
        ),
    ];
    for (index, (kind, frame, moved)) in kinds.into_iter().enumerate() {
        let mm = |value: f64| significant(value, 2);
        let table = Table::of(["x", "y", "z", "distance"].into_iter().zip(moved))
            .column("change, mm", |(axis, _)| *axis)
            .vector(["mean", "rms", "worst"], |(_, own)| own.map(mm));
        let said = match (found.sigma_mm, found.changed) {
            (Some(sigma), Some(changed)) => format!(
                "{} than 2 σ of it ({} mm, from the expected errors of both files).",
                if changed[index] { "More" } else { "Not more" },
                mm(2.0 * sigma[index])
            ),
            _ => {
                "Its σ is unknown: only files that delta-cal calibrated state their expected error."
                    .to_owned()
            }
        };
        let title = format!("{}, {frame}", capitalised(kind));
        sections.push(Section::new(title).table(table).text(said));
    }
    terminal::text(sections)
}

/// For programs.
pub fn json(found: &Comparison) -> String {
    super::json(&Versioned::new(SCHEMA_VERSION, found))
}
