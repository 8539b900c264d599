//! Robots to export, and positions where they are wanted.

use crate::support::{
    Arm, Folder, KEYS, Point, arms_of, arms_toml, nominal_arms, platform, robot_toml,
};
use delta_cal::simulate::standard_normal;
use delta_cal_host::InputText;
use delta_cal_host::files::robot_file::RobotFile;
use delta_cal_tests::uniform;
use rand_pcg::Pcg32;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

/// The built-in example, calibrated by the command.
pub(crate) fn example(folder: &Folder) {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/paper-robot");
    for name in ["robot.toml", "samples.csv"] {
        folder.write(name, std::fs::read(examples.join(name)).unwrap());
    }
    folder
        .run("calibrate robot.toml samples.csv --output calibrated.toml")
        .ok();
}

/// The nominal robot with the upper arm of arm 2 longer by 1 mm.
pub(crate) fn one_arm_longer(folder: &Folder) {
    let mut arms = nominal_arms();
    folder.write("robot.toml", robot_toml(&arms));
    arms[1][5] += 1.0;
    folder.write("calibrated.toml", robot_toml(&arms));
}

/// A robot with towers: for each x, y, zero, leans (degrees), scale and rod.
pub(crate) type Towers = [[f64; 7]; 3];

/// What every controller holds.
pub(crate) fn upright() -> Towers {
    let rods = [330.2, 329.7, 330.5];
    let azimuths = [210.4, 329.7, 90.2];
    let zeros = [0.8, -1.1, 0.4];
    [0, 1, 2].map(|k| {
        let (sin, cos) = f64::to_radians(azimuths[k]).sin_cos();
        [140.6 * cos, 140.6 * sin, zeros[k], 0.0, 0.0, 1.0, rods[k]]
    })
}

/// What none does.
pub(crate) fn leaning() -> Towers {
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

/// One of these, and the symmetric robot before its calibration.
pub(crate) fn with_towers(folder: &Folder, towers: &Towers) {
    let even = upright().map(|[x, y, ..]| [x, y, 0.0, 0.0, 0.0, 1.0, 330.0]);
    let keys = [
        "dx_mm",
        "dy_mm",
        "dz_mm",
        "lean_x_deg",
        "lean_y_deg",
        "scale",
        "lb_mm",
    ];
    for (name, towers) in [("robot.toml", &even), ("calibrated.toml", towers)] {
        let mut text = arms_toml(keys, towers);
        text += "[joints]\nmin_mm = 150\nmax_mm = 715\n";
        text += "[tolerance]\nlength_mm = 0.5\nangle_deg = 0.17\nzero_mm = 5\nscale = 0.001\n";
        folder.write(name, text);
    }
    folder.write("wanted.csv", csv(&printed()));
}

/// Positions in the printed volume.
pub(crate) fn printed() -> Vec<Point> {
    let position = |index: i32| {
        let index = f64::from(index);
        let (out, turn) = (120.0 * (index / 120.0).sqrt(), 2.4 * index);
        let height = 250.0 * (0.618 * index).fract();
        [out * turn.cos(), out * turn.sin(), height]
    };
    (0..120).map(position).collect()
}

/// Where the calibrated robot is at its joints: degrees, or mm of travel.
pub(crate) fn forward(folder: &Folder) -> Box<dyn Fn(Point) -> Point> {
    let text = folder.read("calibrated.toml");
    if text.contains("theta_deg") {
        let arms = arms_of(&text);
        return Box::new(move |joints| platform(&arms, joints));
    }
    let robot = RobotFile::read(&InputText::new("calibrated.toml", &text)).unwrap();
    Box::new(move |joints| robot.robot.forward(&joints).unwrap().into())
}

/// A robot made to 0.5 mm and 0.2°, one σ.
pub(crate) fn made(rng: &mut Pcg32) -> [Arm; 3] {
    let mut arms = nominal_arms();
    for arm in &mut arms {
        for (key, value) in KEYS.iter().zip(arm) {
            let sigma = if key.ends_with("deg") { 0.2 } else { 0.5 };
            *value += sigma * standard_normal::<f64, _>(rng);
        }
    }
    arms
}

/// Positions of a robot within 250 mm of its axis, in mm.
pub(crate) fn positions(arms: &[Arm; 3], count: usize, rng: &mut Pcg32) -> Vec<Point> {
    let mut found = Vec::new();
    while found.len() < count {
        let q = [(); 3].map(|()| 15.0 + 50.0 * uniform(rng));
        let at = platform(arms, q);
        if at[0].hypot(at[1]) < 250.0 {
            found.push(at);
        }
    }
    found
}

pub(crate) fn csv(positions: &[Point]) -> String {
    let mut text = String::from("x_mm,y_mm,z_mm\n");
    for [x, y, z] in positions {
        writeln!(text, "{x},{y},{z}").unwrap();
    }
    text
}

/// The lines and the report of an export of `calibrated.toml`.
pub(crate) fn export(folder: &Folder, target: &str, options: &str) -> (String, Value) {
    let command = format!(
        "export calibrated.toml --nominal robot.toml --for {target} --output lines.txt --json report.json {options}"
    );
    folder.run(&command).ok();
    let (lines, report) = (folder.read("lines.txt"), folder.json("report.json"));
    // All of the template is filled in.
    assert!(!(lines + &report["warnings"].to_string()).contains('{'));
    (folder.read("lines.txt"), report)
}
