//! What a file is, said before anything is computed.

use crate::fault::Fault;
use crate::folder::Folder;
use crate::inputs::{Machine, Request, is_robot_file};
use delta_cal::robot::Drive;
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

/// What a file is, for itself or with the robot that tables are read with; `None` of a table without a robot.
pub(crate) fn one(files: &Folder, request: &Request, which: &Which) -> Recognised {
    let name = &*which.name;
    if let Some(found) = settings(files, name) {
        return found;
    }
    of_table(files, name, request.machine(files).ok().as_ref())
}

fn recognised(name: &str, kind: Kind, what: impl Into<String>, fault: Option<Fault>) -> Recognised {
    Recognised {
        name: name.to_owned(),
        kind,
        what: what.into(),
        fault,
    }
}

/// A robot file or a configuration; `None` if it is neither.
fn settings(files: &Folder, name: &str) -> Option<Recognised> {
    let text = match files.table(name) {
        Ok(text) => text,
        Err(error) => {
            let found = recognised(name, Kind::Unusable, "Not a text file", Some(error.into()));
            return Some(found);
        }
    };
    if is_robot_file(&text) {
        let found = files.robot(name);
        return Some(match found {
            Ok(robot) => recognised(name, Kind::Robot, of_robot(&robot), None),
            Err(error) => recognised(name, Kind::Robot, "Robot file", Some(error.into())),
        });
    }
    let firmware = match Firmware::of(&text) {
        Ok(firmware) => firmware,
        Err(error) if text.text().contains("M665") => {
            let what = "Printer: M665 of RepRapFirmware or Marlin?";
            return Some(recognised(name, Kind::Printer, what, Some(error.into())));
        }
        Err(_) if is_part(&text) => {
            let what = "Part of a Klipper configuration";
            return Some(recognised(name, Kind::Included, what, None));
        }
        Err(_) => return None,
    };
    let title = firmware.title();
    let includes = |from: &str, wanted: &str| files.included(from, wanted);
    let found = files
        .settings(name)
        .and_then(|text| firmware.import(&text, &Stated::default(), &includes));
    Some(match found {
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
            let what = format!("Printer with {title}, {drive}: {saved}");
            recognised(name, Kind::Printer, what, None)
        }
        Err(error) => {
            let what = format!("{title} configuration");
            recognised(name, Kind::Printer, what, Some(error.into()))
        }
    })
}

/// Whether a text looks like what `[include]` of Klipper names.
fn is_part(text: &InputText) -> bool {
    let mut lines = text.text().lines().map(str::trim);
    lines.any(|line| line.starts_with('[') && line.ends_with(']'))
}

fn of_robot(robot: &RobotFile) -> String {
    let (kind, lengths) = match robot.robot.drive() {
        Drive::Rotary => ("Robot with rotary arms", "upper arms"),
        Drive::Linear => ("Robot with towers", "rods"),
    };
    let mean = |of: fn(&delta_cal::robot::Arm<f64>) -> f64| {
        robot.robot.arms().iter().map(of).sum::<f64>() / 3.0
    };
    let length = match robot.robot.drive() {
        Drive::Rotary => mean(delta_cal::robot::Arm::upper_arm_length),
        Drive::Linear => mean(delta_cal::robot::Arm::lb),
    };
    let stated = [
        ("tolerance", robot.tolerance.is_some()),
        ("noise", robot.noise.is_some()),
    ];
    let stated: Vec<_> = stated
        .iter()
        .filter(|(_, own)| *own)
        .map(|(own, _)| (*own).to_owned())
        .collect();
    let stated = if stated.is_empty() {
        "no tolerance, no noise".to_owned()
    } else {
        list(&stated)
    };
    format!("{kind}, {lengths} {length:.1} mm; states {stated}")
}

/// A table or an answer of a console, with the robot that it is read with.
fn of_table(files: &Folder, name: &str, machine: Option<&Machine>) -> Recognised {
    let text = match files.table(name) {
        Ok(text) => text,
        Err(error) => {
            return recognised(name, Kind::Unusable, "Not a table", Some(error.into()));
        }
    };
    let robot = match machine {
        None => {
            let rows = text.text().lines().count().saturating_sub(1);
            let what = format!(
                "Table of about {}; add the robot to read it",
                count(rows, "row")
            );
            return recognised(name, Kind::Table, what, None);
        }
        Some(Machine::Printer(printer)) => match of_console(&text, printer) {
            Ok(None) => &printer.robot,
            Ok(Some(what)) => return recognised(name, Kind::Samples, what, None),
            Err(error) => {
                return recognised(
                    name,
                    Kind::Samples,
                    "Answer of a console",
                    Some(error.into()),
                );
            }
        },
        Some(Machine::Robot(robot)) => robot,
    };
    let fault = match Readings::read(&text, robot) {
        Ok(readings) => return recognised(name, Kind::Samples, of_readings(&readings), None),
        Err(error) => error,
    };
    match Planned::read(&text, robot) {
        Ok(plan) if plan.is_unmeasured() && !plan.unmeasured.is_empty() => {
            let rows = count(plan.unmeasured.len(), "row");
            return recognised(name, Kind::Plan, format!("Plan: {rows} to measure"), None);
        }
        _ => {}
    }
    let joints = read_joints(&text, robot);
    let positions = read_positions(&text, &robot.convention);
    match (joints, positions) {
        (Ok(rows), Err(_)) if !has(&text, 'x') => {
            let what = format!(
                "Joints of {}; add what was measured",
                count(rows.len(), "pose")
            );
            recognised(name, Kind::Joints, what, None)
        }
        (Err(_), Ok(rows)) => {
            let what = format!("{} without joints; add them", count(rows.len(), "position"));
            recognised(name, Kind::Positions, what, None)
        }
        _ => recognised(
            name,
            Kind::Samples,
            "Not readable as samples",
            Some(fault.into()),
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
