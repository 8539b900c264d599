//! Correction tables: read again, interpolated here, and added to a nominal kinematics that is written here.

use crate::export::controllers::Arm;
use crate::export::robots::{Sequence, csv, example, made, one_arm_longer, positions};
use crate::export::table_file::Table;
use crate::support::robot_toml;
use crate::support::{
    Arm as Parameters, Folder, Point, arms_of, cross, distance, dot, elbow, nominal_arms, platform,
};
use delta_cal_tests::documents::print_documented;
use serde_json::Value;

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

/// Where a robot is that is wanted at a position.
fn reached(calibrated: &[Parameters; 3], kind: &str, at: Point, by: Point) -> Point {
    let sum = |a: Point, b: Point| [0, 1, 2].map(|k| a[k] + b[k]);
    let joints = match kind {
        "position" => inverse_of_nominal(PAPER, sum(at, by)),
        _ => sum(inverse_of_nominal(PAPER, at), by),
    };
    platform(calibrated, joints)
}

fn export(folder: &Folder, options: &str) -> (String, Value) {
    let command = format!(
        "export calibrated.toml --nominal robot.toml --for correction-table --output table.csv --json report.json \
         {options}"
    );
    folder.run(&command).ok();
    let report = serde_json::from_str(&folder.read("report.json")).unwrap();
    (folder.read("table.csv"), report)
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap()
}

#[test]
fn the_table_takes_the_robot_where_it_is_wanted() {
    for prepare in [example, one_arm_longer] {
        let folder = Folder::new();
        prepare(&folder);
        let calibrated = arms_of(&folder.read("calibrated.toml"));
        let wanted = positions(&calibrated, 200, &mut Sequence::new(3));
        folder.write("wanted.csv", csv(&wanted));
        for (kind, header, allowed) in [
            ("position", "x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm,node", 0.03),
            ("joint", "x_mm,y_mm,z_mm,dq1_deg,dq2_deg,dq3_deg,node", 0.2),
        ] {
            let (text, report) = export(
                &folder,
                &format!("--positions wanted.csv --corrections {kind}"),
            );
            let table = Table::read(&text, 25.0);
            assert_eq!(table.header, header);
            let (mut sum, mut worst) = (0.0, 0.0);
            for at in &wanted {
                let by = table.at(*at).unwrap();
                let off = distance(reached(&calibrated, kind, *at, by), *at);
                sum += off * off;
                worst = f64::max(worst, off);
            }
            let (rms, stated) = (f64::sqrt(sum / 200.0), &report["loss"]);
            assert_eq!(stated["positions"], 200);
            // Corrections are written to 0.00001 mm and 1e-7°.
            for (found, key) in [(rms, "rms_mm"), (worst, "worst_mm")] {
                let stated = number(stated, key);
                let tolerance = f64::max(0.02 * stated, 2e-5);
                assert!(
                    (found - stated).abs() < tolerance,
                    "{kind}: {found} {stated}"
                );
            }
            assert!(rms < allowed, "{kind}: {rms}");
        }
    }
}

/// Positions within 250 mm of the axis and more than 400 mm below the motors: away from the edge of the workspace.
fn low(calibrated: &[Parameters; 3], seed: u64) -> Vec<Point> {
    let all = positions(calibrated, 2000, &mut Sequence::new(seed));
    all.into_iter().filter(|at| at[2] < -400.0).collect()
}

