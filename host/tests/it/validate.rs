//! `delta-cal validate`: a robot file against independent measurements and a limit.

use crate::support::{
    Folder, NOISE, NOMINAL, Point, Run, assert_refused, csv, exact, nominal_arms, number, platform,
    poses, true_arms,
};
use serde_json::Value;
use std::fmt::Write;

/// Exact samples of the nominal robot with every position shifted by this vector.
fn shifted(count: u32, by: Point) -> Vec<(Point, Point)> {
    let mut samples = exact(&nominal_arms(), count);
    for (_, x) in &mut samples {
        for (own, by) in x.iter_mut().zip(by) {
            *own += by;
        }
    }
    samples
}

/// Samples shifted by 0.05 mm.
fn off(count: u32) -> Vec<(Point, Point)> {
    shifted(count, [0.03, -0.04, 0.0])
}

fn folder(robot: &str, samples: &[(Point, Point)]) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot);
    folder.write("check.csv", csv(samples));
    folder
}

fn stated() -> String {
    format!("{NOMINAL}{NOISE}")
}

fn validate(folder: &Folder, options: &str) -> Run {
    folder.run(&format!("validate robot.toml check.csv {options}"))
}

/// The report, after checking the exit code.
fn report(folder: &Folder, code: i32, options: &str) -> Value {
    let run = validate(folder, &format!("{options} --json -"));
    assert_eq!(run.code, code, "{options}: {}", run.stderr);
    run.json()
}

fn near(report: &Value, path: &str, expected: f64, within: f64) {
    let found = number(report, path);
    assert!(
        (found - expected).abs() < within,
        "{path}: {found} {expected}"
    );
}

/// 16 rows, all off by 0.05 mm: c = 15·(2/3)/(15 + 15) and ν = 2·16/c = 96, for which the quantiles of χ² are 70.7828
/// and 125.0001 (from the series of the regularised incomplete gamma function).
#[test]
fn the_figures_are_those_of_the_chi_square_distribution() {
    let report = report(&folder(&stated(), &off(16)), 6, "--limit 55um");
    let rms_error = f64::sqrt(0.0025 - 3.0 * 0.01 * 0.01);
    for (path, expected) in [
        ("rms_error/degrees_of_freedom", 96.0),
        ("rms_error/estimate_mm", rms_error),
        ("rms_error/interval_mm/0", 0.040_249_210),
        ("rms_error/interval_mm/1", 0.055_593_643),
        ("rms_error/confidence_below_limit", 0.966_891_573),
        ("largest_error/interval_mm/0", 0.05 - 0.01 * 3.914_101),
        ("largest_error/interval_mm/1", 0.05 + 0.01 * 1.959_964),
        ("deviation_mm/rms", 0.05),
        ("noise_mm", 0.01 * 3_f64.sqrt()),
    ] {
        near(&report, path, expected, 1e-6);
    }
}

#[test]
fn a_robot_passes_fails_or_is_undecided_with_its_exit_code() {
    let folder = folder(&stated(), &off(16));
    for (limit, code, verdict) in [
        ("0.1mm", 0, "pass"),
        ("0.0472mm", 6, "undecided"),
        ("20um", 6, "fail"),
    ] {
        let report = report(
            &folder,
            code,
            &format!("--limit {limit} --report page.html"),
        );
        assert_eq!(report["verdict"], verdict);
        assert_eq!(report["passed"], verdict == "pass");
        // A failing robot gets a certificate too.
        let page = folder.read("page.html");
        assert!(page.contains("Validation of robot.toml"), "{page}");
    }
}

/// The requested number of poses suffices for a decision if they scatter as before.
#[test]
fn as_many_poses_as_are_asked_for_decide() {
    let limit = "--limit 0.051mm";
    let few = folder(&stated(), &off(16));
    let asked = report(&few, 6, limit)["rms_error"]["poses_to_decide"].as_u64();
    let asked = u32::try_from(asked.unwrap()).unwrap();
    assert!(asked > 16, "{asked}");
    validate(&few, limit).ends(6, "Measure ");
    // All rows are identical, so the scatter falls with each further row and the requested number is more than enough.
    report(&folder(&stated(), &off(asked)), 0, limit);
}

#[test]
fn without_a_noise_a_robot_can_pass_and_not_fail() {
    let folder = folder(NOMINAL, &off(16));
    let passed = report(&folder, 0, "--limit 0.1mm");
    near(&passed, "rms_error/estimate_mm", 0.05, 1e-9);
    near(&passed, "rms_error/interval_mm/0", 0.0, 1e-12);
    assert_eq!(passed["noise_mm"], Value::Null);
    validate(&folder, "--limit 0.01mm").ends(6, "State the [noise]");
}

/// A noise stated ten times too large would hide the error, so it is not subtracted.
#[test]
fn a_noise_stated_too_large_is_not_removed() {
    let noise = "\n[noise]\nposition_mm = 0.5\njoint_deg = 0\n";
    let folder = folder(&format!("{NOMINAL}{noise}"), &off(16));
    let report = report(&folder, 6, "--limit 0.02mm");
    near(&report, "rms_error/estimate_mm", 0.05, 1e-9);
    let warning = report["warnings"][0].as_str().unwrap();
    assert!(warning.contains("stated too large"), "{warning}");
}

