//! The LinuxCNC kinematics component, compiled by LinuxCNC's compiler and run by its motion controller.

#![cfg(target_os = "linux")]

use crate::support::{
    Arm, Folder, Point, distance, platform, poses, robot_toml, rows_of, true_arms,
};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};

/// Only one LinuxCNC can run on a machine.
static ALONE: Mutex<()> = Mutex::new(());

const HOST: &str = env!("CARGO_MANIFEST_DIR");

fn component() -> PathBuf {
    Path::new(HOST).join("../bindings/c/linuxcnc")
}

/// Runs with private mounts, shared memory and processes; without root, in a namespace in which the user is root.
fn private() -> Command {
    let mut command = Command::new("unshare");
    let uid = Command::new("id").arg("-u").output().unwrap().stdout;
    if uid.trim_ascii() != b"0" {
        command.args(["--user", "--map-root-user"]);
    }
    command.args(
        "--mount --ipc --net --pid --fork --kill-child --mount-proc".split_ascii_whitespace(),
    );
    command.stdin(Stdio::null());
    command
}

/// Whether LinuxCNC cannot be run here; says why.
fn skipped() -> bool {
    let found = |program: &str| Command::new(program).arg("-h").output().is_ok();
    let why = if found("halcompile") && found("linuxcnc") {
        // Tries to become another user inside, as private.sh does.
        let inside = "unshare --user --map-user=1000 true";
        match private().args(inside.split_ascii_whitespace()).output() {
            Ok(output) if output.status.success() => return false,
            Ok(output) => format!(
                "this system allows no private mounts: {}",
                text(&output).trim()
            ),
            Err(error) => format!("unshare: {error}"),
        }
    } else {
        "the Debian package linuxcnc-uspace-dev is not installed".to_owned()
    };
    println!("skipped: {why}");
    true
}

fn text(output: &Output) -> String {
    let both = [&output.stdout[..], &output.stderr[..]].concat();
    String::from_utf8_lossy(&both).into_owned()
}

/// LinuxCNC's output and the rows written by the display: joint angles (degrees) and position, or `None` where LinuxCNC
/// refused.
struct Driven {
    printed: String,
    rows: Vec<Option<(Point, Point)>>,
}

/// Runs the machine of `bindings/c/linuxcnc/sim` in a folder with `robot.hal` and the display's other input files.
fn drive(folder: &Folder, display: &str, change: impl Fn(String) -> String) -> Driven {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let build = Path::new(env!("CARGO_TARGET_TMPDIR")).join("linuxcnc");
    let made = Command::new("make")
        .args(["--silent", "--directory"])
        .arg(component())
        .arg(format!("BUILD={}", build.display()))
        .output()
        .unwrap();
    assert!(made.status.success(), "{}", text(&made));

    for name in ["delta.hal", "drive.py"] {
        std::fs::copy(component().join("sim").join(name), folder.path(name)).unwrap();
    }
    let ini = std::fs::read_to_string(component().join("sim/delta.ini")).unwrap();
    let stated = "DISPLAY = ./drive.py driven.csv positions.csv";
    assert!(ini.contains(stated));
    let ini = ini.replace(
        stated,
        &format!("DISPLAY = ./drive.py driven.csv {display}"),
    );
    folder.write("delta.ini", change(ini));

    let run = private()
        .arg("sh")
        .arg(Path::new(HOST).join("tests/it/linuxcnc/private.sh"))
        .args([component(), build, folder.path("")])
        .output()
        .unwrap();
    let printed = text(&run);
    assert!(
        folder.names().contains(&"driven.csv".to_owned()),
        "{printed}"
    );
    let rows = folder.read("driven.csv");
    let rows = rows.lines().skip(1).map(|line| {
        if line.starts_with('#') {
            println!("{line}");
            return None;
        }
        let row = &rows_of(&format!("header\n{line}\n"))[0];
        Some(([row[0], row[1], row[2]], [row[3], row[4], row[5]]))
    });
    let rows = rows.collect();
    Driven { printed, rows }
}

/// Tolerance of joint angles, radians: pins resolve 1e-9 mm and degrees, 1e-11 of these robots' arms.
const JOINTS: f64 = 1e-9;
/// Tolerance of positions, mm.
const POSITION: f64 = 1e-6;

/// Large errors of the kinds that no other controller can represent: tilt, and arm planes off the z axis.
fn far_off() -> [Arm; 3] {
    let mut arms = true_arms();
    let off = [
        [12.0, -9.0, 15.0, 4.0, 3.0, -8.0, 20.0, 6.0],
        [-7.0, 5.0, -11.0, -3.0, -4.0, 9.0, -15.0, -12.0],
        [4.0, 10.0, 8.0, 2.0, 5.0, -14.0, 9.0, 15.0],
    ];
    for (arm, off) in arms.iter_mut().zip(off) {
        for (value, by) in arm.iter_mut().zip(off) {
            *value += by;
        }
    }
    arms
}

/// Positions per robot: LinuxCNC takes a tenth of a second for each.
const POSITIONS: usize = 24;

/// Joint angles and the positions that Newton's method gives for them, within 250 mm of the robot's axis.
fn wanted(arms: &[Arm; 3]) -> Vec<(Point, Point)> {
    let all = poses(80).into_iter().map(|q| (q, platform(arms, q)));
    let near = all.filter(|(_, at)| at[0].hypot(at[1]) < 250.0);
    let wanted: Vec<_> = near.take(POSITIONS).collect();
    assert_eq!(wanted.len(), POSITIONS);
    wanted
}

