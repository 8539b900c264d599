//! A printer's assessment: some ten lines and the lines to paste, and for programs.

use super::export::{self, Files};
use crate::printer::{Assessment, Change, Next, Off};
use crate::render::terminal::wrapped;
use crate::text::{count, list};
use delta_cal::robot::Drive;
use serde::Serialize;
use std::fmt::Write;

/// Measurements that make the expected error smaller by less than this part are not proposed.
const WORTH: f64 = 0.1;
/// A change below this is none, mm or degrees.
const CHANGED: f64 = 0.01;

/// For people: numbered statements, and what to paste.
pub fn text(assessment: &Assessment<'_>) -> String {
    let mut text = String::new();
    for (number, statement) in (1..).zip(lines(assessment)) {
        let _ = writeln!(text, "{number:>2}. {}", wrapped(&statement, "    "));
    }
    text.push('\n');
    text.push_str(&to_paste(assessment));
    for note in &assessment.printer.notes {
        let _ = write!(text, "\n{}\n", wrapped(note, ""));
    }
    text
}

/// The lines for the configuration, with what to do with those that it holds.
pub fn to_paste(assessment: &Assessment<'_>) -> String {
    let comment = assessment.export.target.comment;
    let firmware = assessment.printer.firmware.title();
    format!(
        "{comment} In place of the same parameters of {firmware}, also of those that it saved itself.\n{}",
        assessment.export.written.lines
    )
}

fn drive(assessment: &Assessment<'_>) -> Drive {
    assessment.printer.robot.robot.drive()
}

fn parameters(assessment: &Assessment<'_>) -> usize {
    match drive(assessment) {
        Drive::Linear => 21,
        Drive::Rotary => 24,
    }
}

fn lines(assessment: &Assessment<'_>) -> Vec<String> {
    let calibration = assessment.calibration;
    let mut lines = vec![measured(assessment)];
    if let Some(off) = &assessment.before {
        // Nothing is said of a size that was not measured.
        let size = if calibration.determined.scale {
            format!("; 100 mm come out as {:.2} mm", off.hundred)
        } else {
            String::new()
        };
        lines.push(format!(
            "Bed error now: {:.2} mm rms ({:.2} mm worst) within {:.0} mm of the centre{size}.",
            off.height, off.worst_height, assessment.area.radius
        ));
    }
    lines.extend(changes(&assessment.changes));
    lines.push(fit(assessment));
    lines.push(format!(
        "The {} readings improve {} of {} parameter combinations; the rest stay at the tolerance.",
        assessment.printer.readings.readings(),
        calibration.determined.combinations,
        parameters(assessment)
    ));
    if let Some(next) = &assessment.next {
        let before = assessment.sigma_before.map_or_else(String::new, |before| {
            format!(", {before:.2} mm by the tolerance alone")
        });
        lines.push(format!(
            "Expected position error: {:.2} mm rms over the printed area (σ){before}.",
            next.now
        ));
    }
    if !calibration.determined.scale {
        lines
            .push("The size of parts stays at the tolerance: it takes exact distances.".to_owned());
    }
    if let Some(next) = &assessment.next {
        lines.extend(proposals(assessment, next));
    }
    lines.push(paste(assessment));
    lines
}

fn measured(assessment: &Assessment<'_>) -> String {
    let [heights, distances] = assessment.printer.counts();
    let kinds = [(heights, "height"), (distances, "distance")];
    let kinds = kinds.into_iter().filter(|(number, _)| *number > 0);
    let kinds: Vec<_> = kinds.map(|(number, kind)| count(number, kind)).collect();
    let kind = match drive(assessment) {
        Drive::Linear => "Delta with towers",
        Drive::Rotary => "Delta with rotary arms",
    };
    let notes = if assessment.printer.notes.is_empty() {
        ""
    } else {
        " (see the note below)"
    };
    let name = &assessment.printer.robot.name;
    format!("{name}: {kind}, {}{notes}.", list(&kinds))
}

/// The three largest changes of what the controller is told.
fn changes(changes: &[Change]) -> Option<String> {
    let size = |change: &Change| (change.after - change.before).abs();
    let mut changes: Vec<_> = changes.iter().filter(|own| size(own) >= CHANGED).collect();
    changes.sort_by(|one, other| size(other).total_cmp(&size(one)));
    changes.truncate(3);
    let largest = changes.iter().map(
        |Change {
             name,
             before,
             after,
             unit,
         }| { format!("{name} {:+.2} {unit}", after - before) },
    );
    let largest: Vec<_> = largest.collect();
    (!largest.is_empty()).then(|| format!("Largest changes: {}.", list(&largest)))
}

