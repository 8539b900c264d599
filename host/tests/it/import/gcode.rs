//! M665 and M666 of RepRapFirmware and Marlin.

use crate::export::klipper::Delta;
use crate::export::robots::{made, upright, with_towers};
use crate::import::refusals::assert_wrong;
use crate::import::run_next;
use crate::support::{Folder, Point, assert_refused, cases, distance, number, robot_toml};
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
        assert!(!run.stdout.contains("hunter2"));
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

/// FluidNC may state one angle of homing for each motor, in radians. Both it and grblHAL touch no bed by themselves.
#[test]
fn lengths_of_fluidnc_and_grblhal_are_read() {
    let lengths = "parallel_delta:\ncrank_mm: 70\nlinkage_mm: 133.5\nbase_triangle_mm: 179.4\nend_effector_triangle_mm: 86.6";
    let settings = "$641=133.5\n$642=70\n$643=179.4\n$644=86.6";
    let table = "
        fluidnc ⇒ homing_mpos_radians: -1.0471975512, -1.0646508437, -1.0559241974 ⇒ -60.000000,-61.000000,-60.500000
        fluidnc ⇒ up_degrees: -35.5 ⇒ -35.500000,-35.500000,-35.500000
        grblhal ⇒ $646=-60 ⇒ -60.000000,-60.000000,-60.000000
        ";
    for [firmware, angle, home] in cases(table) {
        let lengths = if firmware == "fluidnc" {
            lengths
        } else {
            settings
        };
        let text = format!("{lengths}\n{angle}\n");
        let folder = Folder::new();
        folder.write("own.txt", &text);
        folder.write("robot.toml", "");
        let run = folder
            .run(&format!("import {firmware} own.txt --output mine"))
            .ok();
        let home = format!("--home {home}");
        assert!(run.stdout.contains(&home), "{}", run.stdout);
        let other = ["fluidnc", "grblhal"]
            .into_iter()
            .find(|own| *own != firmware);
        let refused = "own.txt --output other ⇒ 3 ⇒ own.txt: this file is ";
        assert_refused(&folder, &format!("import {}", other.unwrap()), refused);
        let refused = "--count 9 ⇒ 3 ⇒ no commands that touch a bed are known";
        assert_refused(&folder, "plan own.txt", refused);
        let refused = "--output other ⇒ 3 ⇒ robot.toml: the file states no crank_mm or $642";
        assert_refused(&folder, &format!("import {firmware} robot.toml"), refused);
    }
}

#[test]
fn lines_that_cannot_be_read_are_refused() {
    let import = "import reprapfirmware printer.cfg --output mine";
    let table = "
        M665 ⇒ M550 ⇒ no line is an M665
        L330.1: ⇒ Lhunter2: ⇒ printer.cfg:4: M665: a word is not a letter
        ";
    assert_wrong(REPRAPFIRMWARE, &[import], table);
    let table = "
        M206 ⇒ G20 ⇒ printer.cfg:2: the lengths are in inches
        R141.2000 ⇒ ⇒ M665 R: the word is missing
        H411.8000 ⇒ ⇒ M665 H: the word is missing
        L330.1000 R141.2000 ⇒ L12.996 R5.559 ⇒ a rod of 12.996 mm is too short
        L330.1000 ⇒ L100 ⇒ printer.cfg:3: M665 L: a rod is not longer
        R141.2000 ⇒ R-1 ⇒ printer.cfg:3: M665 R: the value is not a number above 0
        B0.3000 ⇒ B120 ⇒ printer.cfg:3: M665 B: B lengthens the rods of a tower since Marlin 2.0, and 120 mm
        A0.0000 ⇒ A12 ⇒ printer.cfg:3: M665 A: A lengthens the rods of a tower since Marlin 2.0, and 12 mm
        ";
    assert_wrong(MARLIN, &["import marlin printer.cfg --output mine"], table);
    let folder = Folder::new();
    folder.write("config.g", REPRAPFIRMWARE);
    let touches = "x_mm,y_mm,height_mm\n4,0,0\n-2,3,0\n-2,-3,0\n";
    folder.write("near.csv", touches);
    folder.write("inches.txt", "G20\nG1 X4 Y0\nStopped at height 0.01 mm\n");
    let table = "
        near.csv ⇒ 3 ⇒ near.csv:2: all touches are within | or in inches | send G21
        inches.txt ⇒ 3 ⇒ inches.txt:1: the touches are in inches
        ";
    assert_refused(&folder, "calibrate config.g", table);
}