fn positions(wanted: &[(Point, Point)], unit: f64) -> String {
    let mut text = String::from("x_mm,y_mm,z_mm\n");
    for (_, [x, y, z]) in wanted {
        writeln!(text, "{},{},{}", x / unit, y / unit, z / unit).unwrap();
    }
    text
}

fn export(folder: &Folder, name: &str, arms: &[Arm; 3]) {
    folder.write(&format!("{name}.toml"), robot_toml(arms));
    folder
        .run(&format!(
            "export {name}.toml --for linuxcnc-component --output {name}.hal"
        ))
        .ok();
}

/// Checks the joint angles that LinuxCNC commanded against the robot's equations and `delta-cal inverse`.
fn assert_driven(
    folder: &Folder,
    (name, unit): (&str, f64),
    wanted: &[(Point, Point)],
    rows: &[Option<(Point, Point)>],
) {
    assert_eq!(rows.len(), wanted.len());
    folder.write("wanted.csv", positions(wanted, 1.0));
    let inverse = folder.run(&format!("inverse {name}.toml wanted.csv")).ok();
    let (mut worst_joint, mut worst_position) = (0.0, 0.0);
    for (((q, at), row), own) in wanted.iter().zip(rows).zip(rows_of(&inverse.stdout)) {
        let (driven, position) = row.unwrap();
        for k in 0..3 {
            for expected in [q[k], own[k]] {
                worst_joint = f64::max(worst_joint, (driven[k] - expected).to_radians().abs());
            }
        }
        worst_position = f64::max(worst_position, distance(position.map(|c| c * unit), *at));
    }
    println!("{name}: {worst_joint:.1e} rad, {worst_position:.1e} mm");
    assert!(worst_joint < JOINTS && worst_position < POSITION);
}

#[test]
fn linuxcnc_commands_the_joint_angles_of_the_robot() {
    if skipped() {
        return;
    }
    let folder = Folder::new();
    let robots = [("robot", true_arms()), ("far_off", far_off())];
    for (name, arms) in &robots {
        export(&folder, name, arms);
        folder.write(&format!("{name}.csv"), positions(&wanted(arms), 1.0));
    }
    // Another robot's parameters on the pins: while the machine is on they wait until it is off. Then without the revision that
    // activates them, and an impossible robot.
    folder.write("far_off.on.hal", folder.read("far_off.hal"));
    folder.write("off.hal", "");
    let half = folder.read("robot.hal");
    let half = half.replace("setp deltacalkins.revision", "# ");
    folder.write("half.hal", &half);
    folder.write(
        "none.hal",
        "setp deltacalkins.arm3.lb -480\nsetp deltacalkins.revision 5\n",
    );
    folder.write("beyond.csv", "x_mm,y_mm,z_mm\n0,0,-2000\n0,0,-450\n");
    let driven = drive(
        &folder,
        "robot.csv far_off.on.hal robot.csv off.hal far_off.csv half.hal far_off.csv none.hal far_off.csv beyond.csv",
        |ini| ini,
    );
    let printed = &driven.printed;
    let mut rows = driven.rows.chunks(POSITIONS);
    for name in ["robot", "robot", "far_off", "far_off", "far_off"] {
        let (_, arms) = robots.iter().find(|(own, _)| *own == name).unwrap();
        let chunk = rows.next().unwrap_or_else(|| panic!("{printed}"));
        assert_driven(&folder, (name, 1.0), &wanted(arms), chunk);
    }
    let cause = "revision 5 is not taken over: The length of an upper arm or forearm is not greater than 0.";
    assert!(printed.contains(cause), "{printed}");
    // LinuxCNC refuses an unreachable position and carries on.
    let [None, Some(_)] = rows.next().unwrap() else {
        panic!("{printed}");
    };
    assert!(printed.contains("fails kinematicsInverse"), "{printed}");
}

#[test]
fn a_machine_in_inches_moves_the_same_robot() {
    if skipped() {
        return;
    }
    let folder = Folder::new();
    export(&folder, "robot", &true_arms());
    let lines = folder.read("robot.hal");
    folder.write(
        "robot.hal",
        format!("setp deltacalkins.units-per-mm {}\n{lines}", 1.0 / 25.4),
    );
    let wanted = wanted(&true_arms());
    folder.write("positions.csv", positions(&wanted, 25.4));
    let driven = drive(&folder, "positions.csv", |ini| {
        assert!(ini.contains("LINEAR_UNITS = mm"));
        ini.replace("LINEAR_UNITS = mm", "LINEAR_UNITS = inch")
    });
    assert_driven(&folder, ("robot", 25.4), &wanted, &driven.rows);
}

#[test]
fn without_one_of_the_lines_nothing_moves() {
    if skipped() {
        return;
    }
    let folder = Folder::new();
    export(&folder, "robot", &true_arms());
    let lines = folder.read("robot.hal");
    let lines = lines.lines().filter(|line| !line.contains("arm2.dz "));
    let lines: Vec<_> = lines.collect();
    folder.write("robot.hal", lines.join("\n") + "\n");
    folder.write("positions.csv", "x_mm,y_mm,z_mm\n0,0,-450\n0,0,-400\n");
    let driven = drive(&folder, "positions.csv", |ini| ini);
    assert!(
        driven.printed.contains("arm2.dz is not set"),
        "{}",
        driven.printed
    );
    assert_eq!(driven.rows, [None, None]);
}