/// The limit holds at centres of cells and random points of the test's own, and the next wider spacing breaks it.
#[test]
fn a_limit_chooses_the_spacing() {
    for prepare in [example, one_arm_longer] {
        let folder = Folder::new();
        prepare(&folder);
        let calibrated = arms_of(&folder.read("calibrated.toml"));
        let wanted = low(&calibrated, 4);
        folder.write("wanted.csv", csv(&wanted));
        for (kind, limit) in [("position", 0.05), ("joint", 0.05)] {
            let options = format!("--positions wanted.csv --corrections {kind}");
            let (text, report) = export(&folder, &format!("{options} --limit {limit}"));
            let found = &report["table"];
            let table = Table::read(&text, number(found, "spacing_mm"));
            assert_eq!(number(found, "limit_mm").to_bits(), f64::to_bits(limit));
            let own = low(&calibrated, 5);
            let in_box = |at: &&Point| {
                let within = |k: usize| {
                    let each = wanted.iter().map(|own| own[k]);
                    each.clone().fold(f64::INFINITY, f64::min) <= at[k]
                        && at[k] <= each.fold(f64::NEG_INFINITY, f64::max)
                };
                within(0) && within(1) && within(2)
            };
            let inside: Vec<_> = own.iter().filter(in_box).collect();
            assert!(inside.len() > 100);
            let centres: Vec<Point> = inside
                .iter()
                .map(|at| at.map(|c| ((c / table.spacing).floor() + 0.5) * table.spacing))
                .filter(|at| in_box(&at))
                .collect();
            for at in inside.into_iter().chain(&centres) {
                let off = distance(reached(&calibrated, kind, *at, table.at(*at).unwrap()), *at);
                assert!(off <= limit, "{kind}: {off} at {at:?}");
            }
            for place in ["at_cell_centres", "at_random_points"] {
                assert!(number(&found[place], "worst_mm") <= limit);
                assert!(number(&found[place], "positions") > 100.0);
            }
            // Half as fine breaks it: interpolation leaves about the square of the spacing.
            let (_, wider) = export(
                &folder,
                &format!("{options} --spacing {}", 2.0 * table.spacing),
            );
            let worst = |place: &str| number(&wider["table"][place], "worst_mm");
            assert!(f64::max(worst("at_cell_centres"), worst("at_random_points")) > limit);
        }
    }
}

/// Three equal arms: base less platform radius, upper arm and forearm, mm.
fn equal_arms([radius, upper, lower]: Point) -> [Parameters; 3] {
    [0.0, 120.0, 240.0].map(|theta: f64| {
        let (sin, cos) = theta.to_radians().sin_cos();
        [
            radius * cos,
            radius * sin,
            0.0,
            theta,
            0.0,
            upper,
            0.0,
            lower,
        ]
    })
}

/// Eight robots of each of three geometries, made to 0.5 mm and 0.2°, at positions up to the edge of the workspace.
#[test]
fn robots_of_three_geometries_lose_what_is_documented() {
    let folder = Folder::new();
    for (name, geometry) in [
        ("paper's, 164, 260, 480 mm", PAPER),
        ("small, 60, 120, 280 mm", [60.0, 120.0, 280.0]),
        ("large, 250, 400, 900 mm", [250.0, 400.0, 900.0]),
    ] {
        let nominal = equal_arms(geometry);
        folder.write("robot.toml", robot_toml(&nominal));
        let mut sequence = Sequence::new(11);
        let mut found = vec![Vec::new(); 5];
        for _ in 0..8 {
            let mut arms = made(&mut sequence);
            for ((arm, paper), own) in arms.iter_mut().zip(nominal_arms()).zip(nominal) {
                for ((value, paper), own) in arm.iter_mut().zip(paper).zip(own) {
                    *value += own - paper;
                }
            }
            folder.write("calibrated.toml", robot_toml(&arms));
            folder.write("wanted.csv", csv(&positions(&arms, 150, &mut sequence)));
            for (kind, columns) in [("position", [0, 1]), ("joint", [2, 3])] {
                let options = format!("--positions wanted.csv --corrections {kind}");
                let (_, report) = export(&folder, &options);
                assert_eq!(report["loss"]["unreached"], 0);
                for (column, key) in columns.into_iter().zip(["rms_mm", "worst_mm"]) {
                    found[column].push(number(&report["loss"], key));
                }
                if kind == "position" {
                    let before = &report["not_calibrated_after_rigid_motion"];
                    found[4].push(number(before, "rms_mm"));
                }
            }
        }
        let [rms, worst, joint_rms, joint_worst, before] = [0, 1, 2, 3, 4].map(|column: usize| {
            let mut values = found[column].clone();
            values.sort_by(f64::total_cmp);
            f64::midpoint(values[3], values[4])
        });
        print_documented(
            "docs/export.md",
            &format!(
                "| {name} | {before:.2} | {rms:.3} / {worst:.2} | {joint_rms:.3} / {joint_worst:.2} |"
            ),
        );
        assert!(rms < 0.1 * before, "{name}: {rms} {before}");
    }
}

/// Nodes half a metre apart interpolate worse than nothing.
#[test]
fn a_table_that_is_worse_than_none_is_not_recommended() {
    let folder = Folder::new();
    example(&folder);
    let (text, report) = export(&folder, "--spacing 500");
    let before = &report["not_calibrated_after_rigid_motion"];
    assert!(number(&report["loss"], "rms_mm") > number(before, "rms_mm"));
    assert!(number(&report, "kept") < 0.0);
    let text = text.replace("\n# ", " ");
    assert!(text.contains("Do not use this table"), "{text}");
    assert!(!text.contains('%'));
}

