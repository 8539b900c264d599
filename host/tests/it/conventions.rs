//! One robot in twelve conventions: every command says the same of it. Files are written and results turned back by what
//! is written here: z downwards turns the axes by 180° about x, joints that count upwards change their sign.

use crate::support::{
    Arm, Folder, KEYS, Point, arms_of, arms_toml, at, distance, nominal_arms, number, platform,
    poses, rows_of, true_arms,
};
use delta_cal_tests::{generator, is_long};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rand_core::Rng;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Counts per degree.
const COUNTS: Point = [10_000.0, -8_000.0, 1_234.5];

/// A convention of a robot file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Convention {
    z_down: bool,
    joints_up: bool,
    unit: &'static str,
}

const USUAL: Convention = Convention {
    z_down: false,
    joints_up: false,
    unit: "deg",
};

pub(crate) fn twelve() -> impl Iterator<Item = Convention> {
    (0..12).map(|number| Convention {
        z_down: number / 2 % 2 == 1,
        joints_up: number % 2 == 1,
        unit: ["deg", "rad", "counts"][number / 4],
    })
}

impl Convention {
    /// To the stated axes, and back.
    pub(crate) fn place(self, [x, y, z]: Point) -> Point {
        if self.z_down { [x, -y, -z] } else { [x, y, z] }
    }

    /// Of what changes its sign with z.
    fn z(self) -> f64 {
        if self.z_down { -1.0 } else { 1.0 }
    }

    pub(crate) fn sense(self) -> f64 {
        if self.joints_up { -1.0 } else { 1.0 }
    }

    fn joints(self, degrees: Point) -> Point {
        [0, 1, 2].map(|k| {
            let own = self.sense() * degrees[k];
            match self.unit {
                "rad" => own.to_radians(),
                "counts" => own * COUNTS[k],
                _ => own,
            }
        })
    }

    fn degrees(self, joints: Point) -> Point {
        [0, 1, 2].map(|k| {
            let own = self.sense() * joints[k];
            match self.unit {
                "rad" => own.to_degrees(),
                "counts" => own / COUNTS[k],
                _ => own,
            }
        })
    }

    /// An arm's y, z, azimuth and upward component of the upper arm change their signs.
    fn arm(self, arm: Arm) -> Arm {
        let [dx, dy, dz, theta, alpha, la_x, la_y, lb] = arm;
        let z = self.z();
        [dx, z * dy, z * dz, z * theta, alpha, la_x, z * la_y, lb]
    }

    pub(crate) fn robot(self, arms: &[Arm; 3], datum: &[(Point, Point)]) -> String {
        let mut text = String::from("[convention]\n");
        let word = |turned: bool, one, other| if turned { other } else { one };
        let _ = writeln!(
            text,
            "joint_positive = \"{}\"\nz_axis = \"{}\"\njoint_unit = \"{}\"",
            word(self.joints_up, "down", "up"),
            word(self.z_down, "up", "down"),
            self.unit
        );
        if self.unit == "counts" {
            let _ = writeln!(text, "counts_per_deg = {COUNTS:?}");
        }
        text += &arms_toml(KEYS, &arms.map(|arm| self.arm(arm)));
        let (low, high) = if self.joints_up { (-90, 60) } else { (-60, 90) };
        let within = word(self.z_down, "-620..-420", "420..620");
        let [x, y, z] = self.place([12.0, 5.0, -25.0]);
        let _ = write!(
            text,
            "[platform]\nradius_mm = 30\n[joints]\nmin_deg = {low}\nmax_deg = {high}\n\
             [workspace]\nwithin = \"r=150,z={within}\"\n\
             [tolerance]\nlength_mm = 0.5\nangle_deg = 0.2\n\
             [noise]\nposition_mm = 0.02\njoint_deg = 0.001\n\
             [target]\nx_mm = {x:?}\ny_mm = {y:?}\nz_mm = {z:?}\nsigma_mm = 0.05\n"
        );
        for (index, (place, seen)) in datum.iter().enumerate() {
            let [x, y, z] = self.place(*place);
            let _ = write!(
                text,
                "[datum.D{index}]\nx_mm = {x:?}\ny_mm = {y:?}\nz_mm = {z:?}\nsensor_mm = {seen:?}\n"
            );
        }
        text
    }
}

