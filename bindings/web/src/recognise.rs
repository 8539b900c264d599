//! What a file is, said before anything is computed.

use crate::fault::Fault;
use crate::folder::Folder;
use crate::inputs::{Machine, Request};
use delta_cal::robot::{Arm, Drive};
use delta_cal_host::files::samples_file::Kind as Measured;
use delta_cal_host::import::{Firmware, Imported, Stated, lengths, touched};
use delta_cal_host::text::{count, list};
use delta_cal_host::{
    InputError, InputText, Planned, Readings, RobotFile, read_joints, read_positions,
};
use serde::{Deserialize, Serialize};
use tsify::Tsify;

/// What a file is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Tsify)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Robot,
    Printer,
    /// A part of a printer's configuration.
    Included,
    /// Joints and what was measured there.
    Samples,
    /// Joints alone.
    Joints,
    /// Coordinates alone.
    Positions,
    /// A plan to fill in.
    Plan,
    /// A table that cannot be read yet.
    Table,
    Unusable,
}

/// The file.
#[derive(Debug, Default, Deserialize, Tsify)]
#[tsify(rename = "RecogniseRequest")]
pub(crate) struct Which {
    name: String,
}

/// A file and what it is.
#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Recognised {
    name: String,
    kind: Kind,
    /// In words.
    what: String,
    fault: Option<Fault>,
}

/// Kind, words and fault of a file.
type Found = (Kind, String, Option<InputError>);

/// What a file is, for itself or with the robot that tables are read with; `None` of a table without a robot.
pub(crate) fn one(files: &Folder, request: &Request, which: &Which) -> Recognised {
    let name = &*which.name;
    let (kind, what, fault) = settings(files, name)
        .unwrap_or_else(|| of_table(files, name, request.machine(files).ok().as_ref()));
    Recognised {
        name: name.to_owned(),
        kind,
        what,
        fault: fault.map(Fault::from),
    }
}

/// A robot file or a configuration; `None` if it is neither.
fn settings(files: &Folder, name: &str) -> Option<Found> {
    let text = match files.table(name) {
        Ok(text) => text,
        Err(error) => return Some((Kind::Unusable, "Not a text file".to_owned(), Some(error))),
    };
    if text.is_robot() {
        return Some(match files.robot(name) {
            Ok(robot) => (Kind::Robot, of_robot(&robot), None),
            Err(error) => (Kind::Robot, "Robot file".to_owned(), Some(error)),
        });
    }
    let mut lines = text.text().lines().map(str::trim);
    let firmware = match Firmware::of(&text) {
        Ok(firmware) => firmware,
        Err(error) if text.text().contains("M665") => {
            let what = "Printer: M665 of RepRapFirmware or Marlin?".to_owned();
            return Some((Kind::Printer, what, Some(error)));
        }
        // What `[include]` of Klipper names.
        Err(_) if lines.any(|line| line.starts_with('[') && line.ends_with(']')) => {
            let what = "Part of a Klipper configuration".to_owned();
            return Some((Kind::Included, what, None));
        }
        Err(_) => return None,
    };
    let title = firmware.title();
    let includes = |from: &str, wanted: &str| files.included(from, wanted);
    let found = files
        .settings(name)
        .and_then(|text| firmware.import(&text, &Stated::default(), &includes));
    let (what, fault) = match found {
        Ok(imported) => {
            let drive = match imported.robot.robot.drive() {
                Drive::Linear => "towers",
                Drive::Rotary => "rotary arms",
            };
            let saved = match imported.counts() {
                [0, 0] => "no measurements saved".to_owned(),
                [heights, distances] => format!(
                    "{} and {} saved",
                    count(heights, "height"),
                    count(distances, "distance")
                ),
            };
            (format!("Printer with {title}, {drive}: {saved}"), None)
        }
        Err(error) => (format!("{title} configuration"), Some(error)),
    };
    Some((Kind::Printer, what, fault))
}

