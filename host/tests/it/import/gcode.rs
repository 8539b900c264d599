//! M665 and M666 of RepRapFirmware and Marlin.

use crate::export::klipper::Delta;
use crate::export::robots::{made, upright, with_towers};
use crate::import::run_next;
use crate::support::{Folder, Point, distance, number, robot_toml};
use delta_cal_host::InputText;
use delta_cal_host::files::robot_file::RobotFile;
use delta_cal_tests::generator;
use serde_json::Value;

const REPRAPFIRMWARE: &str = include_str!("../../cases/import-reprapfirmware/config.g");

const MARLIN: &str = include_str!("../../cases/import-marlin/m503.txt");

/// What both say.
fn printer() -> Delta {
    Delta {
        radius: 141.2,
        angles: [210.3, 329.8, 90.1],
        arms: [330.1, 330.4, 329.8],
        endstops: [412.9, 411.8, 412.8],
        step_lengths: [0.0125; 3],
    }
}

/// As Marlin's examples have them: other machines' branches, sums, comments.
const CONSTANTS: &str = include_str!("../../cases/import-marlin/Configuration.h");

/// The same printer in both firmwares' lines, with and without the firmware's name, behind OctoPrint's prefixes, in Marlin's `Configuration.h`, and in the file
/// that `M501` loads.
#[test]
fn lines_are_the_printer_that_they_describe() {
    let logged = MARLIN.replace("echo:", "12:30:01 Recv: echo:");
    let overridden = "M665 R100 L200 H9\nM501 ; load";
    for (firmware, name, text) in [
        ("reprapfirmware", "duet.g", REPRAPFIRMWARE),
        ("reprapfirmware", "config.g", overridden),
        ("", "duet.g", REPRAPFIRMWARE),
        ("", "m503.txt", MARLIN),
        ("marlin", "log.txt", &logged),
        ("marlin", "Configuration.h", CONSTANTS),
    ] {
        let folder = Folder::new();
        folder.write(name, text);
        let command = format!("import {firmware} {name} --output mine");
        if text == overridden {
            let missing = folder.run(&command).stderr;
            assert!(missing.contains("copy config-override.g"), "{missing}");
            folder.write("config-override.g", REPRAPFIRMWARE);
        }
        let run = folder.run(&command).ok();
        assert!(!folder.path("mine/samples.csv").exists());
        let file = InputText::from_file(&folder.path("mine/robot.toml")).unwrap();
        let robot = RobotFile::read(&file).unwrap();
        let own = printer();
        for at in [[0.0, 0.0, 0.0], [80.0, -20.0, 10.0], [-60.0, 90.0, 200.0]] {
            let carriages: Point = robot.robot.inverse(&at.into()).unwrap();
            assert!(distance(carriages, own.carriages(at)) < 1e-6, "{name}");
        }
        let [a, b, c] = own.absolute_endstops();
        let home = format!("--home {a:.6},{b:.6},{c:.6}");
        assert!(run.stdout.contains(&home), "{name}: {}", run.stdout);
        if firmware == "reprapfirmware" {
            // What is written again is what was read, the printable radius as well.
            let command = format!("export mine/robot.toml --for {firmware} {home}");
            let lines = folder.run(&command).ok().stdout;
            assert!(
                lines.contains(" B120.0 ") && lines.contains(" R141.2000 H412.5000 "),
                "{lines}"
            );
        }
        run_next(&folder, &run.stdout);
    }
}

/// A robot exported, imported and exported again: every parameter that its controller holds is as it was.
#[test]
fn lines_are_imported_as_they_are_exported() {
    let rotary = "--home=-40,-41,-40.5 --height 900mm";
    let towers = "--home 712,711.5,712.4";
    for (target, options) in [
        ("klipper", rotary),
        ("reprapfirmware", rotary),
        ("fluidnc", rotary),
        ("grblhal", rotary),
        ("klipper", towers),
        ("reprapfirmware", towers),
        ("marlin", towers),
        ("marlin-1.1", towers),
        ("smoothieware", towers),
    ] {
        let folder = Folder::new();
        if options == towers {
            with_towers(&folder, &upright());
        } else {
            folder.write("calibrated.toml", robot_toml(&made(&mut generator(7, 3))));
        }
        let export = |robot: &str, options: &str| -> Vec<(String, f64)> {
            let command = format!(
                "export {robot} --for {target} {options} --output lines.cfg --json report.json"
            );
            folder.run(&command).ok();
            // RepRapFirmware's M666 corrects the upper limit of M669 A.
            let lines = folder.read("lines.cfg");
            let limit = lines.split_once(" A-").and_then(|(_, own)| {
                let (_, own) = own.split_once(':')?;
                own.split_once(' ')?.0.parse().ok()
            });
            let value = |own: &Value| {
                let name = own["name"].as_str().unwrap().to_owned();
                let trim = limit.filter(|_| name.starts_with("M666"));
                (name, number(own, "value") + trim.unwrap_or(0.0))
            };
            let report = folder.json("report.json");
            let all = report["parameters"].as_array().unwrap().iter();
            all.map(value).collect()
        };
        let parameters = export("calibrated.toml", options);
        let motors = ["a", "b", "c"].map(|own| {
            format!("[stepper_{own}]\nmicrosteps: 16\ngear_ratio: 107:16\nrotation_distance: 40\n")
        });
        let lines = match (target, options == towers) {
            ("klipper", true) => format!("{}[printer]\nkinematics: delta\n", motors.concat()),
            ("klipper", _) => motors.concat(),
            _ => String::new(),
        };
        folder.write("lines.cfg", folder.read("lines.cfg") + &lines);
        let firmware = target.trim_end_matches("-1.1");
        let run = folder.run(&format!("import {firmware} lines.cfg --output mine"));
        let said = run.ok().stdout;
        let (_, home) = said.split_once("--home ").unwrap();
        let home = home.split_whitespace().next().unwrap();
        // z = 0 is then that of the controller.
        let (height, lifted) = if options == towers {
            ("", 0.0)
        } else {
            ("--height 100mm", 100.0)
        };
        let again = export("mine/robot.toml", &format!("--home={home} {height}"));
        assert_eq!(parameters.len(), again.len());
        for ((name, own), (_, again)) in parameters.iter().zip(&again) {
            let heights = ["shoulder_height", "position_endstop", "M669 H"];
            let is_height = heights.iter().any(|height| name.contains(height));
            let lifted = if is_height { lifted } else { 0.0 };
            // They are written to four decimals.
            let off = (own + lifted - again).abs();
            assert!(off < 3e-4, "{target} {name}: {own} {again}");
        }
    }
}
