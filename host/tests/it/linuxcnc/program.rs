//! LinuxCNC, run without a screen and without a trace in the system.

use crate::support::{Folder, Point, rows_of};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};

/// One machine runs one LinuxCNC.
static ALONE: Mutex<()> = Mutex::new(());

fn manifest(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn component() -> PathBuf {
    manifest("../bindings/c/linuxcnc")
}

/// Private mounts, shared memory and processes; for a user who is not root, in a namespace in which he is.
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

/// Why LinuxCNC cannot be run here.
pub(crate) fn missing() -> Option<String> {
    let found = |program: &str| {
        let run = Command::new(program).arg("-h").output();
        run.is_ok()
    };
    if !found("halcompile") || !found("linuxcnc") {
        return Some("the Debian package linuxcnc-uspace-dev is not installed".to_owned());
    }
    // Inside, as private.sh does, another user.
    let tried = private()
        .args("unshare --user --map-user=1000 true".split_ascii_whitespace())
        .output();
    match tried {
        Ok(output) if output.status.success() => None,
        Ok(output) => Some(format!(
            "this system allows no private mounts: {}",
            String::from_utf8_lossy(&output.stderr).trim()
        )),
        Err(error) => Some(format!("unshare: {error}")),
    }
}

fn text(output: &Output) -> String {
    let both = [&output.stdout[..], &output.stderr[..]].concat();
    String::from_utf8_lossy(&both).into_owned()
}

/// What LinuxCNC printed, and the rows that the display wrote: joint angles (degrees) and position, or `None` where
/// LinuxCNC refused.
pub(crate) struct Driven {
    pub(crate) printed: String,
    pub(crate) rows: Vec<Option<(Point, Point)>>,
}

/// Runs the machine of `bindings/c/linuxcnc/sim` in a folder that holds its `robot.hal` and whatever else the display reads.
pub(crate) fn drive(folder: &Folder, display: &str, change: impl Fn(String) -> String) -> Driven {
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
        .arg(manifest("tests/it/linuxcnc/private.sh"))
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
