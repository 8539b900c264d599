//! A printer's assessment, in ten lines and the lines to paste, and for programs.

use crate::printer::area::Off;
use crate::printer::assess::{Assessment, lack_of_fit, worst};
use crate::render::json::report;
use crate::render::terminal::wrapped;
use crate::report::export::{self, Files};
use crate::text::words::{count, list};
use serde_json::{Value, json};
use std::fmt::Write;

const SCHEMA_VERSION: u32 = 1;
/// A change below this is none, as a part of what remains uncertain.
const WORTH: f64 = 0.1;

/// For people: ten statements at most, and what to paste.
pub fn text(assessment: &Assessment) -> String {
    let mut text = String::new();
    for (number, statement) in (1..).zip(lines(assessment)) {
        let _ = writeln!(text, "{number:>2}. {}", wrapped(&statement, "    "));
    }
    text.push('\n');
    text.push_str(&to_paste(assessment));
    for note in &assessment.imported.notes {
        let _ = write!(text, "\n{}\n", wrapped(note, ""));
    }
    text
}

/// The lines for the configuration, with what to do with those that it holds.
pub fn to_paste(assessment: &Assessment) -> String {
    format!(
        "# Delete the same options from the block that SAVE_CONFIG wrote at the end of printer.cfg.\n{}",
        assessment.export.written.lines
    )
}

/// Ten at most.
pub fn lines(assessment: &Assessment) -> Vec<String> {
    let report = &assessment.report;
    let mut lines = vec![measured(assessment)];
    lines.extend(assessment.before.as_ref().map(|off| wrong(assessment, off)));
    lines.extend(changes(assessment));
    lines.push(fit(assessment));
    lines.push(known(assessment));
    lines.extend(sure(assessment));
    if !report.determined.scale {
        let more = if assessment.imported.saved.distances.is_empty() {
            "that takes distances"
        } else {
            "the saved distances are too inexact or too few to show it"
        };
        lines.push(format!(
            "The size of printed parts is known no better than the tolerance says: {more}."
        ));
    }
    lines.extend(next(assessment));
    lines.push(paste(assessment));
    lines.truncate(10);
    lines
}

fn measured(assessment: &Assessment) -> String {
    let saved = &assessment.imported.saved;
    let kinds: Vec<_> = [
        (saved.heights.len(), "height"),
        (saved.distances.len(), "distance"),
    ]
    .into_iter()
    .filter(|(number, _)| *number > 0)
    .map(|(number, kind)| count(number, kind))
    .collect();
    let kind = if assessment.has_towers() {
        "a Delta with towers"
    } else {
        "a Delta whose motors turn its arms"
    };
    let notes = if assessment.imported.notes.is_empty() {
        ""
    } else {
        " (see the note below)"
    };
    format!(
        "{}: {kind}; {}{notes}.",
        assessment.imported.source,
        list(&kinds)
    )
}

/// What its configuration is off.
fn wrong(assessment: &Assessment, off: &Off) -> String {
    // Nothing is said of a size that was not measured.
    let size = if assessment.report.determined.scale {
        format!(", and 100 mm come out as {:.2} mm", off.hundred)
    } else {
        String::new()
    };
    format!(
        "Wrong now: over {:.0} mm around the centre the nozzle is {:.2} mm rms ({:.2} at most) off the height that \
         Klipper believes{size}.",
        assessment.area.radius, off.height, off.worst_height
    )
}

/// The three largest changes of what Klipper is told.
fn changes(assessment: &Assessment) -> Option<String> {
    let mut changes: Vec<_> = assessment
        .changes()
        .into_iter()
        .filter(|(_, before, after, _)| (after - before).abs() >= 0.01)
        .collect();
    changes.sort_by(|one, other| {
        let size = |own: &(String, f64, f64, &str)| (own.2 - own.1).abs();
        size(other).total_cmp(&size(one))
    });
    let largest: Vec<_> = changes
        .into_iter()
        .take(3)
        .map(|(name, before, after, unit)| format!("{name} {:+.2} {unit}", after - before))
        .collect();
    (!largest.is_empty()).then(|| format!("The largest changes: {}.", list(&largest)))
}

fn fit(assessment: &Assessment) -> String {
    let report = &assessment.report;
    if report.sigma_widened_by > 1.0 {
        let worst = worst(report).and_then(|index| assessment.imported.saved.names.get(index));
        return format!(
            "Doubtful: the measurements are {:.1} times further off than noise and tolerance allow, {} most of all; \
             every uncertainty is widened by that.",
            lack_of_fit(report),
            worst.map_or("one", String::as_str)
        );
    }
    format!(
        "The measurements fit: {:.2} times what noise and tolerance allow, where 1 is usual.",
        lack_of_fit(report)
    )
}

/// What they determine at most, and what they do.
fn known(assessment: &Assessment) -> String {
    let parameters = if assessment.has_towers() { 21 } else { 24 };
    let readings = assessment.readings();
    format!(
        "{readings} measurements determine at most {} combinations of the {parameters} parameters, here {} better \
         than the tolerance; all others come from the tolerance.",
        readings.min(parameters),
        assessment.report.determined.combinations
    )
}

