//! Robots with towers, exported: the lines read again and computed by each controller's own kinematics.

use crate::export::controllers::words;
use crate::export::klipper::Delta;
use crate::export::robots::{csv, example, export};
use crate::support::{Folder, Point, assert_refused, distance, number};
use delta_cal_host::InputText;
use delta_cal_host::files::robot_file::RobotFile;
use serde_json::Value;
use std::fmt::Write;

const HOME: Point = [712.0, 711.5, 712.4];

/// Seven parameters an arm: x, y, zero, leans (degrees), scale, rod.
fn robot_toml(arms: &[[f64; 7]; 3]) -> String {
    let keys = [
        "dx_mm",
        "dy_mm",
        "dz_mm",
        "lean_x_deg",
        "lean_y_deg",
        "scale",
        "lb_mm",
    ];
    let mut text = String::new();
    for arm in arms {
        text += "[[arm]]\n";
        for (key, value) in keys.iter().zip(arm) {
            writeln!(text, "{key} = {value:?}").unwrap();
        }
    }
    text + "[joints]\nmin_mm = 150\nmax_mm = 715\n[tolerance]\nlength_mm = 0.5\nangle_deg = 0.17\nzero_mm = 5\n\
            scale = 0.001\n"
}

/// What every controller holds.
fn upright() -> [[f64; 7]; 3] {
    let rods = [330.2, 329.7, 330.5];
    let azimuths = [210.4, 329.7, 90.2];
    let zeros = [0.8, -1.1, 0.4];
    [0, 1, 2].map(|k| {
        let (sin, cos) = f64::to_radians(azimuths[k]).sin_cos();
        [140.6 * cos, 140.6 * sin, zeros[k], 0.0, 0.0, 1.0, rods[k]]
    })
}

/// What none does.
fn leaning() -> [[f64; 7]; 3] {
    let mut arms = upright();
    let off = [
        [0.1, -0.05, 1.0006],
        [-0.07, 0.12, 0.9996],
        [0.05, 0.03, 1.0002],
    ];
    for (arm, off) in arms.iter_mut().zip(off) {
        arm[3..6].copy_from_slice(&off);
        arm[0] += 0.3;
    }
    arms
}

/// The printer that a controller takes its lines for.
fn read(target: &str, lines: &str) -> Delta {
    let step_lengths = [1.0; 3];
    if target == "klipper" {
        return Delta::pasted(lines, step_lengths);
    }
    let (m665, m666) = (words(lines, "M665"), words(lines, "M666"));
    let height = m665[&'H'][0];
    let axes = ['X', 'Y', 'Z'];
    let stops = axes.map(|axis| m666[&axis][0]);
    let (arms, endstops) = if target == "reprapfirmware" {
        // Each end stop is higher by M666.
        assert!((stops.iter().sum::<f64>()).abs() < 2e-4);
        let arms = [0, 1, 2].map(|k| m665[&'L'][k]);
        (arms, stops.map(|by| height + by))
    } else {
        // Marlin moves each carriage by M666 after its end stop, never upwards, and is then at H.
        assert!(stops.iter().all(|by| *by <= 0.0) && !m665.contains_key(&'S'));
        let arms = ['A', 'B', 'C'].map(|rod| m665[&'L'][0] + m665[&rod][0]);
        (arms, stops.map(|by| height - by))
    };
    Delta {
        radius: m665[&'R'][0],
        angles: [0, 1, 2].map(|k| [210.0, 330.0, 90.0][k] + m665[&axes[k]][0]),
        arms,
        endstops,
        step_lengths,
    }
}

fn exported(folder: &Folder, target: &str, options: &str) -> (Delta, Value) {
    let [a, b, c] = HOME;
    let options = format!("--home {a},{b},{c} --positions wanted.csv {options}");
    let (lines, report) = export(folder, target, &options);
    (read(target, &lines), report)
}

fn wanted() -> Vec<Point> {
    let mut positions = Vec::new();
    for index in 0..120 {
        let index = f64::from(index);
        let (out, turn) = (120.0 * (index / 120.0).sqrt(), 2.4 * index);
        positions.push([
            out * turn.cos(),
            out * turn.sin(),
            250.0 * (0.618 * index).fract(),
        ]);
    }
    positions
}

fn prepared(arms: &[[f64; 7]; 3]) -> (Folder, RobotFile) {
    let folder = Folder::new();
    let even = upright().map(|[x, y, ..]| [x, y, 0.0, 0.0, 0.0, 1.0, 330.0]);
    folder.write("robot.toml", robot_toml(&even));
    folder.write("calibrated.toml", robot_toml(arms));
    folder.write("wanted.csv", csv(&wanted()));
    let robot = RobotFile::read(&InputText::new("calibrated.toml", &robot_toml(arms))).unwrap();
    (folder, robot)
}

