//! Runs the command, and computes what it should find without its code: the elbows from the
//! equations of Model 24, the platform by Newton's method on the three sphere equations.

pub(crate) mod schema;
pub(crate) mod simulated;

use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// dx, dy, dz, theta, alpha, la_x, la_y, lb; millimetres and degrees.
pub(crate) type Arm = [f64; 8];
pub(crate) type Point = [f64; 3];

pub(crate) const KEYS: [&str; 8] = [
    "dx_mm",
    "dy_mm",
    "dz_mm",
    "theta_deg",
    "alpha_deg",
    "la_x_mm",
    "la_y_mm",
    "lb_mm",
];

pub(crate) const NOMINAL: &str = include_str!("../../files/nominal.toml");
/// A robot with towers.
pub(crate) const TOWERS: &str = include_str!("../../files/towers.toml");
/// A robot that is measured with a plate, a wire or a bar.
pub(crate) const TO_MEASURE: &str = include_str!("../../files/to-measure.toml");
pub(crate) const NOISE: &str = "\n[noise]\nposition_mm = 0.01\njoint_deg = 0.0\n";
pub(crate) const TOLERANCE: &str = "\n[tolerance]\nlength_mm = 0.5\nangle_deg = 0.2\n";

/// What stands in configurations and no command may tell.
const SECRETS: [&str; 4] = ["hunter2", "usb-1a86", "abc:TOKEN", "homesweethome"];

pub(crate) const HEADER: &str = "q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm\n";

pub(crate) fn nominal_arms() -> [Arm; 3] {
    [0.0, 120.0, 240.0].map(|theta: f64| {
        let (sin, cos) = theta.to_radians().sin_cos();
        [164.0 * cos, 164.0 * sin, 0.0, theta, 0.0, 260.0, 0.0, 480.0]
    })
}

/// A robot that differs from the nominal one by up to 0.9 mm and 0.25°.
pub(crate) fn true_arms() -> [Arm; 3] {
    let off = [
        [0.4, -0.3, 0.2, 0.10, -0.15, 0.5, -0.2, 0.7],
        [-0.6, 0.1, -0.4, -0.20, 0.25, -0.3, 0.4, -0.5],
        [0.2, 0.5, 0.3, 0.15, 0.05, -0.7, 0.1, 0.9],
    ];
    let mut arms = nominal_arms();
    for (arm, off) in arms.iter_mut().zip(off) {
        for (value, by) in arm.iter_mut().zip(off) {
            *value += by;
        }
    }
    arms
}

pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn distance(a: Point, b: Point) -> f64 {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    dot(d, d).sqrt()
}

/// B(q) = D + u cos q + v sin q.
pub(crate) fn elbow(arm: &Arm, q_deg: f64) -> Point {
    let [dx, dy, dz, theta, alpha, la_x, la_y, _] = *arm;
    let (st, ct) = theta.to_radians().sin_cos();
    let (sa, ca) = alpha.to_radians().sin_cos();
    let (sq, cq) = q_deg.to_radians().sin_cos();
    let ex = [ct, st, 0.0];
    let ez = [st * sa, -ct * sa, ca];
    let mut point = [dx, dy, dz];
    for k in 0..3 {
        let u = la_x * ex[k] + la_y * ez[k];
        let v = la_y * ex[k] - la_x * ez[k];
        point[k] += u * cq + v * sq;
    }
    point
}

/// The platform point, by Newton's method from far below.
pub(crate) fn platform(arms: &[Arm; 3], q_deg: Point) -> Point {
    let elbows = [0, 1, 2].map(|k| Vector3::from(elbow(&arms[k], q_deg[k])));
    let mut x = Vector3::new(0.0, 0.0, -600.0);
    for _ in 0..100 {
        let away = elbows.map(|elbow| (x - elbow).transpose());
        let off = Vector3::from_fn(|k, _| away[k].norm_squared() - arms[k][7].powi(2));
        let by_position = Matrix3::from_rows(&away) * 2.0;
        x -= by_position.lu().solve(&off).unwrap();
    }
    for (arm, elbow) in arms.iter().zip(elbows) {
        assert!(((x - elbow).norm() - arm[7]).abs() < 1e-9);
    }
    x.into()
}