fn sure(assessment: &Assessment) -> Option<String> {
    let next = assessment.next.as_ref()?;
    let before = assessment.sigma_before.map_or_else(String::new, |before| {
        format!("; by the tolerance alone {before:.2}")
    });
    Some(format!(
        "How sure: positions are expected to be off by {:.2} mm rms (one sigma) after this calibration{before}.",
        assessment.report.sigma_widened_by * next.now
    ))
}

/// What to measure next.
fn next(assessment: &Assessment) -> Vec<String> {
    let Some(next) = &assessment.next else {
        return Vec::new();
    };
    let widening = assessment.report.sigma_widened_by;
    let mut lines = Vec::new();
    let worthwhile = |error: &f64| *error < (1.0 - WORTH) * next.now;
    let mut options = Vec::new();
    if let Some(error) = next.with_object.filter(worthwhile) {
        let again = if assessment.imported.saved.distances.is_empty() {
            ""
        } else {
            " once more"
        };
        options.push((
            error,
            format!(
                "print Klipper's docs/prints/calibrate_size.stl{again}, measure its twelve distances \
                 (DELTA_ANALYZE): leaves {:.2} mm",
                widening * error
            ),
        ));
    }
    if let Some(error) = next.with_heights.filter(worthwhile) {
        let places: Vec<_> = next
            .heights
            .iter()
            .map(|[x, y]| format!("({}, {})", x.round() + 0.0, y.round() + 0.0))
            .collect();
        options.push((
            error,
            format!(
                "nozzle on a sheet of paper at x, y = {} (DELTA_ANALYZE MANUAL_HEIGHT=0.1 at each): leaves {:.2} mm",
                places.join(" "),
                widening * error
            ),
        ));
    }
    options.sort_by(|one, other| one.0.total_cmp(&other.0));
    for (words, (_, option)) in ["Measure next", "Or"].into_iter().zip(options) {
        lines.push(format!("{words}: {option}."));
    }
    if lines.is_empty() {
        lines.push(
            if assessment.report.determined.scale {
                "Measure next: nothing; heights and distances bring little more."
            } else {
                "Measure next: more heights and printed distances bring little; the size takes longer distances, \
                 measured more exactly."
            }
            .to_owned(),
        );
    }
    lines
}

fn paste(assessment: &Assessment) -> String {
    let loss = &assessment.export.loss;
    let before = &assessment.export.uncalibrated;
    let after = assessment.after.as_ref().map_or_else(String::new, |off| {
        format!(
            "; heights over the bed are then {:.2} mm rms off",
            off.height
        )
    });
    format!(
        "Paste these lines, and delete the same options from the block of SAVE_CONFIG. Klipper cannot hold all: they lose {:.2} mm rms ({:.2} at most), where not calibrating loses \
         {:.2} ({:.2}){after}.",
        loss.rms, loss.worst, before.rms, before.worst
    )
}

/// For programs.
pub fn json(assessment: &Assessment) -> Value {
    let off = |off: &Option<Off>| {
        off.as_ref().map(|off| {
            json!({
                "height_rms_mm": off.height,
                "height_worst_mm": off.worst_height,
                "hundred_mm_become_mm": off.hundred,
            })
        })
    };
    let changes: Vec<_> = assessment
        .changes()
        .into_iter()
        .map(|(name, before, after, unit)| {
            json!({"name": name, "before": before, "after": after, "unit": unit})
        })
        .collect();
    let next = assessment.next.as_ref().map(|next| {
        json!({
            "sigma_now_mm": next.now,
            "heights_at_mm": next.heights,
            "sigma_with_heights_mm": next.with_heights,
            "sigma_with_printed_object_mm": next.with_object,
        })
    });
    let own = &assessment.report;
    let files = Files {
        robot: &assessment.imported.source,
        nominal: Some(&assessment.imported.source),
        positions: None,
    };
    report(
        SCHEMA_VERSION,
        json!({
            "configuration": assessment.imported.source,
            "kinematics": if assessment.has_towers() { "delta" } else { "rotary_delta" },
            "notes": assessment.imported.notes,
            "heights": assessment.imported.saved.heights.len(),
            "distances": assessment.imported.saved.distances.len(),
            "bed_radius_mm": assessment.area.radius,
            "lack_of_fit": lack_of_fit(own),
            "sigma_widened_by": own.sigma_widened_by,
            "combinations_known": own.determined.combinations,
            "combinations_at_most": assessment.readings().min(if assessment.has_towers() { 21 } else { 24 }),
            "scale_known": own.determined.scale,
            "before": off(&assessment.before),
            "after": off(&assessment.after),
            "changes": changes,
            // One sigma, rms over the printed area, after the best rigid motion; not widened.
            "sigma_before_mm": assessment.sigma_before,
            "next": next,
            "warnings": own.warnings,
            "export": export::Report::of(&assessment.export, &files),
            "lines": lines(assessment),
        }),
    )
}
