//! What a file is, said before anything is computed.

use crate::fault::Fault;
use crate::folder::Folder;
use crate::inputs::is_robot_file;
use delta_cal::robot::Drive;
use delta_cal_host::files::samples_file::Kind as Measured;
use delta_cal_host::import::{Firmware, Stated};
use delta_cal_host::text::{count, list};
use delta_cal_host::{InputText, Planned, Readings, RobotFile, read_joints, read_positions};
use serde::Serialize;

/// What a file is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
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

/// A file and what it is.
#[derive(Debug, Serialize)]
pub(crate) struct Recognised {
    name: String,
    kind: Kind,
    /// In words.
    what: String,
    fault: Option<Fault>,
}

/// A robot to read tables with.
struct Known {
    robot: RobotFile,
}

/// Each file; the tables with the first robot that there is.
pub(crate) fn all(files: &Folder) -> Vec<Recognised> {
    let mut known = None;
    let of_settings: Vec<_> = files
        .names()
        .map(|name| settings(files, name, &mut known))
        .collect();
    let names = files.names().zip(of_settings);
    let each =
        names.map(|(name, found)| found.unwrap_or_else(|| of_table(files, name, known.as_ref())));
    each.collect()
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
fn settings(files: &Folder, name: &str, known: &mut Option<Known>) -> Option<Recognised> {
    let text = match files.table(name) {
        Ok(text) => text,
        Err(error) => {
            let found = recognised(name, Kind::Unusable, "Not a text file", Some(error.into()));
            return Some(found);
        }
    };
    if is_robot_file(&text) {
        let found = files.settings(name).and_then(|text| RobotFile::read(&text));
        return Some(match found {
            Ok(robot) => {
                let what = of_robot(&robot);
                known.get_or_insert(Known { robot });
                recognised(name, Kind::Robot, what, None)
            }
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
            let [heights, distances] = imported.counts();
            let what = format!(
                "Printer with {title}, {drive}: {} and {} saved",
                count(heights, "height"),
                count(distances, "distance")
            );
            known.get_or_insert(Known {
                robot: imported.robot,
            });
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

fn of_table(files: &Folder, name: &str, known: Option<&Known>) -> Recognised {
    let text = match files.table(name) {
        Ok(text) => text,
        Err(error) => {
            return recognised(name, Kind::Unusable, "Not a table", Some(error.into()));
        }
    };
    let Some(Known { robot }) = known else {
        let rows = text.text().lines().count().saturating_sub(1);
        let what = format!(
            "Table of about {}; add the robot to read it",
            count(rows, "row")
        );
        return recognised(name, Kind::Table, what, None);
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
        _ => recognised(name, Kind::Samples, "Samples", Some(fault.into())),
    }
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