/// `count` poses that fill the joints' range −35° to 65° evenly.
pub(crate) fn poses(count: u32) -> Vec<Point> {
    let steps: Point = [0.819_172_513_4, 0.671_043_606_7, 0.549_700_477_9];
    (1..=count)
        .map(|k| steps.map(|step| -35.0 + 100.0 * (f64::from(k) * step).fract()))
        .collect()
}

/// Exact measurements of a robot: joint angles and positions.
pub(crate) fn exact(arms: &[Arm; 3], count: u32) -> Vec<(Point, Point)> {
    poses(count)
        .into_iter()
        .map(|q| (q, platform(arms, q)))
        .collect()
}

/// The same with an error of up to `amplitude` mm in every coordinate, from a fixed sequence.
pub(crate) fn noisy(arms: &[Arm; 3], count: u32, amplitude: f64) -> Vec<(Point, Point)> {
    let mut state = 12345_u32;
    let mut samples = exact(arms, count);
    for (_, x) in &mut samples {
        for c in x {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *c += amplitude * (f64::from(state) / f64::from(u32::MAX) * 2.0 - 1.0);
        }
    }
    samples
}

pub(crate) fn csv(samples: &[(Point, Point)]) -> String {
    let mut text = HEADER.to_owned();
    for ([q1, q2, q3], [x, y, z]) in samples {
        writeln!(text, "{q1},{q2},{q3},{x},{y},{z}").unwrap();
    }
    text
}

pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// A folder of its own in which the command runs.
pub(crate) struct Folder(TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    pub(crate) fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }

    /// The names of all files, sorted.
    pub(crate) fn names(&self) -> Vec<String> {
        let mut names: Vec<_> = std::fs::read_dir(self.0.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    pub(crate) fn run(&self, arguments: &str) -> Run {
        self.run_where(arguments, "", &[])
    }

    /// With these environment variables.
    pub(crate) fn run_where(
        &self,
        arguments: &str,
        stdin: &str,
        variables: &[(&str, &str)],
    ) -> Run {
        let mut child = Command::new(env!("CARGO_BIN_EXE_delta-cal"))
            .args(arguments.split_whitespace())
            .current_dir(self.0.path())
            .envs(variables.iter().copied())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // A command that does not read its input closes it.
        let _ = child.stdin.take().unwrap().write_all(stdin.as_bytes());
        let output = child.wait_with_output().unwrap();
        let run = Run {
            code: output.status.code().unwrap(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        };
        let told = |own| run.stdout.contains(own) || run.stderr.contains(own);
        assert!(!SECRETS.into_iter().any(told), "{arguments}: a secret");
        run
    }
}

impl Run {
    pub(crate) fn ok(self) -> Self {
        self.ends(0, "")
    }

    /// Asserts the exit code, and that all parts, which ` | ` separates, are printed, wherever lines end.
    pub(crate) fn ends(self, code: i32, parts: &str) -> Self {
        let words = self.words();
        assert_eq!(self.code, code, "{}{}", self.stdout, self.stderr);
        for part in parts.split(" | ") {
            assert!(words.contains(part), "{part}: {words}");
        }
        self
    }

    /// All that is printed, wherever lines end.
    pub(crate) fn words(&self) -> String {
        let all = format!("{} {}", self.stdout, self.stderr);
        all.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Standard output, which is JSON.
    pub(crate) fn json(&self) -> Value {
        let json = serde_json::from_str(&self.stdout);
        json.unwrap_or_else(|error| panic!("{error}: {}{}", self.stdout, self.stderr))
    }
}

/// The three arms of a robot file, read by nothing but a TOML parser.
pub(crate) fn arms_of(toml: &str) -> [Arm; 3] {
    let value: toml::Table = toml.parse().unwrap();
    let arms: Vec<Arm> = value["arm"]
        .as_array()
        .unwrap()
        .iter()
        .map(|arm| KEYS.map(|key| arm[key].as_float().unwrap()))
        .collect();
    arms.try_into().unwrap()
}

/// The cells of a row of a CSV file by their column.
pub(crate) type Cells = BTreeMap<String, String>;

/// The rows of a CSV file.
pub(crate) fn cells_of(text: &str) -> Vec<Cells> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    reader.deserialize().collect::<Result<_, _>>().unwrap()
}

/// The rows of numbers of a CSV file below its header.
pub(crate) fn rows_of(csv: &str) -> Vec<Vec<f64>> {
    csv.lines()
        .skip(1)
        .map(|line| line.split(',').map(|c| c.parse().unwrap()).collect())
        .collect()
}

pub(crate) fn good_samples() -> String {
    csv(&exact(&true_arms(), 20))
}

/// The cases of a table, such as those in `tests/cases`, one a line: three cells that ⇒ separates, with `\n` for the end of a
/// line.
pub(crate) fn cases(table: &str) -> Vec<[String; 3]> {
    let lines = table.lines().filter(|line| !line.trim().is_empty());
    let case = |line: &str| {
        let cells = line.split('⇒').map(|cell| cell.trim().replace("\\n", "\n"));
        cells.collect::<Vec<_>>().try_into().expect("three cells")
    };
    lines.map(case).collect()
}

/// What a command says that it refuses, which is to contain all parts of `expected`. Nothing is printed or written.
pub(crate) fn refused(folder: &Folder, command: &str, code: &str, expected: &str) -> String {
    let names = folder.names();
    let run = folder.run(command);
    let shown = format!("{command}: {}{}", run.stderr, run.stdout);
    assert_eq!(run.code.to_string(), code, "{shown}");
    for part in expected.split(" | ") {
        assert!(run.stderr.contains(part), "{part}: {shown}");
    }
    let mut found = folder.names();
    if code == "1" && command.contains("--json report.json") {
        // The refusal in place of yesterday's report.
        let said = folder.json("report.json")["refused"].to_string();
        let (first, _) = expected.split_once(" | ").unwrap_or((expected, ""));
        assert!(said.contains(first), "{said}: {shown}");
        std::fs::remove_file(folder.path("report.json")).unwrap();
        found = folder.names();
    }
    assert_eq!((run.stdout.as_str(), found), ("", names));
    run.stderr
}

/// Each line of a table: arguments of a command, its exit code, and what the error says.
pub(crate) fn assert_refused(folder: &Folder, command: &str, table: &str) {
    for [arguments, code, expected] in cases(table) {
        refused(folder, &format!("{command} {arguments}"), &code, &expected);
    }
}

/// What stands in a JSON report at a path such as `noise/0/sigma_mm`.
pub(crate) fn at<'a>(json: &'a Value, path: &str) -> &'a Value {
    let found = json.pointer(&format!("/{path}"));
    found.unwrap_or_else(|| panic!("{path}: {json}"))
}

/// A number there.
pub(crate) fn number(json: &Value, path: &str) -> f64 {
    let found = at(json, path).as_f64();
    found.unwrap_or_else(|| panic!("{path}: {json}"))
}

/// The sections of arms with these keys.
pub(crate) fn arms_toml<const N: usize>(keys: [&str; N], arms: &[[f64; N]; 3]) -> String {
    let mut text = String::new();
    for arm in arms {
        text += "[[arm]]\n";
        for (key, value) in keys.iter().zip(arm) {
            writeln!(text, "{key} = {value:?}").unwrap();
        }
    }
    text
}

/// A robot file of these arms, with limits and [`TOLERANCE`].
pub(crate) fn robot_toml(arms: &[Arm; 3]) -> String {
    arms_toml(KEYS, arms) + "\n[joints]\nmin_deg = -60\nmax_deg = 90\n" + TOLERANCE
}
