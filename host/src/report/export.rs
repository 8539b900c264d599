//! The report of an export: the target's lines below a summary, and JSON.

use crate::export::Export;
use crate::export::geometry::Frame;
use crate::export::positions::Loss;
use crate::export::target::{Content, Entry};
use crate::render::terminal::wrapped;
use crate::text::small;
use serde::Serialize;
use std::fmt::Write;

/// Less than this fraction of the gain is little.
const LITTLE: f64 = 0.33;
/// Less than this fraction of the gain is only some.
const SOME: f64 = 0.6;
/// A loss below this is due to rounding, mm.
const NOTHING: f64 = 0.001;

/// The input files of an export.
#[derive(Debug, Clone, Copy)]
pub struct Files<'a> {
    /// The calibrated robot.
    pub robot: &'a str,
    /// The robot before its calibration, if a file states it.
    pub nominal: Option<&'a str>,
    /// The wanted positions, if a file states them.
    pub positions: Option<&'a str>,
}

/// The summary: gain and loss, rigid motion, conventions, warnings.
pub fn summary(export: &Export, files: &Files<'_>) -> String {
    let what = match (&export.target.content, &export.table) {
        (Content::Fitted { holds, .. }, _) => {
            format!("{} parameters and a frame fitted", holds.count())
        }
        (_, Some(table)) => format!("nodes {} mm apart", table.spacing),
        _ => "all 24 parameters".to_owned(),
    };
    let mut text = format!("{}: {what}, from {}\n\n", export.target.title, files.robot);
    losses(&mut text, export, files);
    let _ = writeln!(text, "\n{}", wrapped(&verdict(export), ""));
    let _ = writeln!(text, "{}", wrapped(&over(export, files), ""));
    if let Some(frame) = &export.frame {
        motion(&mut text, frame);
    }
    text.push_str("\nConventions\n");
    for convention in export.target.conventions {
        item(&mut text, convention);
    }
    item(&mut text, &format!("source: {}", export.target.source));
    if !export.written.warnings.is_empty() {
        text.push_str("\nWarnings\n");
    }
    for warning in &export.written.warnings {
        item(&mut text, warning);
    }
    text
}

fn item(text: &mut String, item: &str) {
    let _ = writeln!(text, "- {}", wrapped(item, "  "));
}

fn losses(text: &mut String, export: &Export, files: &Files<'_>) {
    let nominal = files.nominal.unwrap_or("the nearest symmetric robot");
    let mut rows = vec![
        (format!("not calibrated ({nominal})"), &export.uncalibrated),
        (
            "not calibrated, after its best rigid motion".to_owned(),
            &export.uncalibrated_moved,
        ),
        (format!("for {}", export.target.name), &export.loss),
    ];
    // For positions in one plane the table has no cells.
    if let Some(table) = &export.table
        && table.centres.positions > 0
    {
        let name = format!("- at the centres of {} cells", table.centres.positions);
        rows.push((name, &table.centres));
    }
    let width = rows.iter().map(|(name, _)| name.chars().count()).max();
    let width = width.unwrap_or(0);
    let _ = writeln!(
        text,
        "{:<width$}  {:>8}  {:>8}",
        "position error, mm", "rms", "worst"
    );
    for (name, loss) in rows {
        let _ = writeln!(
            text,
            "{name:<width$}  {:>8.4}  {:>8.4}",
            loss.rms, loss.worst
        );
    }
}

fn verdict(export: &Export) -> String {
    let (loss, alternative) = (&export.loss, export.target.alternative);
    let nothing = loss.worst < NOTHING;
    if nothing && matches!(export.target.content, Content::Everything) {
        return "No loss: the target holds all 24 parameters.".to_owned();
    }
    let lost = if nothing {
        format!("Loss: less than {NOTHING} mm.")
    } else {
        format!(
            "Loss: {} mm rms, {} mm worst, at x = {:.1}, y = {:.1}, z = {:.1} mm.",
            small(loss.rms),
            small(loss.worst),
            loss.at.x,
            loss.at.y,
            loss.at.z
        )
    };
    let Some(kept) = export.kept() else {
        return format!("{lost} The calibrated robot equals the nominal one: there was no gain.");
    };
    let percent = 100.0 * kept;
    if kept <= 0.0 {
        format!(
            "{lost} Do not use these values: they are no better than the robot before calibration, after its best rigid \
             motion. Use {alternative} instead."
        )
    } else if kept < LITTLE {
        format!(
            "{lost} Keeps only {percent:.0} % of the calibration's gain. Use {alternative} instead."
        )
    } else if kept < SOME {
        format!(
            "{lost} Keeps {percent:.0} % of the calibration's gain. To keep more, use {alternative}."
        )
    } else {
        format!("{lost} Keeps {percent:.0} % of the calibration's gain.")
    }
}