fn nominal() -> [Arm; 3] {
    // Clockwise seen from above.
    [-90.0, 150.0, 30.0].map(|theta: f64| {
        let (sin, cos) = theta.to_radians().sin_cos();
        [164.0 * cos, 164.0 * sin, 0.0, theta, 0.0, 260.0, 0.0, 480.0]
    })
}

/// With the errors of [`true_arms`].
fn truth() -> [Arm; 3] {
    let (drawn, built, mut arms) = (nominal_arms(), true_arms(), nominal());
    let errors = built.as_flattened().iter().zip(drawn.as_flattened());
    for (value, (built, drawn)) in arms.as_flattened_mut().iter_mut().zip(errors) {
        *value += built - drawn;
    }
    arms
}

/// From the robot's frame to the tracker's.
fn tracker() -> (Rotation3<f64>, Vector3<f64>) {
    let turn = Rotation3::from_euler_angles(0.2, -0.4, 1.1);
    (turn, Vector3::new(2500.0, 400.0, -900.0))
}

/// What a tracker in its own frame reads: the same numbers whatever the robot's convention.
fn seen() -> [Vec<(Point, Point)>; 2] {
    let mut rng = generator(3, 54);
    let mut noise = move || 0.03 * (f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5);
    let (turn, shift) = tracker();
    let mut look = move |place: Point| -> Point {
        let at = turn * Vector3::from(place) + shift;
        [at.x + noise(), at.y + noise(), at.z + noise()]
    };
    let arms = truth();
    let rows = poses(50).into_iter().map(|q| {
        let [x, y, z] = platform(&arms, q);
        (q, look([x + 12.0, y + 5.0, z - 25.0]))
    });
    let rows = rows.collect();
    let places = [
        [400.0, 0.0, -400.0],
        [-300.0, 350.0, -500.0],
        [-200.0, -400.0, -300.0],
        [0.0, 0.0, -800.0],
    ];
    [rows, places.map(|place| (place, look(place))).into()]
}

/// Everything that the commands say, as in the usual convention.
#[derive(Default, Debug)]
struct Said(BTreeMap<String, Vec<f64>>);

impl Said {
    fn add(&mut self, what: impl Into<String>, values: impl IntoIterator<Item = f64>) {
        self.0
            .entry(what.into())
            .or_default()
            .extend(values.into_iter().map(|own| own + 0.0));
    }
}

fn three(json: &Value, path: &str) -> Point {
    [0, 1, 2].map(|k| number(json, &format!("{path}/{k}")))
}

/// Rows of numbers, of which the first columns are.
fn table(csv: &str, columns: usize) -> Vec<Vec<f64>> {
    let rows = csv.lines().filter(|line| !line.starts_with('#')).skip(1);
    let cells = |line: &str| {
        let cells = line.split(',').take(columns);
        cells.map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()
    };
    rows.map(cells).collect()
}

fn first_three(row: &[f64]) -> Point {
    [row[0], row[1], row[2]]
}

/// The motion from the robot's frame in the usual axes to the controller's, as an export states it.
fn motion(own: Convention, export: &Value) -> [f64; 12] {
    let [a, b, c] = three(export, "frame/turn_deg").map(f64::to_radians);
    let turn = Rotation3::from_euler_angles(a, b, c).into_inner();
    let axes = Matrix3::from_diagonal(&own.place([1.0; 3]).into());
    let mut all = [0.0; 12];
    all[..9].copy_from_slice((turn * axes).as_slice());
    all[9..].copy_from_slice(&three(export, "frame/shift_mm"));
    all
}