fn fit(assessment: &Assessment<'_>) -> String {
    let calibration = assessment.calibration;
    let residuals = assessment.lack_of_fit();
    if calibration.sigma_widened_by > 1.0 {
        let worst = assessment.worst();
        let worst = worst.map_or_else(String::new, |name| format!(", {name} most of all"));
        return format!(
            "Warning: residuals are {residuals:.1} × the expected{worst}. All σ are scaled accordingly."
        );
    }
    format!("Residuals are {residuals:.2} × the expected.")
}

/// What to measure next, the better proposal first.
fn proposals(assessment: &Assessment<'_>, next: &Next) -> Vec<String> {
    let worthwhile = |error: &f64| *error < (1.0 - WORTH) * next.now;
    let mut proposals = Vec::new();
    if let Some(error) = next.with_object.filter(worthwhile) {
        let proposal = "print Klipper's docs/prints/calibrate_size.stl and measure its twelve distances (DELTA_ANALYZE)";
        proposals.push((error, proposal.to_owned()));
    }
    if let Some(error) = next.with_heights.filter(worthwhile) {
        let places = next.heights.iter();
        let places: Vec<_> = places
            .map(|[x, y]| format!("({}, {})", x.round() + 0.0, y.round() + 0.0))
            .collect();
        let proposal = format!(
            "nozzle on a sheet of paper at x, y = {} (DELTA_ANALYZE MANUAL_HEIGHT=0.1 at each)",
            places.join(" ")
        );
        proposals.push((error, proposal));
    }
    proposals.sort_by(|one, other| one.0.total_cmp(&other.0));
    if proposals.is_empty() {
        let nothing = if assessment.calibration.determined.scale {
            "Measure next: nothing; heights and printed distances bring little more."
        } else {
            "Measure next: longer distances, more exactly; heights and printed distances bring little more."
        };
        return vec![nothing.to_owned()];
    }
    let proposals = ["Measure next", "Or"].into_iter().zip(proposals);
    proposals
        .map(|(words, (error, proposal))| format!("{words}: {proposal}; leaves {error:.2} mm."))
        .collect()
}

fn paste(assessment: &Assessment<'_>) -> String {
    let (loss, before) = (&assessment.export.loss, &assessment.export.uncalibrated);
    let after = assessment.after.as_ref().map_or_else(String::new, |off| {
        format!(" Bed error then: {:.2} mm rms.", off.height)
    });
    format!(
        "Paste the lines below. {} cannot hold everything: they lose {:.2} mm rms ({:.2} mm worst); not calibrating \
         loses {:.2} mm ({:.2} mm).{after}",
        assessment.printer.firmware.title(),
        loss.rms,
        loss.worst,
        before.rms,
        before.worst
    )
}

/// For programs. Every σ is scaled by `sigma_widened_by`, if the residuals are improbably large.
#[derive(Debug, Serialize)]
pub struct Report<'a> {
    schema_version: u32,
    program_version: &'static str,
    configuration: &'a str,
    kinematics: &'static str,
    notes: &'a [String],
    heights: usize,
    distances: usize,
    bed_radius_mm: f64,
    lack_of_fit: f64,
    sigma_widened_by: f64,
    combinations_known: usize,
    combinations_at_most: usize,
    scale_known: bool,
    before: Option<Off>,
    after: Option<Off>,
    changes: &'a [Change],
    sigma_before_mm: Option<f64>,
    next: Option<&'a Next>,
    warnings: &'a [String],
    export: export::Report<'a>,
    lines: Vec<String>,
}

impl<'a> Report<'a> {
    /// Of an assessment.
    pub fn of(assessment: &'a Assessment<'_>) -> Self {
        let printer = assessment.printer;
        let calibration = assessment.calibration;
        let name = printer.robot.name.as_str();
        let files = Files {
            robot: name,
            nominal: Some(name),
            positions: None,
        };
        let [heights, distances] = printer.counts();
        Self {
            schema_version: 1,
            program_version: env!("CARGO_PKG_VERSION"),
            configuration: name,
            kinematics: match drive(assessment) {
                Drive::Linear => "delta",
                Drive::Rotary => "rotary_delta",
            },
            notes: &printer.notes,
            heights,
            distances,
            bed_radius_mm: assessment.area.radius,
            lack_of_fit: assessment.lack_of_fit(),
            sigma_widened_by: calibration.sigma_widened_by,
            combinations_known: calibration.determined.combinations,
            combinations_at_most: printer.readings.readings().min(parameters(assessment)),
            scale_known: calibration.determined.scale,
            before: assessment.before,
            after: assessment.after,
            changes: &assessment.changes,
            sigma_before_mm: assessment.sigma_before,
            next: assessment.next.as_ref(),
            warnings: &calibration.warnings,
            export: export::Report::of(&assessment.export, &files),
            lines: lines(assessment),
        }
    }
}
