//! `delta-cal check` of heights, distances and single coordinates: what it predicts against what
//! `delta-cal calibrate` then reports.

use crate::support::{Folder, Point, TO_MEASURE, true_arms};
use delta_cal::simulate::standard_normal;
use delta_cal_tests::generator;
use serde_json::Value;
use std::fmt::Write;

/// For cameras, too.
fn robot() -> String {
    format!("{TO_MEASURE}position_mm = 0.02\n")
}

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot());
    folder
}

fn check(folder: &Folder, arguments: &str) -> (i32, Value) {
    let run = folder.run(&format!("check {arguments} --json -"));
    let json = serde_json::from_str(&run.stdout);
    (
        run.code,
        json.unwrap_or_else(|_| panic!("{}{}", run.stdout, run.stderr)),
    )
}

fn relative(json: &Value, key: &str) -> f64 {
    json[key]["intrinsic_rms_mm"].as_f64().unwrap()
}

fn joints(pose: &Value) -> Point {
    [0, 1, 2].map(|joint| pose[joint].as_f64().unwrap())
}

/// The rows of a plan or a proposal, measured on a robot that was made with errors: a plate at z = −560, tilted by
/// 0.3°, and points some millimetres from where the plan has them.
fn measured(folder: &Folder, rows: &[Value], seed: u64) -> String {
    let plan: Value = serde_json::from_str(&folder.read("plan.json")).unwrap();
    let mut text = String::from(
        "q1_deg,q2_deg,q3_deg,x_mm,y_mm,height_mm,distance_mm,point,to_q1_deg,to_q2_deg,to_q3_deg\n",
    );
    let mut rng = generator(seed, 0);
    for row in rows {
        let own = joints(&row["joints_deg"]);
        let at = crate::support::platform(&true_arms(), own);
        let mut noisy = |value: f64| value + 0.02 * standard_normal::<f64, _>(&mut rng);
        let cells = match row["measure"].as_str().unwrap() {
            "plane" => {
                let height = (at[2] + 560.0 - 0.005 * at[0] + 0.002 * at[1]) / f64::sqrt(1.000_029);
                format!(",,{},,,,,", noisy(height))
            }
            "point" => {
                let name = row["point"].as_str().unwrap();
                let points = plan["points"].as_array().unwrap();
                let point = points.iter().find(|point| point["name"] == name).unwrap();
                let [x, y, z] = joints(&point["position_mm"]);
                let place = [x + 6.0, y - 4.0, z + 3.0];
                format!(
                    ",,,{},{name},,,",
                    noisy(crate::support::distance(at, place))
                )
            }
            "distance" => {
                let to = joints(&row["to_joints_deg"]);
                let there = crate::support::platform(&true_arms(), to);
                let [a, b, c] = to;
                format!(
                    ",,,{},,{a},{b},{c}",
                    noisy(crate::support::distance(at, there))
                )
            }
            _ => format!("{},{},,,,,,", noisy(at[0]), noisy(at[1])),
        };
        let [a, b, c] = own;
        writeln!(text, "{a},{b},{c},{cells}").unwrap();
    }
    text
}

/// The planned rows, as the plan's JSON has them.
fn planned(folder: &Folder, kinds: &str, count: u32) -> Vec<Value> {
    let plan =
        format!("plan robot.toml --measure {kinds} --count {count} --points 2 --output plan.csv");
    let run = folder.run(&format!("{plan} --json plan.json")).ok();
    assert!(run.stdout.contains("plan.csv"), "{}", run.stdout);
    let json: Value = serde_json::from_str(&folder.read("plan.json")).unwrap();
    json["measurements"].as_array().unwrap().clone()
}

#[test]
fn the_check_predicts_what_the_calibration_reports() {
    for (kinds, count) in [
        ("plane", 20),
        ("point", 24),
        ("distance", 16),
        ("plane,distance,xy", 24),
    ] {
        let folder = folder();
        let rows = planned(&folder, kinds, count);
        // Before anything is measured, where instruments are is assumed.
        let (_, empty) = check(&folder, "robot.toml plan.csv --add 0");
        assert_eq!(
            empty["unmeasured_lines"].as_array().unwrap().len(),
            rows.len(),
            "{kinds}"
        );
        folder.write("samples.csv", measured(&folder, &rows, 7));
        let (_, found) = check(&folder, "robot.toml samples.csv --add 6");
        assert_eq!(found["unmeasured_lines"], serde_json::json!([]));
        folder
            .run("calibrate robot.toml samples.csv --json report.json")
            .ok();
        let report: Value = serde_json::from_str(&folder.read("report.json")).unwrap();
        assert!(
            report["sigma_widened_by"].as_f64().unwrap() <= 1.0,
            "{kinds}"
        );
        // The derivatives are those of the drawn robot here and of the calibrated one there, 0.9 mm apart.
        let expected = relative(&report, "expected_error");
        for (json, within) in [(&found, 0.05), (&empty, 0.15)] {
            let ratio = relative(json, "expected_error") / expected;
            assert!((ratio - 1.0).abs() < within, "{kinds}: {ratio}");
        }
        assert_eq!(found["known"], report["known"], "{kinds}");

        // What it proposes brings what it promises.
        let next = found["next"].as_array().unwrap();
        assert_eq!(next.len(), 6);
        let all: Vec<_> = rows.iter().chain(next).cloned().collect();
        folder.write("samples.csv", measured(&folder, &all, 7));
        folder
            .run("calibrate robot.toml samples.csv --json report.json")
            .ok();
        let report: Value = serde_json::from_str(&folder.read("report.json")).unwrap();
        let promised = relative(&found, "expected_error_with_next");
        let ratio = relative(&report, "expected_error") / promised;
        assert!((ratio - 1.0).abs() < 0.05, "{kinds}: {ratio}");
        assert!(promised < relative(&found, "expected_error"), "{kinds}");
    }
}