#[expect(clippy::too_many_lines, reason = "one command after another")]
fn said(own: Convention) -> Said {
    let (folder, mut said) = (Folder::new(), Said::default());
    let [rows, datum] = seen();
    let names = match own.unit {
        "deg" => "q1_deg,q2_deg,q3_deg",
        "rad" => "q1_rad,q2_rad,q3_rad",
        _ => "q1_counts,q2_counts,q3_counts",
    };
    let csv = |rows: &[(Point, Point)]| {
        let mut text = format!("{names},x_mm,y_mm,z_mm\n");
        for (q, [x, y, z]) in rows {
            let [q1, q2, q3] = own.joints(*q);
            let _ = writeln!(text, "{q1:?},{q2:?},{q3:?},{x:?},{y:?},{z:?}");
        }
        text
    };
    folder.write("robot.toml", own.robot(&nominal(), &datum));
    folder.write("samples.csv", csv(&rows[..26]));
    folder.write("check.csv", csv(&rows[26..]));

    // calibrate
    folder
        .run("calibrate robot.toml samples.csv --frame sensor --json report.json --output calibrated.toml")
        .ok();
    let report = folder.json("report.json");
    for arm in 0..3 {
        for (index, key) in KEYS.iter().enumerate() {
            let at = |what: &str| number(&report, &format!("arms/{arm}/parameters/{index}/{what}"));
            let sign = own.arm([1.0; 8])[index];
            let values = ["before", "after", "change"].map(|what| sign * at(what));
            said.add(format!("{key} of arm {arm}"), values);
            said.add("sigma", [at("sigma")]);
        }
        let zero = |what: &str| number(&report, &format!("arms/{arm}/upper_arm/1/{what}"));
        let zeros = ["before", "after", "change"].map(|what| own.z() * zero(what));
        said.add("joint zero", zeros);
    }
    for path in ["absolute", "relative"] {
        let place = three(&report, &format!("expected_error/{path}_worst_at_mm"));
        said.add(path, own.place(place));
    }
    let rotation = [0, 1, 2].map(|row| {
        let own_row = three(&report, &format!("sensor_frame/rotation/{row}"));
        own.place(own_row)
    });
    said.add("sensor frame", rotation.concat());
    said.add(
        "sensor frame",
        three(&report, "sensor_frame/translation_mm"),
    );
    let arms = arms_of(&folder.read("calibrated.toml")).map(|arm| own.arm(arm));
    said.add("calibrated.toml", arms.concat());
    for pose in at(&report, "next_poses").as_array().unwrap() {
        said.add("next poses", own.degrees(three(pose, "joints")));
    }

    // validate
    let run = "validate calibrated.toml check.csv --frame stored --limit 0.2mm --json -";
    let check = folder.run(run).ok().json();
    said.add("validate", [number(&check, "rms_error/estimate_mm")]);
    let [low, high] = [0, 1].map(|end| {
        own.place([0, 1, 2].map(|axis| number(&check, &format!("region_mm/{axis}/{end}"))))
    });
    said.add("region", [0, 1, 2].map(|k| low[k].min(high[k])));
    said.add("region", [0, 1, 2].map(|k| low[k].max(high[k])));

    // forward and inverse
    let forward = folder.run("forward calibrated.toml check.csv").ok().stdout;
    let exact = rows_of(&forward);
    for row in &exact {
        said.add("forward", own.place([row[3], row[4], row[5]]));
    }
    let inverse = folder
        .run_where("inverse calibrated.toml -", &forward, &[])
        .ok();
    for (row, (q, _)) in rows_of(&inverse.stdout).iter().zip(&rows[26..]) {
        let off = distance(own.degrees(first_three(row)), *q);
        assert!(off < 1e-4, "{own:?}: {off}");
    }

    // plan
    let run = "plan robot.toml --frame sensor --count 8 --output - --within r=120,z=";
    let within = if own.z_down { "430..600" } else { "-600..-430" };
    let plan = folder.run(&format!("{run}{within}")).ok().stdout;
    let header = plan.lines().next().unwrap().split(',');
    let nominal_x = header
        .clone()
        .position(|name| name == "_nominal_x_mm")
        .unwrap();
    for row in table(&plan, 99) {
        said.add("plan", own.degrees(first_three(&row)));
        // In the tracker's frame, which the datum points give.
        said.add("plan", first_three(&row[nominal_x..]));
    }

    // workspace
    let run = "workspace robot.toml --tolerance 1mm --spacing 60mm --json - --output workspace";
    let space = folder.run(run).ok().json();
    for (axis, sign) in [("x", 1.0), ("y", own.z()), ("z", own.z())] {
        let ends = [0, 1].map(|end| sign * number(&space, &format!("extent_mm/{axis}/{end}")));
        said.add("extent", [ends[0].min(ends[1]), ends[0].max(ends[1])]);
    }
    let boundary = folder.read("workspace/boundary.csv");
    for row in table(&boundary, 3) {
        said.add("boundary", own.place(first_three(&row)));
    }
    let mut limits = ["joint_minimum", "joint_maximum"];
    if own.joints_up {
        limits.reverse();
    }
    let limits = limits.map(|limit| boundary.matches(limit).count() as f64);
    said.add("points at a limit", limits);
    for row in table(&folder.read("workspace/influence.csv"), 31)
        .iter()
        .step_by(17)
    {
        said.add("normal", own.place(first_three(&row[4..])));
        let signs = [own.arm([1.0; 8]); 3].concat();
        let by = signs.iter().zip(&row[7..]).map(|(sign, by)| sign * by);
        said.add("influence", by.collect::<Vec<_>>());
    }

    // export
    let bandr = folder.run("export calibrated.toml --for b-and-r --json - --output lines.txt");
    let bandr = bandr.ok().json();
    for entry in at(&bandr, "parameters").as_array().unwrap() {
        let (name, value) = (entry["name"].as_str().unwrap(), number(entry, "value"));
        let value = match name {
            // Any turn is the same.
            _ if name.ends_with("Angle") => (own.z() * value).rem_euclid(360.0),
            _ if name.ends_with('Z') || name.ends_with("Flange.Y") => own.z() * value,
            _ if name.starts_with("Offsets") => own.sense() * value,
            _ => value,
        };
        said.add(name, [value]);
    }
    let counted = folder.read("lines.txt").contains("= Inverse");
    assert_eq!(counted, own.joints_up);
    let [x, y, z] = three(&bandr, "frame/shift_mm");
    said.add("frame of b-and-r", own.place([x, y, z]));
    said.add(
        "loss",
        own.place(three(&bandr, "not_calibrated/worst_at_mm")),
    );
    // Klipper's z points upwards.
    let home = if own.joints_up { "30" } else { "-30" };
    let klipper = format!("export calibrated.toml --for klipper --home {home} --json -");
    let klipper = folder.run(&klipper).ok().json();
    for entry in at(&klipper, "parameters").as_array().unwrap() {
        said.add("klipper", [number(entry, "value")]);
    }
    said.add("motion to klipper", motion(own, &klipper));
    let mut wanted = String::from("x_mm,y_mm,z_mm\n");
    for row in &exact {
        let _ = writeln!(wanted, "{},{},{}", row[3], row[4], row[5]);
    }
    folder.write("wanted.csv", wanted);
    let run = "export calibrated.toml --for correction-table --nominal robot.toml --positions wanted.csv --limit 0.05mm";
    let mut nodes: Vec<_> = table(&folder.run(run).ok().stdout, 6)
        .into_iter()
        .map(|row| {
            let at = own.place(first_three(&row)).map(|own| own + 0.0);
            (at, own.place(first_three(&row[3..])))
        })
        .collect();
    nodes.sort_by(|a, b| a.partial_cmp(b).unwrap());
    for (node, by) in nodes {
        said.add("nodes", node);
        said.add("corrections", by);
    }
    said
}