fn difference(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|k| a[k] - b[k])
}

/// How far the forearms are from meeting at a point, mm; `None` if they meet at its mirror image in the plane of the elbows,
/// for that is lower.
fn off_the_lower(arms: &[Parameters; 3], q_deg: Point, at: Point) -> Option<f64> {
    let elbows = [0, 1, 2].map(|k| elbow(&arms[k], q_deg[k]));
    let [first, second, third] = elbows;
    let normal = cross(difference(second, first), difference(third, first));
    let fall = 2.0 * dot(difference(at, first), normal) * normal[2];
    let each = elbows.iter().zip(arms);
    let off = each.map(|(elbow, arm)| (distance(at, *elbow) - arm[7]).abs());
    (fall < 0.0).then(|| off.fold(0.0, f64::max))
}

/// Of a platform larger than the base, and of forearms hardly longer than the upper arms: at some nodes the joint angles
/// that a controller computes lead to a place above the elbows.
#[test]
fn no_correction_leads_to_another_place() {
    let folder = Folder::new();
    for geometry in [[-50.0, 250.0, 520.0], [90.0, 250.0, 275.0]] {
        let nominal = equal_arms(geometry);
        let calibrated = nominal.map(|[dx, dy, dz, theta, alpha, la_x, la_y, lb]| {
            [dx + 0.3, dy, dz, theta, alpha, la_x - 0.5, la_y, lb + 0.6]
        });
        folder.write("robot.toml", robot_toml(&nominal));
        folder.write("calibrated.toml", robot_toml(&calibrated));
        let (text, report) = export(&folder, "");
        let table = Table::read(&text, 25.0);
        assert!(table.count("computed") > 1000);
        for (index, (by, kind)) in &table.nodes {
            #[allow(clippy::cast_precision_loss)] // some thousand
            let at = index.map(|c| c as f64 * 25.0);
            if let (Some(by), "computed") = (by, kind.as_str()) {
                let commanded = [0, 1, 2].map(|k| at[k] + by[k]);
                let joints = inverse_of_nominal(geometry, commanded);
                let off = off_the_lower(&calibrated, joints, at);
                // Corrections are written to 0.00001 mm.
                assert!(off.is_some_and(|off| off < 1e-4), "{off:?} at {at:?}");
            }
        }
        let before = &report["not_calibrated_after_rigid_motion"];
        assert!(number(&report["loss"], "rms_mm") < number(before, "rms_mm"));
    }
}

/// Up to the edge of the workspace, where nodes are out of reach.
#[test]
fn nodes_out_of_reach_are_marked_and_serve_the_positions_beside_them() {
    let folder = Folder::new();
    example(&folder);
    let calibrated = arms_of(&folder.read("calibrated.toml"));
    let (text, report) = export(&folder, "--spacing 40");
    let table = Table::read(&text, 40.0);
    // Every position of the workspace has corrections.
    assert_eq!(report["loss"]["positions"], 2000);
    assert_eq!(report["loss"]["unreached"], 0);
    let (computed, extrapolated) = (table.count("computed"), table.count("extrapolated"));
    assert!(computed > 1000 && extrapolated > 200 && table.count("empty") > 100);
    for (index, (by, kind)) in &table.nodes {
        #[allow(clippy::cast_precision_loss)] // some thousand
        let at = index.map(|c| c as f64 * 40.0);
        let joints = calibrated.each_ref().map(|arm| joint(arm, at));
        let clear = match joints {
            [Some(first), Some(second), Some(third)] => {
                parallel(&calibrated, [first, second, third], at) > 0.05
            }
            _ => false,
        };
        assert_eq!(kind == "computed", clear, "{at:?} {kind}");
        if let (Some(by), "computed") = (by, kind.as_str()) {
            let off = distance(reached(&calibrated, "position", at, *by), at);
            // Written to 0.00001 mm, of which singularities near by make some times as much.
            assert!(off < 1e-3, "{off} at {at:?}");
        }
    }
    // The JSON holds the same.
    let found = &report["table"];
    assert_eq!(found["unit"], "mm");
    let corrections = found["corrections"].as_array().unwrap();
    assert_eq!(corrections.len(), table.nodes.len());
    for (own, (by, _)) in corrections.iter().zip(table.nodes.values()) {
        assert_eq!(own.is_null(), by.is_none());
        for (k, value) in by.iter().flatten().enumerate() {
            assert!((own[k].as_f64().unwrap() - value).abs() < 1e-5);
        }
    }
    assert_eq!(
        found["extrapolated"].as_array().unwrap().len(),
        extrapolated
    );
}

