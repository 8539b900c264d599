//! Correction tables: read again, interpolated here, and added to a nominal kinematics that is written here.

use crate::export::controllers::Arm;
use crate::export::robots::{csv, example, export, one_arm_longer, positions};
use crate::support::{
    Arm as Parameters, Folder, Point, arms_of, distance, elbow, number, platform, robot_toml,
};
use delta_cal_tests::generator;
use nalgebra::Vector3;
use serde_json::Value;
use std::collections::BTreeMap;

/// A table as its file has it: corrections and kind of each node.
struct Table {
    spacing: f64,
    nodes: BTreeMap<[i64; 3], (Option<Point>, String)>,
}

impl Table {
    fn read(text: &str, spacing: f64) -> Self {
        let mut reader = csv::ReaderBuilder::new();
        let mut reader = reader.comment(Some(b'#')).from_reader(text.as_bytes());
        let names = ["x_mm", "y_mm", "z_mm", "dx_mm", "dy_mm", "dz_mm", "node"];
        assert_eq!(reader.headers().unwrap(), &names[..]);
        let mut nodes = BTreeMap::new();
        for row in reader.deserialize() {
            let (at, by, kind): (Point, [Option<f64>; 3], String) = row.unwrap();
            let index = at.map(|c| {
                let place = c / spacing;
                assert!((place - place.round()).abs() < 1e-9, "{at:?}");
                #[allow(clippy::cast_possible_truncation)] // some thousand
                let place = place.round() as i64;
                place
            });
            assert_eq!(by[0].is_none(), kind == "empty");
            let by = (kind != "empty").then(|| by.map(Option::unwrap));
            assert!(nodes.insert(index, (by, kind)).is_none());
        }
        Self { spacing, nodes }
    }

    fn count(&self, kind: &str) -> usize {
        self.nodes.values().filter(|(_, own)| own == kind).count()
    }

    /// Where the nodes with computed corrections are, and these.
    fn computed(&self) -> impl Iterator<Item = (Point, Point)> {
        let nodes = self
            .nodes
            .iter()
            .filter(|(_, (_, kind))| kind == "computed");
        nodes.map(|(index, (by, _))| (index.map(|c| c as f64 * self.spacing), by.unwrap()))
    }

    /// Linear along x, then y, then z.
    fn at(&self, at: Point) -> Option<Point> {
        #[allow(clippy::cast_possible_truncation)] // some thousand
        let low = at.map(|c| (c / self.spacing).floor() as i64);
        let part = [0, 1, 2].map(|k| (at[k] / self.spacing).rem_euclid(1.0));
        let node =
            |x: i64, y: i64, z: i64| self.nodes.get(&[low[0] + x, low[1] + y, low[2] + z])?.0;
        let between = |a: Point, b: Point, t: f64| [0, 1, 2].map(|k| a[k] + t * (b[k] - a[k]));
        let along_x = |y, z| Some(between(node(0, y, z)?, node(1, y, z)?, part[0]));
        let along_y = |z| Some(between(along_x(0, z)?, along_x(1, z)?, part[1]));
        Some(between(along_y(0)?, along_y(1)?, part[2]))
    }
}

/// Base less platform radius, upper arm and forearm of the paper's robot, mm.
const PAPER: Point = [164.0, 260.0, 480.0];

/// Joint angles of the nominal robot, degrees.
fn inverse_of_nominal([radius, upper, lower]: Point, at: Point) -> Point {
    [0.0, 120.0, 240.0].map(|azimuth| {
        let arm = Arm {
            azimuth,
            radius,
            height: 0.0,
            upper,
            lower,
        };
        -arm.above_horizontal(at)
    })
}

fn sum(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|k| a[k] + b[k])
}

/// How far a robot is from where it is wanted with this correction.
fn off_by(calibrated: &[Parameters; 3], at: Point, by: Point) -> f64 {
    let joints = inverse_of_nominal(PAPER, sum(at, by));
    distance(platform(calibrated, joints), at)
}

fn table(folder: &Folder, options: &str) -> (Table, String, Value) {
    let (text, report) = export(folder, "correction-table", options);
    let table = Table::read(&text, number(&report, "table/spacing_mm"));
    (table, text, report)
}