/// What the commands read and write is in the stated convention, whatever it is.
#[test]
fn all_commands_say_the_same_in_twelve_conventions() {
    let usual = said(USUAL);
    // The tracker stood there: 4 points and 26 rows say that to some hundredths of a millimetre.
    let (turn, shift) = tracker();
    let turn = turn.into_inner().transpose();
    let expected = turn.iter().chain(&shift).copied();
    for (index, (found, expected)) in usual.0["sensor frame"].iter().zip(expected).enumerate() {
        let off = if index < 9 { 5e-4 } else { 0.2 };
        assert!((found - expected).abs() < off, "{found} {expected}");
    }
    // The short campaign has every pair of these: for each unit two that differ in both.
    let differs = |own: &Convention| own.z_down != own.joints_up;
    let short = |own: &Convention| differs(own) == (own.unit == "rad");
    for own in twelve().filter(|own| is_long() || short(own)) {
        let found = said(own);
        assert!(found.0.keys().eq(usual.0.keys()), "{own:?}");
        for (what, values) in &found.0 {
            let expected = &usual.0[what];
            assert_eq!(values.len(), expected.len(), "{what}: {own:?}");
            for (index, (a, b)) in values.iter().zip(expected).enumerate() {
                // Files are written to 6 decimals; the minimiser ends within 1e-6.
                let same = (a - b).abs() < 2e-4 || (a.is_nan() && b.is_nan());
                assert!(same, "{what}, {index}: {a} in place of {b}, {own:?}");
            }
        }
    }
}
