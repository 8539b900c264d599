//! M665 and M666 of RepRapFirmware and Marlin.

use crate::export::klipper::Delta;
use crate::export::robots::{made, upright, with_towers};
use crate::import::run_next;
use crate::support::{Folder, Point, distance, number, robot_toml};
use delta_cal_host::InputText;
use delta_cal_host::files::robot_file::RobotFile;
use delta_cal_tests::generator;
use serde_json::Value;

const REPRAPFIRMWARE: &str = "\
; my config
M550 P\"hunter2\"
M665 R100 L200 ; older
M665 R141.2 L330.1:330.4:329.8 B120 H412.5 X0.3 Y-0.2 Z0.1 ; delta
M666 X0.4 Y-0.7 Z0.3 A0 B0
;M665 R150 L351.1 B145 H530 ; set delta radius, diagonal rod length, printable radius and homed height
";

const MARLIN: &str = "\
echo:; Linear units:
echo:  M206 X0.00
echo:  M665 L330.1000 R141.2000 H411.8000 S160.0000 X0.3000 Y-0.2000 Z0.1000 A0.0000 B0.3000 C-0.3000
echo:  M666 X-1.1000 Y0.0000 Z-1.0000
";

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
const CONSTANTS: &str = "\
//#define LARGE
#define DELTA
#if ENABLED(DELTA) && !defined(LARGE)
  //#define DELTA_HEIGHT 1
  /* #define DELTA_HEIGHT 2
  #define DELTA_HEIGHT 3 */
  #define VERSION 2
  #define DELTA_HEIGHT 411.8f /* G33 */ // (mm)
  #define DELTA_ENDSTOP_ADJ  \\
    {-1.1, 0.0, -1.0} // (mm)
  #if EITHER(LARGE, HUGE) || VERSION < 2
    #define DELTA_DIAGONAL_ROD 440
    #define DELTA_RADIUS 200
  #elif VERSION == 2
    #define DELTA_DIAGONAL_ROD 330.1 // mm
    #define OFFSET 30
    #define DELTA_RADIUS (200.2-(OFFSET)-2*14.5)
  #else
    #define DELTA_RADIUS 210
  #endif
  #define DELTA_TOWER_ANGLE_TRIM { 0.3, -0.2, 0.1 }
  // Delta radius and diagonal rod adjustments
  #define DELTA_RADIUS_TRIM_TOWER { 0.0, 0.0, 0.0 }
  #define DELTA_DIAGONAL_ROD_TRIM_TOWER { 0.0, 0.3, -0.3 }
#endif
#if ENABLED(POLAR)
  #define DELTA_RADIUS 82
#endif
";

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