fn over(export: &Export, files: &Files<'_>) -> String {
    let loss = &export.loss;
    let place = match (files.positions, export.within) {
        (Some(name), _) => format!("of {name}"),
        (None, Some(within)) => {
            format!("spread over the workspace within {within} mm of the z axis")
        }
        (None, None) => "spread over the workspace".to_owned(),
    };
    let mut text = format!("Over {} positions {place}.", loss.positions);
    if files.nominal.is_none() {
        text.push_str(
            " The robot before calibration is assumed to be the symmetric one with the calibrated robot's mean lengths; give \
             another with --nominal.",
        );
    }
    if loss.unreached > 0 {
        let why = if export.table.is_some() {
            "their cells lack corrections"
        } else {
            "the target's kinematics does not reach them"
        };
        let _ = write!(text, " {} more are excluded: {why}.", loss.unreached);
    }
    text
}

fn motion(text: &mut String, frame: &Frame) {
    let shift = frame.shift;
    let turns = frame.turns.map(f64::to_degrees);
    let _ = write!(
        text,
        "\nFitted rigid motion from the calibrated robot's frame to the controller's\n  shift  x {:.4}  y {:.4}  z \
         {:.4} mm\n  turn   about x {:.4}  about y {:.4}  about z {:.4} degrees (R = Rz Ry Rx)\n",
        shift.x, shift.y, shift.z, turns.x, turns.y, turns.z
    );
    let _ = writeln!(
        text,
        "{}",
        wrapped(
            "A position p in the calibrated robot's frame is R p + shift for the controller. Apply this to your work \
             offset (shift), levelling (about x and y) and axes (about z), or measure the work frame again.",
            "",
        )
    );
}

/// The lines to paste, with the summary as their comment.
pub fn text(export: &Export, files: &Files<'_>) -> String {
    let comment = export.target.comment;
    let mut text = String::new();
    for line in summary(export, files).lines() {
        let line = line.replace(char::is_control, "?");
        let _ = writeln!(text, "{}", format!("{comment} {line}").trim_end());
    }
    let _ = writeln!(text, "{comment}");
    text + &export.written.lines
}

/// The JSON report.
#[derive(Debug, Serialize)]
pub struct Report<'a> {
    schema_version: u32,
    program_version: &'static str,
    target: &'static str,
    robot: &'a str,
    nominal: Option<&'a str>,
    fitted_parameters: Option<usize>,
    table: Option<TableReport<'a>>,
    parameters: &'a [Entry],
    frame: Option<Motion>,
    loss: Loss,
    not_calibrated: Loss,
    not_calibrated_after_rigid_motion: Loss,
    kept: Option<f64>,
    conventions: &'static [&'static str],
    source: &'static str,
    warnings: &'a [String],
    lines: &'a str,
}

#[derive(Debug, Serialize)]
struct Motion {
    shift_mm: [f64; 3],
    turn_deg: [f64; 3],
}

#[derive(Debug, Serialize)]
struct TableReport<'a> {
    unit: &'static str,
    origin_mm: [f64; 3],
    spacing_mm: f64,
    nodes_along_xyz: [usize; 3],
    fastest: &'static str,
    corrections: Vec<Option<[f64; 3]>>,
    extrapolated: &'a [usize],
    at_cell_centres: Loss,
}

impl<'a> Report<'a> {
    /// The report of an export.
    pub fn of(export: &'a Export, files: &Files<'a>) -> Self {
        Self {
            schema_version: 1,
            program_version: env!("CARGO_PKG_VERSION"),
            target: export.target.name,
            robot: files.robot,
            nominal: files.nominal,
            fitted_parameters: match &export.target.content {
                Content::Fitted { holds, .. } => Some(holds.count()),
                Content::Everything | Content::Corrections => None,
            },
            table: export.table.as_ref().map(|table| TableReport {
                unit: "mm",
                origin_mm: table.origin.into(),
                spacing_mm: table.spacing,
                nodes_along_xyz: table.counts,
                fastest: "z",
                corrections: table
                    .corrections
                    .iter()
                    .map(|own| own.map(Into::into))
                    .collect(),
                extrapolated: &table.extrapolated,
                at_cell_centres: table.centres,
            }),
            parameters: &export.written.entries,
            frame: export.frame.map(|frame| Motion {
                shift_mm: frame.shift.into(),
                turn_deg: frame.turns.map(f64::to_degrees).into(),
            }),
            loss: export.loss,
            not_calibrated: export.uncalibrated,
            not_calibrated_after_rigid_motion: export.uncalibrated_moved,
            kept: export.kept(),
            conventions: export.target.conventions,
            source: export.target.source,
            warnings: &export.written.warnings,
            lines: &export.written.lines,
        }
    }
}
