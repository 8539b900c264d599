//! What an export writes: the target's lines below what is lost, and the same for programs.

use crate::export::corrections::between::Between;
use crate::export::corrections::choice::Finished;
use crate::export::corrections::table::{Node, Table};
use crate::export::exported::{Content, Export};
use crate::export::frame::Frame;
use crate::export::loss::Loss;
use crate::render::json::report;
use crate::text::numbers::millimetres;
use serde_json::{Value, json};
use std::fmt::Write;

/// Columns of a line.
const WIDTH: usize = 98;
/// Less than this part of the gain is little.
const LITTLE: f64 = 0.33;
/// Less than this part of the gain is only some of it.
const SOME: f64 = 0.6;
/// A loss below this is that of rounding, mm.
const NOTHING: f64 = 0.001;

/// Which files an export was made from.
#[derive(Debug, Clone, Copy)]
pub struct Files<'a> {
    /// The calibrated robot.
    pub robot: &'a str,
    /// The robot before, if a file states it.
    pub nominal: Option<&'a str>,
    /// The wanted positions, if a file states them.
    pub positions: Option<&'a str>,
}

/// The summary, line by line.
pub fn summary(export: &Export, files: &Files<'_>) -> Vec<String> {
    let mut text = Vec::new();
    let what = match &export.content {
        Content::Fitted(count) => format!("{count} parameters and a frame fitted"),
        Content::Everything => "all 24 parameters".to_owned(),
        Content::Corrections(finished) => format!(
            "{} corrections, {} mm between the nodes",
            finished.table.kind.name(),
            finished.table.grid.spacing
        ),
    };
    text.push(format!("{}: {what}, from {}", export.title, files.robot));
    text.push(String::new());
    let nominal = files.nominal.unwrap_or("the nearest symmetric robot");
    let rows = [
        (format!("not calibrated ({nominal})"), &export.uncalibrated),
        (
            "not calibrated, after its best rigid motion".to_owned(),
            &export.uncalibrated_moved,
        ),
        (format!("for {}", export.name), &export.loss),
    ];
    let rows: Vec<_> = rows.into_iter().chain(between(export)).collect();
    let width = rows.iter().map(|(name, _)| name.chars().count()).max();
    let width = width.unwrap_or(0);
    text.push(format!(
        "{:<width$}  {:>8}  {:>8}",
        "position error, mm", "rms", "worst"
    ));
    for (name, loss) in rows {
        text.push(format!(
            "{name:<width$}  {:>8.4}  {:>8.4}",
            loss.rms, loss.worst
        ));
    }
    text.push(String::new());
    text.extend(wrapped(&verdict(export)));
    text.extend(wrapped(&over(export, files)));
    if let Some(frame) = &export.frame {
        text.push(String::new());
        text.extend(motion(frame));
    }
    text.push(String::new());
    text.push("Conventions".to_owned());
    for convention in &export.conventions {
        text.extend(item(convention));
    }
    text.extend(item(&format!("source: {}", export.source)));
    if !export.written.warnings.is_empty() {
        text.push(String::new());
        text.push("Heed".to_owned());
        for warning in &export.written.warnings {
            text.extend(item(warning));
        }
    }
    text
}

/// What interpolation between the nodes of a table leaves.
fn between(export: &Export) -> Vec<(String, &Loss)> {
    match &export.content {
        Content::Corrections(finished) => {
            let Between {
                centres, random, ..
            } = &finished.between;
            let mut rows = vec![
                (
                    format!("- in the middle of {} cells", centres.positions),
                    centres,
                ),
                (format!("- at {} random points", random.positions), random),
            ];
            // Of positions in one plane the centres are none.
            rows.retain(|(_, loss)| loss.positions > 0);
            rows
        }
        Content::Fitted(_) | Content::Everything => Vec::new(),
    }
}

fn verdict(export: &Export) -> String {
    let loss = &export.loss;
    if loss.worst < NOTHING && export.content == Content::Everything {
        return "Nothing is lost: the target holds all 24 parameters.".to_owned();
    }
    let lost = if loss.worst < NOTHING {
        format!("Lost: less than {NOTHING} mm.")
    } else {
        format!(
            "Lost: {} rms, {} at worst, at x = {:.1}, y = {:.1}, z = {:.1} mm.",
            millimetres(loss.rms),
            millimetres(loss.worst),
            loss.at.x,
            loss.at.y,
            loss.at.z
        )
    };
    let Some(kept) = export.kept() else {
        return format!(
            "{lost} The calibrated robot is as the nominal one, so that there was nothing to gain."
        );
    };
    let percent = 100.0 * kept;
    let (keep, these) = match export.content {
        Content::Corrections(_) => ("This table keeps", "this table"),
        Content::Fitted(_) | Content::Everything => ("These parameters keep", "these parameters"),
    };
    let instead = export.alternative;
    if kept <= 0.0 {
        format!(
            "{lost} Do not use {these}: the robot before calibration, after its best rigid motion, is no worse. Use \
             instead: {instead}."
        )
    } else if kept < LITTLE {
        format!(
            "{lost} {keep} little of what the calibration gains: {percent:.0} %. Use instead: {instead}."
        )
    } else if kept < SOME {
        format!(
            "{lost} {keep} only {percent:.0} % of what the calibration gains. To keep more, use: {instead}."
        )
    } else {
        format!("{lost} That keeps {percent:.0} % of what the calibration gains.")
    }
}