fn of_robot(robot: &RobotFile) -> String {
    let (kind, lengths, length): (_, _, fn(&Arm<f64>) -> f64) = match robot.robot.drive() {
        Drive::Rotary => (
            "Robot with rotary arms",
            "upper arms",
            Arm::upper_arm_length,
        ),
        Drive::Linear => ("Robot with towers", "rods", Arm::lb),
    };
    let mean = robot.robot.arms().iter().map(length).sum::<f64>() / 3.0;
    let stated = match (robot.tolerance.is_some(), robot.noise.is_some()) {
        (true, true) => "tolerance and noise",
        (true, false) => "tolerance",
        (false, true) => "noise",
        (false, false) => "no tolerance, no noise",
    };
    format!("{kind}, {lengths} {mean:.1} mm; states {stated}")
}

/// A table or an answer of a console, with the robot that it is read with.
fn of_table(files: &Folder, name: &str, machine: Option<&Machine>) -> Found {
    let text = match files.table(name) {
        Ok(text) => text,
        Err(error) => return (Kind::Unusable, "Not a table".to_owned(), Some(error)),
    };
    let robot = match machine {
        None => {
            let rows = text.text().lines().count().saturating_sub(1);
            let rows = count(rows, "row");
            let what = format!("Table of about {rows}; add the robot to read it");
            return (Kind::Table, what, None);
        }
        Some(Machine::Printer(printer)) => match of_console(&text, printer) {
            Ok(None) => &printer.robot,
            Ok(Some(what)) => return (Kind::Samples, what, None),
            Err(error) => {
                return (Kind::Samples, "Answer of a console".to_owned(), Some(error));
            }
        },
        Some(Machine::Robot(robot)) => robot,
    };
    let fault = match Readings::read(&text, robot) {
        Ok(readings) => return (Kind::Samples, of_readings(&readings), None),
        Err(error) => error,
    };
    match Planned::read(&text, robot) {
        Ok(plan) if plan.is_unmeasured() && !plan.unmeasured.is_empty() => {
            let rows = count(plan.unmeasured.len(), "row");
            return (Kind::Plan, format!("Plan: {rows} to measure"), None);
        }
        _ => {}
    }
    let joints = read_joints(&text, robot);
    let positions = read_positions(&text, &robot.convention);
    match (joints, positions) {
        (Ok(rows), Err(_)) if !has(&text, 'x') => {
            let poses = count(rows.len(), "pose");
            let what = format!("Joints of {poses}; add what was measured");
            (Kind::Joints, what, None)
        }
        (Err(_), Ok(rows)) => {
            let rows = count(rows.len(), "position");
            let what = format!("{rows} without joints; add them");
            (Kind::Positions, what, None)
        }
        _ => (
            Kind::Samples,
            "Not readable as samples".to_owned(),
            Some(fault),
        ),
    }
}

/// Touches of a printer's bed, or lengths of its prints, in words.
fn of_console(text: &InputText, printer: &Imported) -> Result<Option<String>, InputError> {
    if let Some(all) = lengths(text)? {
        return Ok(Some(format!("{} of prints", count(all.len(), "length"))));
    }
    let touched = touched(printer, text)?;
    Ok(touched.map(|own| format!("{} of the bed", count(own.readings.rows.len(), "height"))))
}

/// Whether a table's header names anything that is measured.
fn has(text: &InputText, letter: char) -> bool {
    let header = text.text().lines().find(|line| !line.starts_with('#'));
    header.is_some_and(|line| {
        line.split([',', ';', '\t', ' '])
            .any(|own| own.trim().starts_with(letter))
    })
}

fn of_readings(readings: &Readings) -> String {
    let kinds = Measured::ALL
        .into_iter()
        .filter(|kind| readings.holds(*kind));
    let kinds: Vec<_> = kinds.map(|kind| kind.plural().to_owned()).collect();
    format!("{}: {}", count(readings.rows.len(), "sample"), list(&kinds))
}
