//! A printer.cfg of each printer: the numbers of a public configuration, in the form that Klipper writes.

use crate::export::controllers::Arm;
use crate::export::klipper::{Delta, RotaryDelta};
use crate::support::{Folder, Point};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Sections that are none of the program's business, among them lines that are no options.
const OTHERS: &str = "\
[mcu]
serial: /dev/serial/by-id/usb-1a86_X
[telegram_bot]
token: abc:TOKEN ; of my bot
hunter2 is no option
[gcode_macro START]
gcode:
    {% set password = 'homesweethome' %}
    [printer]
    delta_radius: 1
    kinematics: cartesian
";

/// A measurement at steps from the end stops: a height, or the distance to other steps.
#[derive(Clone, Copy)]
pub(crate) enum Row {
    Height(Point, f64),
    Distance(Point, Point, f64),
}

#[derive(Clone)]
pub(crate) struct Printer {
    pub(crate) klipper: Delta,
    pub(crate) rows: Vec<Row>,
}

fn numbers(line: &str, key: &str) -> Vec<f64> {
    let start = line.find(&format!("{key} = ")).unwrap() + key.len() + 3;
    let text = line[start..].split(';').next().unwrap();
    let text = text.trim().trim_matches(['[', ']']);
    text.split(',').map(|n| n.trim().parse().unwrap()).collect()
}

fn three(values: &[f64]) -> Point {
    values.try_into().unwrap()
}

fn folder_of_printers() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/printers")
}

/// All ten.
pub(crate) fn printers() -> Vec<Printer> {
    let mut files: Vec<_> = std::fs::read_dir(folder_of_printers())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    assert_eq!(files.len(), 10);
    files.iter().map(|file| read(file)).collect()
}

pub(crate) fn printer(number: &str) -> Printer {
    read(&folder_of_printers().join(format!("printer_{number}.csv")))
}

fn read(file: &Path) -> Printer {
    let text = std::fs::read_to_string(file).unwrap();
    let facts = text.lines().nth(1).unwrap();
    let klipper = Delta {
        radius: numbers(facts, "delta_radius_mm")[0],
        angles: three(&numbers(facts, "tower_deg")),
        arms: three(&numbers(facts, "arm_mm")),
        endstops: three(&numbers(facts, "endstop_mm")),
        step_lengths: three(&numbers(facts, "step_mm")),
    };
    let rows = text.lines().skip(3).map(|line| {
        let cells: Vec<_> = line.split(',').collect();
        let at = |first: usize| {
            let carriages = [0, 1, 2].map(|k| cells[first + k].parse::<f64>().unwrap());
            klipper.steps_of(carriages)
        };
        match cells[3] {
            "" => Row::Distance(at(0), at(4), cells[7].parse().unwrap()),
            height => Row::Height(at(0), height.parse().unwrap()),
        }
    });
    let rows = rows.collect();
    Printer { klipper, rows }
}

/// The section of measurements as Klipper saves it.
pub(crate) fn measured(rows: &[Row]) -> String {
    let steps = |at: &Point| at.map(|n| format!("{n:.9}")).join(",");
    let (mut text, mut heights, mut distances) = (String::from("[delta_calibrate]\n"), 0, 0);
    for row in rows {
        match row {
            Row::Height(at, height) => {
                let name = format!("height{heights}");
                writeln!(text, "{name} = {height}\n{name}_pos = {}", steps(at)).unwrap();
                heights += 1;
            }
            Row::Distance(at, to, distance) => {
                let name = format!("distance{distances}");
                let (at, to) = (steps(at), steps(to));
                let lines = format!("{name} = {distance}\n{name}_pos1 = {at}\n{name}_pos2 = {to}");
                writeln!(text, "{lines}").unwrap();
                distances += 1;
            }
        }
    }
    text
}

impl Printer {
    pub(crate) fn unmeasured(klipper: Delta) -> Self {
        let rows = Vec::new();
        Self { klipper, rows }
    }

    /// Everything that SAVE_CONFIG writes in its block.
    pub(crate) fn configuration(&self) -> String {
        let own = &self.klipper;
        let mut saved = format!("[printer]\ndelta_radius = {}\n\n", own.radius);
        for (k, letter) in ["a", "b", "c"].into_iter().enumerate() {
            write!(
                saved,
                "[stepper_{letter}]\nangle = {}\narm_length = {}\nposition_endstop = {}\n\n",
                own.angles[k], own.arms[k], own.endstops[k]
            )
            .unwrap();
        }
        saved += &measured(&self.rows);
        format!("{}\n{}", self.by_hand(), block(&saved))
    }

    /// What the owner writes: no geometry, no measurement.
    pub(crate) fn by_hand(&self) -> String {
        let mut text = format!(
            "# my printer\n[printer]\nkinematics: delta # three towers\nmax_velocity: 300\nprint_radius: 120\n{OTHERS}"
        );
        for (letter, length) in ["a", "b", "c"].into_iter().zip(self.klipper.step_lengths) {
            write!(
                text,
                "[stepper_{letter}]\nstep_pin: PE3\nMicrosteps: 16\nrotation_distance: {:?}\n\
                 #position_endstop: 435\n",
                length * 3200.0
            )
            .unwrap();
        }
        text + "[delta_calibrate]\nradius: 100\nhorizontal_move_z: 10\n"
    }
}

/// The block of `SAVE_CONFIG`.
pub(crate) fn block(saved: &str) -> String {
    let mut text = String::from(
        "#*# <---------------------- SAVE_CONFIG ---------------------->\n\
         #*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.\n#*#\n",
    );
    for line in saved.lines() {
        text += format!("#*# {line}").trim_end();
        text.push('\n');
    }
    text
}

/// A folder with the configuration of a printer.
pub(crate) fn folder(configuration: &str) -> Folder {
    let folder = Folder::new();
    folder.write("printer.cfg", configuration);
    folder
}

/// A robot whose motors turn its arms, and its configuration without measurements.
pub(crate) fn rotary() -> (RotaryDelta, String) {
    let step = std::f64::consts::TAU / (200.0 * 16.0 * (107.0 / 16.0));
    let arm = |[azimuth, upper, lower]: Point| Arm {
        azimuth,
        radius: 33.9,
        height: 412.9,
        upper,
        lower,
    };
    let klipper = RotaryDelta {
        arms: [
            [30.4, 170.0, 320.0],
            [149.8, 170.4, 319.5],
            [270.1, 169.7, 320.2],
        ]
        .map(arm),
        endstops: [252.0, 252.6, 251.3],
        step_lengths: [step; 3],
    };
    let mut text = format!(
        "[printer]\nkinematics: rotary_delta\nshoulder_radius: 33.9\nshoulder_height = 412.9\n{OTHERS}"
    );
    for (k, letter) in ["a", "b", "c"].into_iter().enumerate() {
        let (own, endstop) = (klipper.arms[k], klipper.endstops[k]);
        write!(
            text,
            "[stepper_{letter}]\nmicrosteps: 16\ngear_ratio: 107.000:16\nangle: {}\nupper_arm_length: {}\n\
             lower_arm_length: {}\nposition_endstop: {endstop}\n",
            own.azimuth, own.upper, own.lower
        )
        .unwrap();
    }
    (klipper, text)
}
