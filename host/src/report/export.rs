//! The report of an export: the target's lines below a summary, and JSON.

use super::Versioned;
use crate::export::Export;
use crate::export::geometry::Frame;
use crate::export::positions::Place;
use crate::export::target::Content;
use crate::render::terminal::wrapped;
use crate::text::small;
use std::fmt::Write;

/// Less than this fraction of the gain is little.
const LITTLE: f64 = 0.33;
/// Less than this fraction of the gain is only some.
const SOME: f64 = 0.6;
/// A loss below this is due to rounding, mm.
const NOTHING: f64 = 0.001;

impl Export {
    /// The summary: gain and loss, rigid motion, conventions, warnings.
    pub fn summary(&self) -> String {
        let what = match (self.fitted_parameters, &self.table) {
            (Some(count), _) => format!("{count} parameters and a frame fitted"),
            (None, Some(table)) => format!("nodes {} mm apart", table.spacing),
            (None, None) => "all 24 parameters".to_owned(),
        };
        let mut text = format!("{}: {what}, from {}\n\n", self.target.title, self.robot);
        losses(&mut text, self);
        let _ = writeln!(text, "\n{}", wrapped(&verdict(self), ""));
        let _ = writeln!(text, "{}", wrapped(&over(self), ""));
        if let Some(frame) = &self.frame {
            motion(&mut text, frame);
        }
        text.push_str("\nConventions\n");
        for convention in &self.target.conventions {
            item(&mut text, convention);
        }
        item(&mut text, &format!("source: {}", self.target.source));
        if !self.written.warnings.is_empty() {
            text.push_str("\nWarnings\n");
        }
        for warning in &self.written.warnings {
            item(&mut text, warning);
        }
        text
    }

    /// The lines to paste, with the summary as their comment.
    pub fn to_text(&self) -> String {
        let comment = &self.target.comment;
        let mut text = String::new();
        for line in self.summary().lines() {
            let line = line.replace(char::is_control, "?");
            let _ = writeln!(text, "{}", format!("{comment} {line}").trim_end());
        }
        let _ = writeln!(text, "{comment}");
        text + &self.written.lines
    }

    /// For programs.
    pub fn to_json(&self) -> String {
        super::json(&Versioned::new(1, self))
    }
}

fn item(text: &mut String, item: &str) {
    let _ = writeln!(text, "- {}", wrapped(item, "  "));
}

fn losses(text: &mut String, export: &Export) {
    let nominal = export.nominal.as_deref();
    let nominal = nominal.unwrap_or("the nearest symmetric robot");
    let mut rows = vec![
        (
            format!("not calibrated ({nominal})"),
            &export.not_calibrated,
        ),
        (
            "not calibrated, after its best rigid motion".to_owned(),
            &export.not_calibrated_after_rigid_motion,
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
    let others = export.other_targets.iter();
    rows.extend(others.map(|(name, loss)| (format!("- at target {name}"), loss)));
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
    let (loss, alternative) = (&export.loss, &export.target.alternative);
    let nothing = loss.worst < NOTHING;
    if nothing && export.target.content == Content::Everything {
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
    let Some(kept) = export.kept else {
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

fn over(export: &Export) -> String {
    let loss = &export.loss;
    let place = match &export.place {
        Place::Of(file) => format!("of {file}"),
        Place::Within(within) => {
            format!("spread over the workspace within {within} mm of the z axis")
        }
        Place::Workspace => "spread over the workspace".to_owned(),
    };
    let mut text = format!("Over {} positions {place}.", loss.positions);
    if export.nominal.is_none() {
        text.push_str(
            " The robot before calibration is assumed to be the symmetric one with the calibrated robot's mean lengths; give \
             another with --nominal.",
        );
    }
    if loss.unreached > 0 {
        let why = if export.table.is_some() {
            "their cells lack corrections"
        } else {
            "the controller's kinematics does not reach them"
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