/// Rows of the same pose share the robot's error.
#[test]
fn rows_of_one_pose_count_once() {
    let samples = shifted(10, [0.03, 0.0, 0.0]);
    // An exact copy of a row would be merged with it.
    let again = samples.iter().map(|(q, x)| (*q, x.map(|x| x + 1e-8)));
    let twice: Vec<_> = samples.iter().copied().chain(again).collect();
    let [once, twice] =
        [samples, twice].map(|rows| report(&folder(NOMINAL, &rows), 0, "--limit 1mm"));
    assert_eq!(
        (&twice["row_count"], &twice["pose_count"]),
        (&20.into(), &10.into())
    );
    let degrees = "rms_error/degrees_of_freedom";
    near(&twice, degrees, number(&once, degrees), 1e-6);
}

/// Heights above a plane, alternately off by ±0.03 mm: above a known plane the whole deviation is error; above an
/// unknown one, only what a fitted plane does not absorb.
#[test]
fn heights_are_validated_above_known_and_unknown_planes() {
    let heights = |raised: f64| {
        let mut text = String::from("q1_deg,q2_deg,q3_deg,height_mm,plane\n");
        for (index, ([q1, q2, q3], x)) in exact(&nominal_arms(), 40).into_iter().enumerate() {
            let off = if index % 2 == 0 { 0.03 } else { -0.03 };
            let _ = writeln!(
                text,
                "{q1},{q2},{q3},{:.6},table",
                x[2] + 700.0 + off + raised
            );
        }
        text
    };
    let noise = "\n[noise]\nheight_mm = 0.001\njoint_deg = 0\n";
    let known = "[planes.table]\nz_mm = -700\nsigma_mm = 0.0001\ntilt_deg = 0.00001\n";
    let folder = Folder::new();
    for (planes, raised, rms) in [
        (known, 0.0, 0.03),
        ("", 0.0, 0.03),
        ("", 0.5, 0.03),
        (known, 0.5, 0.5),
    ] {
        folder.write("robot.toml", format!("{NOMINAL}{noise}{planes}"));
        folder.write("check.csv", heights(raised));
        let report = report(&folder, 0, "--limit 1mm");
        near(&report, "rms_error/estimate_mm", rms, 0.1 * rms);
    }
}

/// A fitted frame absorbs a constant offset; a stored one does not.
#[test]
fn a_stored_frame_is_not_fitted_again() {
    let frame = "\n[sensor_frame]\nrotation = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]\ntranslation_mm = [700, 10, -5]\n";
    let target = "\n[target]\nx_mm = 1\ny_mm = 2\nz_mm = -30\n";
    let mut samples = exact(&nominal_arms(), 20);
    for (_, x) in &mut samples {
        let [a, b, c] = [x[0] + 1.0, x[1] + 2.0, x[2] - 30.0];
        *x = [700.0 - b, 10.0 + a, -5.0 + c + 0.2];
    }
    let own = folder(&format!("{}{frame}{target}", stated()), &samples);
    for (of, deviation, code) in [("stored", 0.2, 6), ("sensor", 0.0, 0)] {
        let report = report(&own, code, &format!("--limit 0.1mm --frame {of}"));
        near(&report, "deviation_mm/rms", deviation, 1e-6);
        if of == "sensor" {
            near(&report, "sensor_frame/translation_mm/0", 700.0, 1e-6);
        }
    }
    let check = "validate robot.toml check.csv --limit 0.1mm";
    assert_refused(&own, check, "⇒ 1 ⇒ --frame sensor");
    let table = "--frame stored ⇒ 3 ⇒ [sensor_frame]";
    let without = folder(&stated(), &samples);
    assert_refused(&without, check, table);
}

#[test]
fn what_cannot_be_validated_is_refused_with_place_cause_and_remedy() {
    let folder = folder(NOMINAL, &off(7));
    let heights = "q1_deg,q2_deg,q3_deg,height_mm\n10,20,30,0\n12,20,30,0\n";
    folder.write("heights.csv", heights);
    folder.write(
        "heights.toml",
        format!("{NOMINAL}\n[noise]\nheight_mm = 0.02\njoint_deg = 0\n"),
    );
    // Metres under a header in millimetres.
    let metres = exact(&true_arms(), 12)
        .into_iter()
        .map(|(q, x)| (q, x.map(|x| x / 1000.0)));
    folder.write("metres.csv", csv(&metres.collect::<Vec<_>>()));
    // Joint angles at which forearms this short do not meet.
    folder.write("short.toml", NOMINAL.replace("480", "300"));
    let far = csv(&shifted(12, [0.0; 3])) + "-55,-55,80,0,0,-300\n";
    folder.write("far.csv", far);
    let table = "
        robot.toml check.csv ⇒ 1 ⇒ 7 different poses | at least 8 | Measure about 20
        heights.toml heights.csv ⇒ 1 ⇒ 2 different poses | at least 8
        robot.toml metres.csv ⇒ 1 ⇒ half of the measured positions | metres
        short.toml far.csv ⇒ 3 ⇒ far.csv: | does not reach
        ";
    assert_refused(
        &folder,
        "validate --limit 0.1mm --report page.html --json report.json",
        table,
    );
}

#[test]
fn the_measurements_of_the_calibration_are_no_validation() {
    let arms = true_arms();
    let folder = folder(&stated(), &exact(&arms, 20));
    folder
        .run("calibrate robot.toml check.csv --output calibrated.toml")
        .ok();
    let table = "check.csv ⇒ 3 ⇒ the same measurements";
    assert_refused(&folder, "validate calibrated.toml --limit 1mm", table);
    let other: Vec<_> = poses(60)[20..]
        .iter()
        .map(|q| (*q, platform(&arms, *q)))
        .collect();
    folder.write("other.csv", csv(&other));
    folder
        .run("validate calibrated.toml other.csv --limit 1mm")
        .ok();
}