/// The joint angle of an arm at a position, elbow outwards, degrees: A cos q + B sin q = C, A = u·w, B = v·w and
/// C = (|w|² + La² − Lb²)/2; `None` if the position is out of reach.
fn joint(arm: &Parameters, at: Point) -> Option<f64> {
    let [dx, dy, dz, .., lb] = *arm;
    let from = |point: Point| difference(point, [dx, dy, dz]);
    let (u, v, w) = (from(elbow(arm, 0.0)), from(elbow(arm, 90.0)), from(at));
    let (a, b) = (dot(u, w), dot(v, w));
    let cosine = (dot(w, w) + dot(u, u) - lb * lb) / 2.0 / a.hypot(b);
    (cosine.abs() <= 1.0).then(|| (b.atan2(a) - cosine.acos()).to_degrees())
}

/// |det| of the forearms' unit vectors.
fn parallel(arms: &[Parameters; 3], q_deg: Point, at: Point) -> f64 {
    let [first, second, third] = [0, 1, 2].map(|k| {
        let forearm = difference(at, elbow(&arms[k], q_deg[k]));
        forearm.map(|value| value / arms[k][7])
    });
    dot(first, cross(second, third)).abs()
}

/// Work in one plane: cells have their centres elsewhere.
#[test]
fn a_plane_has_a_table_and_a_robot_that_is_assumed_is_stated() {
    let folder = Folder::new();
    example(&folder);
    let mut sequence = Sequence::new(6);
    let mut coordinate = || 300.0 * sequence.uniform() - 150.0;
    let wanted: Vec<Point> = (0..50)
        .map(|_| [coordinate(), coordinate(), -447.3])
        .collect();
    folder.write("wanted.csv", csv(&wanted));
    let (text, report) = export(&folder, "--positions wanted.csv --limit 0.05");
    assert!(number(&report["loss"], "worst_mm") < 0.05);
    assert!(number(&report["table"]["at_random_points"], "positions") > 1000.0);
    assert!(!text.contains("in the middle of"), "{text}");
    assert!(!text.contains("The table is right only for"), "{text}");
    let run = folder
        .run("export calibrated.toml --for correction-table --spacing 80")
        .ok();
    let robot =
        "# - The table is right only for a controller that computes with the symmetric robot";
    assert!(run.stdout.contains(robot), "{}", run.stdout);
}

#[test]
fn options_of_tables_are_refused_where_they_say_nothing() {
    let folder = Folder::new();
    folder.write("calibrated.toml", robot_toml(&nominal_arms()));
    for (arguments, code, cause) in [
        (
            "--for klipper --limit 0.1",
            2,
            "--limit cannot be used with --for klipper",
        ),
        (
            "--for sdf --corrections joint",
            2,
            "--corrections cannot be used with --for sdf",
        ),
        (
            "--for linuxcnc-component --spacing 9",
            2,
            "--spacing cannot be used",
        ),
        (
            "--for correction-table --limit 0.1 --spacing 9",
            2,
            "cannot be used with",
        ),
        ("--for correction-table --limit 0", 2, "it must be above 0"),
        (
            "--for correction-table --corrections both",
            2,
            "[possible values: position, joint]",
        ),
    ] {
        let run = folder.run(&format!("export calibrated.toml {arguments}"));
        assert_eq!(run.code, code, "{arguments}: {}", run.stderr);
        assert!(run.stderr.contains(cause), "{arguments}: {}", run.stderr);
    }
    let folder = Folder::new();
    example(&folder);
    let run = folder.run(
        "export calibrated.toml --nominal robot.toml --for correction-table --limit 1e-6 --output table.csv",
    );
    assert_eq!(run.code, 3, "{}", run.stderr);
    assert!(
        run.stderr
            .contains("keeps the error of interpolation below 0.000001 mm: with nodes"),
        "{}",
        run.stderr
    );
    assert!(!folder.names().contains(&"table.csv".to_owned()));
}