/// rms and worst distance, with the lines' own kinematics: steps from the end stops lead to travels.
fn lost(robot: &RobotFile, klipper: &Delta, frame: &Value) -> (f64, f64) {
    let shift = [0, 1].map(|k| frame["shift_mm"][k].as_f64().unwrap());
    let (mut sum, mut worst) = (0.0, 0.0);
    for at in wanted() {
        let commanded = [at[0] + shift[0], at[1] + shift[1], at[2]];
        let steps = klipper.steps(commanded);
        let travels = [0, 1, 2].map(|k| HOME[k] - steps[k]);
        let is = robot.robot.forward(&travels).unwrap();
        let off = distance([is.x, is.y, is.z], at);
        sum += off * off;
        worst = f64::max(worst, off);
    }
    (f64::sqrt(sum / 120.0), worst)
}

/// Lengths are written to 0.0001 mm and angles to 0.0001°, some ten of them.
const ROUNDING: f64 = 0.002;

/// What every controller holds loses nothing but rounding. Leans and scales are lost, and far less than not calibrating
/// loses.
#[test]
fn the_stated_loss_is_that_of_the_lines() {
    for arms in [upright(), leaning()] {
        let (folder, robot) = prepared(&arms);
        for target in ["klipper", "reprapfirmware", "marlin"] {
            let (klipper, report) = exported(&folder, target, "");
            let found = lost(&robot, &klipper, &report["frame"]);
            for (key, found, rounding) in [
                ("loss/rms_mm", found.0, ROUNDING),
                ("loss/worst_mm", found.1, 2.0 * ROUNDING),
            ] {
                let off = (found - number(&report, key)).abs();
                assert!(off < rounding, "{target}, {key}: {found}");
            }
            assert_eq!(report["fitted_parameters"], 10);
            let (rms, worst) = found;
            if arms == upright() {
                assert!(
                    rms < ROUNDING && worst < 2.0 * ROUNDING,
                    "{target}: {found:?}"
                );
                for (rod, own) in klipper.arms.iter().zip(arms) {
                    assert!((rod - own[6]).abs() < 0.01, "{target}: {rod}");
                }
            } else {
                let before = number(&report, "not_calibrated/rms_mm");
                assert!(rms > 0.02 && rms < 0.5 * before, "{target}: {rms}");
            }
        }
    }
}

/// Heights above a tilted bed: exported, the bed is z = 0 and level.
#[test]
fn the_bed_of_measured_heights_is_z_0() {
    let (folder, robot) = prepared(&leaning());
    let (slope_x, slope_y, at_centre) = (0.004, -0.003, 2.5);
    let bed = |x: f64, y: f64| at_centre + slope_x * x + slope_y * y;
    let mut samples = String::from("s1_mm,s2_mm,s3_mm,height_mm\n");
    for (index, [x, y, _]) in wanted().into_iter().enumerate().step_by(9) {
        let height = if index % 2 == 0 { 0.0 } else { 20.0 };
        // Along the bed's normal.
        let up = height * f64::hypot(1.0, f64::hypot(slope_x, slope_y));
        let [a, b, c] = robot.robot.inverse(&[x, y, bed(x, y) + up].into()).unwrap();
        writeln!(samples, "{a},{b},{c},{height}").unwrap();
    }
    folder.write("heights.csv", samples);
    let (klipper, report) = exported(&folder, "klipper", "--bed heights.csv");
    let worst = number(&report, "loss/worst_mm");
    let mut off: f64 = 0.0;
    for [x, y, _] in wanted() {
        let steps = klipper.steps([0.7 * x, 0.7 * y, 0.0]);
        let is = robot
            .robot
            .forward(&[0, 1, 2].map(|k| HOME[k] - steps[k]))
            .unwrap();
        off = f64::max(off, (is.z - bed(is.x, is.y)).abs());
    }
    // Not further off than the stated loss, and far less than the 0.4 mm that the tilt alone makes.
    assert!(off < worst + ROUNDING && off < 0.2, "{off} {worst}");
}

#[test]
fn targets_refuse_the_other_drives_and_name_those_that_do_not() {
    let (folder, _) = prepared(&upright());
    let others = "3 ⇒ this robot has towers: it can be exported for klipper, reprapfirmware, marlin and correction-table";
    for target in ["b-and-r", "linuxcnc", "smoothieware", "codesys"] {
        let case = format!("calibrated.toml --for {target} ⇒ {others}");
        assert_refused(&folder, "export", &case);
    }
    folder
        .run("export calibrated.toml --for correction-table --positions wanted.csv")
        .ok();
    let no_heights = "calibrated.toml --for klipper --bed wanted.csv ⇒ 3 ⇒ wanted.csv";
    assert_refused(&folder, "export", no_heights);
    let rotary = Folder::new();
    example(&rotary);
    let table = "
        --for marlin ⇒ 3 ⇒ this robot has rotary arms: | klipper, reprapfirmware, b-and-r, linuxcnc
        --for klipper --bed samples.csv ⇒ 2 ⇒ only be used with towers
        ";
    assert_refused(&rotary, "export calibrated.toml", table);
}

/// Without --home, --bed and --positions the command says what it assumes.
#[test]
fn assumptions_are_stated() {
    let (folder, _) = prepared(&leaning());
    let run = folder.run("export calibrated.toml --for marlin").ok();
    for part in [
        "assumed at a travel of 715.000 mm",
        "with --bed",
        "within 119 mm of the",
        "M665 L",
    ] {
        assert!(run.stdout.contains(part), "{part}: {}", run.stdout);
    }
}
