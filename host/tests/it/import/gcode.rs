//! M665 and M666 of RepRapFirmware and Marlin.

use crate::export::klipper::Delta;
use crate::import::run_next;
use crate::support::{Folder, Point, assert_refused, cases, distance};
use delta_cal_host::InputText;
use delta_cal_host::files::robot_file::RobotFile;

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

/// The same printer in both firmwares' lines, behind OctoPrint's prefixes, in Marlin's `Configuration.h`, and in the file
/// that `M501` loads.
#[test]
fn lines_are_the_printer_that_they_describe() {
    let logged = MARLIN.replace("echo:", "12:30:01 Recv: echo:");
    let overridden = "M665 R100 L200 H9\nM501 ; load";
    for (firmware, name, text) in [
        ("reprapfirmware", "duet.g", REPRAPFIRMWARE),
        ("reprapfirmware", "config.g", overridden),
        ("marlin", "m503.txt", MARLIN),
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

/// A rotary robot in the forms in which it is exported is that robot: arms and joint angles at its positions.
#[test]
fn rotary_lines_are_imported_as_they_are_exported() {
    let robot = |text: &str| {
        let file = InputText::new("robot.toml", text);
        RobotFile::read(&file).unwrap().robot
    };
    let symmetric = [-90.0, 30.0, 150.0].map(|theta: f64| {
        let (sine, cosine) = theta.to_radians().sin_cos();
        let [x, y] = [140.0 * cosine, 140.0 * sine];
        format!("[[arm]]\ndx_mm = {x:.9}\ndy_mm = {y:.9}\ndz_mm = 0.0\ntheta_deg = {theta}\nalpha_deg = 0.0\nla_x_mm = 180.0\nla_y_mm = 0.0\nlb_mm = 400.0\n")
    });
    let text = format!(
        "[joints]\nmin_deg = -80.0\nmax_deg = 80.0\n{}",
        symmetric.concat()
    );
    // FluidNC may state one angle of homing for each motor, in radians.
    let radians = "    homing_mpos_radians: -1.0471975512, -1.0646508437, -1.0559241974\n";
    let each = "--home -60.000000,-61.000000,-60.500000";
    let one = "--home -60.000000,-60.000000,-60.000000";
    for (target, name, home, stated, homed) in [
        ("reprapfirmware", "config.g", each, "", each),
        ("fluidnc", "config.yaml", "", radians, each),
        ("grblhal", "settings.txt", "", "$646=-60\n", one),
    ] {
        let folder = Folder::new();
        folder.write("robot.toml", &text);
        folder
            .run(&format!(
                "export robot.toml --for {target} {home} --output {name}"
            ))
            .ok();
        folder.write(name, folder.read(name) + stated);
        let run = folder
            .run(&format!("import {target} {name} --output mine"))
            .ok();
        assert!(run.stdout.contains(homed), "{target}: {}", run.stdout);
        if home.is_empty() {
            let refused = "--count 9 ⇒ 3 ⇒ no commands that touch a bed are known";
            assert_refused(&folder, &format!("plan {name}"), refused);
            let refused = "--output other ⇒ 3 ⇒ robot.toml: the file states no crank_mm or $642";
            assert_refused(&folder, &format!("import {target} robot.toml"), refused);
        }
        let [own, found] = [robot(&text), robot(&folder.read("mine/robot.toml"))];
        for at in [
            [0.0, 0.0, -350.0],
            [80.0, -20.0, -400.0],
            [-60.0, 90.0, -330.0],
        ] {
            // z = 0 is where the controller has it.
            let up = found.arms()[0].d().z - own.arms()[0].d().z;
            let [mut own, mut found]: [Point; 2] = [(&own, at[2]), (&found, at[2] + up)]
                .map(|(own, z)| own.inverse(&[at[0], at[1], z].into()).unwrap());
            // The controllers' motors are in an order of their own.
            own.sort_by(f64::total_cmp);
            found.sort_by(f64::total_cmp);
            assert!(distance(own, found) < 1e-5, "{target}: {own:?} {found:?}");
        }
    }
}

#[test]
fn lines_that_cannot_be_read_are_refused() {
    let table = "
        reprapfirmware M665 ⇒ M550 ⇒ no line is an M665
        marlin R141.2000 ⇒ ⇒ M665 R: the word is missing
        marlin H411.8000 ⇒ ⇒ M665 H: the word is missing
        marlin L330.1000 ⇒ L100 ⇒ config.g:3: M665 L: a rod is not longer
        marlin R141.2000 ⇒ R-1 ⇒ config.g:3: M665 R: the value is not a number above 0
        reprapfirmware L330.1: ⇒ Lhunter2: ⇒ config.g:4: M665: a word is not a letter
        marlin B0.3000 ⇒ B120 ⇒ config.g:3: M665 B: B lengthens the rods of a tower since Marlin 2.0, and 120 mm
        marlin A0.0000 ⇒ A12 ⇒ config.g:3: M665 A: A lengthens the rods of a tower since Marlin 2.0, and 12 mm
        ";
    for [from, to, cause] in cases(table) {
        let (controller, from) = from.split_once(' ').unwrap();
        let text = match controller {
            "marlin" => MARLIN,
            _ => REPRAPFIRMWARE,
        };
        let folder = Folder::new();
        folder.write("config.g", text.replace(from, &to));
        let case = format!("{controller} config.g --output mine ⇒ 3 ⇒ {cause}");
        assert_refused(&folder, "import", &case);
        let said = folder.run(&format!("import {controller} config.g --output mine"));
        assert!(!said.stderr.contains("hunter2"), "{}", said.stderr);
    }
}