/// The limit holds at the wanted positions, at others, and in the middle of their cells. The stated loss is that of the
/// table, and the chosen spacing is not the finest.
#[test]
fn a_limit_with_a_unit_chooses_the_spacing() {
    for prepare in [example, one_arm_longer] {
        let folder = Folder::new();
        prepare(&folder);
        let calibrated = arms_of(&folder.read("calibrated.toml"));
        // Away from the edge of the workspace.
        let low = |seed: u64| {
            let mut all = positions(&calibrated, 2000, &mut generator(8, seed));
            all.retain(|at| at[2] < -400.0);
            all
        };
        let wanted = low(4);
        folder.write("wanted.csv", csv(&wanted));
        let (table, text, report) = table(&folder, "--positions wanted.csv --limit 50um");
        let off = |at: &Point| off_by(&calibrated, *at, table.at(*at).unwrap());
        let squares = wanted.iter().map(|at| off(at).powi(2)).sum::<f64>();
        let count = wanted.len() as f64;
        let worst = wanted.iter().map(off).fold(0.0, f64::max);
        assert_eq!(report["loss"]["positions"], wanted.len());
        // Corrections are written to 0.00001 mm.
        for (found, key) in [
            ((squares / count).sqrt(), "loss/rms_mm"),
            (worst, "loss/worst_mm"),
        ] {
            let stated = number(&report, key);
            let tolerance = f64::max(0.02 * stated, 2e-5);
            assert!((found - stated).abs() < tolerance, "{found} {stated}");
        }
        let in_box = |at: &Point| {
            (0..3).all(|k| {
                let least = wanted.iter().any(|own| own[k] <= at[k]);
                least && wanted.iter().any(|own| own[k] >= at[k])
            })
        };
        let spacing = table.spacing;
        let others = low(5);
        let centres = others.iter();
        let centres = centres.map(|at| at.map(|c| ((c / spacing).floor() + 0.5) * spacing));
        let own = others.iter().copied().chain(centres).filter(in_box);
        let own: Vec<_> = own.map(|at| off(&at)).collect();
        assert!(own.len() > 200);
        assert!(own.into_iter().fold(worst, f64::max) <= 0.05);
        assert!(number(&report, "table/at_cell_centres/worst_mm") <= 0.05);
        assert!(spacing > 4.0, "{spacing}");
        assert!(!text.contains("The table is right only for"), "{text}");
    }
}

/// How far the forearms are from meeting at a point, mm; `None` if they meet at its mirror image in the plane of the elbows,
/// for that is lower.
fn off_the_lower(arms: &[Parameters; 3], q_deg: Point, at: Point) -> Option<f64> {
    let elbows = [0, 1, 2].map(|k| Vector3::from(elbow(&arms[k], q_deg[k])));
    let [first, second, third] = elbows;
    let (at, normal) = (Vector3::from(at), (second - first).cross(&(third - first)));
    let each = elbows.iter().zip(arms);
    let off = each.map(|(elbow, arm)| ((at - elbow).norm() - arm[7]).abs());
    ((at - first).dot(&normal) * normal.z < 0.0).then(|| off.fold(0.0, f64::max))
}

/// Of a platform larger than the base, and of forearms hardly longer than the upper arms: at some nodes the joint angles
/// that a controller computes lead to a place above the elbows.
#[test]
fn no_correction_leads_to_another_place() {
    let folder = Folder::new();
    for geometry in [[-50.0, 250.0, 520.0], [90.0, 250.0, 275.0]] {
        let [radius, upper, lower] = geometry;
        let nominal = [0.0, 120.0, 240.0].map(|theta: f64| {
            let (sin, cos) = theta.to_radians().sin_cos();
            let (x, y) = (radius * cos, radius * sin);
            [x, y, 0.0, theta, 0.0, upper, 0.0, lower]
        });
        let calibrated = nominal.map(|[dx, dy, dz, theta, alpha, la_x, la_y, lb]| {
            [dx + 0.3, dy, dz, theta, alpha, la_x - 0.5, la_y, lb + 0.6]
        });
        folder.write("robot.toml", robot_toml(&nominal));
        folder.write("calibrated.toml", robot_toml(&calibrated));
        let (table, _, report) = table(&folder, "");
        assert!(table.count("computed") > 1000);
        for (at, by) in table.computed() {
            let joints = inverse_of_nominal(geometry, sum(at, by));
            let off = off_the_lower(&calibrated, joints, at);
            // Corrections are written to 0.00001 mm.
            assert!(off.is_some_and(|off| off < 1e-4), "{off:?} at {at:?}");
        }
        let before = number(&report, "not_calibrated_after_rigid_motion/rms_mm");
        assert!(number(&report, "loss/rms_mm") < before);
    }
}

/// Up to the edge of the workspace, where nodes are out of reach.
#[test]
fn nodes_out_of_reach_are_marked_and_serve_the_positions_beside_them() {
    let folder = Folder::new();
    example(&folder);
    let calibrated = arms_of(&folder.read("calibrated.toml"));
    let (table, _, report) = table(&folder, "");
    assert_eq!(table.spacing.to_bits(), 25f64.to_bits());
    // Every position of the workspace has corrections.
    assert_eq!(report["loss"]["positions"], 2000);
    assert_eq!(report["loss"]["unreached"], 0);
    let extrapolated = table.count("extrapolated");
    assert!(extrapolated > 200 && table.count("empty") > 100);
    assert!(table.count("computed") > 1000);
    for (at, by) in table.computed() {
        // Written to 0.00001 mm, of which singularities near by make some times as much.
        let off = off_by(&calibrated, at, by);
        assert!(off < 1e-3, "{off} at {at:?}");
    }
    // The JSON holds the same.
    let found = &report["table"];
    let corrections = found["corrections"].as_array().unwrap();
    assert_eq!(corrections.len(), table.nodes.len());
    for (own, (by, _)) in corrections.iter().zip(table.nodes.values()) {
        assert_eq!(own.is_null(), by.is_none());
        for (k, value) in by.iter().flatten().enumerate() {
            assert!((own[k].as_f64().unwrap() - value).abs() < 1e-5);
        }
    }
    let marked = found["extrapolated"].as_array().unwrap();
    assert_eq!(marked.len(), extrapolated);
}
