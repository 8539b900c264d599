//! Robots to export, and positions where they are wanted.

use crate::support::{Arm, Folder, KEYS, Point, nominal_arms, platform, robot_toml};
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

/// Numbers in [0, 1) from a fixed sequence.
pub(crate) struct Sequence(u64);

impl Sequence {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(self.0 >> 32).unwrap()) / 4_294_967_296.0
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// A robot made to 0.5 mm and 0.2°, one σ.
pub(crate) fn made(sequence: &mut Sequence) -> [Arm; 3] {
    let mut arms = nominal_arms();
    for arm in &mut arms {
        for (key, value) in KEYS.iter().zip(arm) {
            let sigma = if key.ends_with("deg") { 0.2 } else { 0.5 };
            *value += sigma * sequence.normal();
        }
    }
    arms
}

/// Positions of a robot within 250 mm of its axis, in mm.
pub(crate) fn positions(arms: &[Arm; 3], count: usize, sequence: &mut Sequence) -> Vec<Point> {
    let mut found = Vec::new();
    while found.len() < count {
        let q = [(); 3].map(|()| -35.0 + 100.0 * sequence.uniform());
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
    (folder.read("lines.txt"), folder.json("report.json"))
}