fn over(export: &Export, files: &Files<'_>) -> String {
    let loss = &export.loss;
    let place = match files.positions {
        Some(name) => format!("of {name}"),
        None => match export.within {
            Some(within) => format!("spread over the workspace within {within} mm of the z axis"),
            None => "spread over the workspace".to_owned(),
        },
    };
    let mut text = format!("Over {} positions {place}.", loss.positions);
    if files.nominal.is_none() {
        text.push_str(
            " The symmetric robot stands for the robot before calibration, because --nominal does not name it; it \
             has the mean lengths of the calibrated robot.",
        );
    }
    if loss.unreached > 0 {
        let _ = write!(text, " Another {} are left out: ", loss.unreached);
        text.push_str(if matches!(export.content, Content::Corrections(_)) {
            "they lie in cells without corrections at all eight nodes."
        } else {
            "the target's kinematics does not reach them."
        });
    }
    text
}

fn motion(frame: &Frame) -> Vec<String> {
    let [x, y, z] = [frame.shift.x, frame.shift.y, frame.shift.z];
    let [rx, ry, rz] = frame.turns.map(f64::to_degrees).data.0[0];
    let mut text = vec![
        "The rigid motion that is part of the fit: from the calibrated robot's frame to the controller's".to_owned(),
        format!("  shift  x {x:.4}  y {y:.4}  z {z:.4} mm"),
        format!("  turn   about x {rx:.4}  about y {ry:.4}  about z {rz:.4} degrees (R = Rz Ry Rx)"),
    ];
    text.extend(wrapped(
        "A position p of the calibrated robot's frame is R p + shift for the controller. This is your work offset \
         (shift), your levelling (about x and y) and the direction of your axes (about z): apply it there, or \
         measure the work frame anew with the new parameters.",
    ));
    text
}

/// The lines to paste, with the summary as their comment.
pub fn text(export: &Export, files: &Files<'_>) -> String {
    let mut text = String::new();
    let xml = export.comment.is_empty();
    if xml {
        text.push_str("<?xml version=\"1.0\"?>\n<!--\n");
    }
    for line in summary(export, files) {
        // A comment of XML must not hold two hyphens.
        let line = if xml { line.replace("--", "- -") } else { line };
        let line: String = line
            .chars()
            .map(|c| if c.is_control() { '?' } else { c })
            .collect();
        let _ = writeln!(text, "{}", format!("{} {line}", export.comment).trim_end());
    }
    if xml {
        text.push_str("-->\n");
    } else {
        let _ = writeln!(text, "{}", export.comment);
    }
    text + &export.written.lines
}

fn loss(loss: &Loss) -> Value {
    json!({
        "rms_mm": loss.rms,
        "worst_mm": loss.worst,
        "worst_at_mm": [loss.at.x, loss.at.y, loss.at.z],
        "positions": loss.positions,
        "unreached": loss.unreached,
    })
}

/// A correction table.
fn table(finished: &Finished) -> Value {
    let Table { kind, grid, nodes } = &finished.table;
    let corrections: Vec<_> = nodes
        .iter()
        .map(|node| node.correction().map(|by| [by.x, by.y, by.z]))
        .collect();
    let extrapolated = nodes
        .iter()
        .zip(0..)
        .filter_map(|(node, index)| match node {
            Node::Extrapolated(_) => Some(index),
            Node::Computed(_) | Node::Empty => None,
        });
    let extrapolated: Vec<usize> = extrapolated.collect();
    json!({
        "corrections_of": kind.name(),
        "unit": finished.unit,
        "origin_mm": [grid.origin.x, grid.origin.y, grid.origin.z],
        "spacing_mm": grid.spacing,
        "nodes_along_xyz": grid.counts,
        "fastest": "z",
        "corrections": corrections,
        "extrapolated": extrapolated,
        "limit_mm": finished.limit,
        "at_cell_centres": loss(&finished.between.centres),
        "at_random_points": loss(&finished.between.random),
    })
}

/// For programs.
pub fn json(export: &Export, files: &Files<'_>) -> Value {
    let parameters: Vec<_> = export
        .written
        .entries
        .iter()
        .map(|entry| json!({"name": entry.name, "value": entry.value, "unit": entry.unit}))
        .collect();
    let frame = export.frame.map(|frame| {
        let turns = frame.turns.map(f64::to_degrees);
        json!({
            "shift_mm": [frame.shift.x, frame.shift.y, frame.shift.z],
            "turn_deg": [turns.x, turns.y, turns.z],
        })
    });
    report(
        1,
        json!({
            "target": export.name,
            "robot": files.robot,
            "nominal": files.nominal,
            "fitted_parameters": match export.content {
                Content::Fitted(count) => Some(count),
                Content::Everything | Content::Corrections(_) => None,
            },
            "table": match &export.content {
                Content::Corrections(finished) => Some(table(finished)),
                Content::Fitted(_) | Content::Everything => None,
            },
            "parameters": parameters,
            "frame": frame,
            "loss": loss(&export.loss),
            "not_calibrated": loss(&export.uncalibrated),
            "not_calibrated_after_rigid_motion": loss(&export.uncalibrated_moved),
            "kept": export.kept(),
            "conventions": export.conventions,
            "source": export.source,
            "warnings": export.written.warnings,
            "lines": export.written.lines,
        }),
    )
}

/// Lines of at most [`WIDTH`] columns.
pub(super) fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        if let Some(line) = lines.last_mut() {
            if line.is_empty() {
                line.push_str(word);
            } else if line.chars().count() + 1 + word.chars().count() <= WIDTH {
                line.push(' ');
                line.push_str(word);
            } else {
                lines.push(word.to_owned());
            }
        }
    }
    lines
}

fn item(text: &str) -> Vec<String> {
    let mut lines = wrapped(text);
    for (index, line) in lines.iter_mut().enumerate() {
        line.insert_str(0, if index == 0 { "- " } else { "  " });
    }
    lines
}