#[test]
fn proposals_are_better_than_as_many_random_rows() {
    let folder = folder();
    let rows = planned(&folder, "plane", 12);
    folder.write("samples.csv", measured(&folder, &rows, 3));
    let (_, found) = check(&folder, "robot.toml samples.csv --add 6");
    let promised = relative(&found, "expected_error_with_next");
    // Others on the same blocks, planned from another seed without those of the file.
    let mut others = Vec::new();
    for seed in 2..7 {
        let plan =
            format!("plan robot.toml --measure plane --count 6 --seed {seed} --json other.json");
        folder.run(&format!("{plan} --output other.csv")).ok();
        let json: Value = serde_json::from_str(&folder.read("other.json")).unwrap();
        let more = json["measurements"].as_array().unwrap().clone();
        let all: Vec<_> = rows.iter().chain(&more).cloned().collect();
        folder.write("samples.csv", measured(&folder, &all, 3));
        let (_, json) = check(&folder, "robot.toml samples.csv --add 0");
        others.push(relative(&json, "expected_error"));
    }
    assert!(
        others.iter().all(|own| *own > promised),
        "{promised} {others:?}"
    );
}

#[test]
fn one_plane_without_blocks_leaves_the_scale() {
    let folder = folder();
    let plan = "plan robot.toml --measure plane --blocks 0 --count 16 --output plan.csv";
    folder.run(plan).ok();
    let (_, json) = check(&folder, "robot.toml plan.csv");
    assert_eq!(json["known"]["scale"], false);
    let gaps = json["gaps"].as_array().unwrap();
    assert!(
        gaps.iter()
            .any(|gap| gap.as_str().unwrap().contains("gauge block")),
        "{gaps:?}"
    );
}

/// Distances are there, so the advice is not to measure one; and a figure is not told twice.
#[test]
fn distances_that_are_too_inexact_leave_the_scale() {
    let folder = Folder::new();
    let inexact = robot().replace("distance_mm = 0.02", "distance_mm = 20");
    folder.write("robot.toml", inexact);
    let plan = "plan robot.toml --measure distance --count 20 --output plan.csv";
    folder.run(plan).ok();
    let run = folder.run("check robot.toml plan.csv");
    assert_eq!(run.code, 1, "{}", run.stdout);
    let said: Vec<_> = run.stdout.split_whitespace().collect();
    let said = said.join(" ");
    assert!(
        said.contains("the distances are too few or too inexact") && !said.contains("calliper"),
        "{said}"
    );
    assert_eq!(
        said.matches("combinations of parameters").count(),
        1,
        "{said}"
    );
}

#[test]
fn too_little_is_said_to_be_too_little() {
    let folder = folder();
    let rows = planned(&folder, "plane", 12);
    folder.write("samples.csv", measured(&folder, &rows[..4], 5));
    let (code, json) = check(&folder, "robot.toml samples.csv --add 0");
    assert_eq!((code, &json["worthwhile"]), (1, &Value::Bool(false)));
    let run = folder.run("check robot.toml samples.csv");
    assert!(
        run.stderr.contains("a calibration is expected to leave"),
        "{}",
        run.stderr
    );

    // Three unknowns of the plane, two touches.
    folder.write("samples.csv", measured(&folder, &rows[..2], 5));
    let run = folder.run("check robot.toml samples.csv");
    assert_eq!(run.code, 1);
    assert!(
        run.stderr.contains("the plane has 2 readings and needs 3"),
        "{}",
        run.stderr
    );

    // Without a tolerance the place in space is unknown.
    folder.write(
        "robot.toml",
        robot().replace("[tolerance]\nlength_mm = 0.5\nangle_deg = 0.2\n", ""),
    );
    folder.write("samples.csv", measured(&folder, &rows, 5));
    let run = folder.run("check robot.toml samples.csv");
    assert_eq!(run.code, 1);
    assert!(run.stderr.contains("state a [tolerance]"), "{}", run.stderr);
}

#[test]
fn rows_that_say_nothing_of_what_to_measure_are_refused() {
    let folder = folder();
    folder.write(
        "samples.csv",
        "q1_deg,q2_deg,q3_deg,distance_mm,point\n1,2,3,400,A\n4,5,6,,\n",
    );
    let run = folder.run("check robot.toml samples.csv");
    assert_eq!(run.code, 3);
    assert!(run.stderr.contains("samples.csv:3"), "{}", run.stderr);
    folder.write(
        "samples.csv",
        "q1_deg,q2_deg,q3_deg,distance_mm,point\n1,2,3,400,A\n",
    );
    let run = folder.run("check robot.toml samples.csv --method ikm");
    assert_eq!(run.code, 2);
    assert!(
        run.stderr.contains("--method can only be used"),
        "{}",
        run.stderr
    );
}
