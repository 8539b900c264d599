//! `delta-cal validate`: a robot file against independent measurements and a limit.

use crate::support::{
    Arm, Folder, NOMINAL, Point, Run, csv, exact, nominal_arms, poses, true_arms,
};
use serde_json::Value;
use std::fmt::Write;

const NOISE: &str = "\n[noise]\nposition_mm = 0.01\njoint_deg = 0\n";

/// Every row is this far from where the nominal robot is.
fn shifted(count: u32, by: Point) -> Vec<(Point, Point)> {
    let mut samples = exact(&nominal_arms(), count);
    for (_, x) in &mut samples {
        for (own, by) in x.iter_mut().zip(by) {
            *own += by;
        }
    }
    samples
}

fn folder(robot: &str, samples: &[(Point, Point)]) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot);
    folder.write("check.csv", csv(samples));
    folder
}

fn validate(folder: &Folder, options: &str) -> Run {
    folder.run(&format!("validate robot.toml check.csv {options}"))
}

fn report(run: &Run) -> Value {
    serde_json::from_str(&run.stdout).unwrap()
}

fn near(value: &Value, expected: f64, within: f64) {
    let value = value.as_f64().unwrap();
    assert!((value - expected).abs() < within, "{value} {expected}");
}

/// 16 rows that are all off by 0.05 mm: c = 15·(2/3)/(15 + 15) and ν = 2·16/c = 96, for which the quantiles of χ²
/// are 70.7828 and 125.0001 (regularised incomplete gamma function, its series summed).
#[test]
fn the_figures_are_those_of_the_chi_square_distribution() {
    let folder = folder(
        &format!("{NOMINAL}{NOISE}"),
        &shifted(16, [0.03, -0.04, 0.0]),
    );
    let run = validate(&folder, "--limit 55um --json -");
    assert_eq!(run.code, 6, "{}", run.stderr);
    let report = report(&run);
    let rms = &report["rms_error"];
    near(&rms["degrees_of_freedom"], 96.0, 1e-6);
    // √(0.0025 − 3·0.01²)
    near(&rms["estimate_mm"], 0.046_904_157, 1e-6);
    near(&rms["interval_mm"][0], 0.040_249_210, 1e-6);
    near(&rms["interval_mm"][1], 0.055_593_643, 1e-6);
    near(&rms["confidence_below_limit"], 0.966_891_573, 1e-6);
    let largest = &report["largest_error"];
    near(&largest["interval_mm"][0], 0.05 - 0.01 * 3.914_101, 1e-6);
    near(&largest["interval_mm"][1], 0.05 + 0.01 * 1.959_964, 1e-6);
    near(&report["deviation_mm"]["rms"], 0.05, 1e-9);
    near(&report["noise_mm"], 0.01 * 3_f64.sqrt(), 1e-6);
}

#[test]
fn a_robot_passes_fails_or_is_undecided_with_its_exit_code() {
    let folder = folder(
        &format!("{NOMINAL}{NOISE}"),
        &shifted(16, [0.03, -0.04, 0.0]),
    );
    for (limit, code, verdict) in [
        ("0.1mm", 0, "pass"),
        ("0.0472mm", 6, "undecided"),
        ("20um", 6, "fail"),
    ] {
        let run = validate(
            &folder,
            &format!("--limit {limit} --json - --report page.html"),
        );
        assert_eq!(run.code, code, "{limit}: {}", run.stderr);
        let report = report(&run);
        assert_eq!(report["verdict"], verdict);
        assert_eq!(report["passed"], verdict == "pass");
        // A certificate of a robot that fails is written as well.
        assert!(
            folder
                .read("page.html")
                .contains("Validation of robot.toml")
        );
    }
    let run = validate(&folder, "--limit 0.05mm");
    assert_eq!(run.code, 6);
    assert!(run.stdout.contains("Measure "), "{}", run.stdout);
    // The interval in digits of its width.
    assert!(
        run.stdout.contains("0.0469  0.0402 to 0.0556"),
        "{}",
        run.stdout
    );
}

/// As many poses as the report asks for, which scatter as the others, decide it.
#[test]
fn as_many_poses_as_are_asked_for_decide() {
    let robot = format!("{NOMINAL}{NOISE}");
    let few = folder(&robot, &shifted(16, [0.03, -0.04, 0.0]));
    let run = validate(&few, "--limit 0.051mm --json -");
    let asked = report(&run)["rms_error"]["poses_to_decide"]
        .as_u64()
        .unwrap();
    assert!(asked > 16, "{asked}");
    // All rows are alike, so that the scatter falls with every further one: enough, and more than needed.
    let asked = u32::try_from(asked).unwrap();
    let many = folder(&robot, &shifted(asked, [0.03, -0.04, 0.0]));
    assert_eq!(validate(&many, "--limit 0.051mm").code, 0);
}

#[test]
fn without_a_noise_a_robot_can_pass_and_not_fail() {
    let folder = folder(NOMINAL, &shifted(16, [0.03, -0.04, 0.0]));
    let run = validate(&folder, "--limit 0.1mm --json -");
    assert_eq!(run.code, 0);
    let passed = report(&run);
    near(&passed["rms_error"]["estimate_mm"], 0.05, 1e-9);
    assert_eq!(passed["rms_error"]["interval_mm"][0], 0.0);
    assert_eq!(passed["noise_mm"], Value::Null);
    let run = validate(&folder, "--limit 0.01mm");
    assert_eq!(run.code, 6);
    assert!(run.stdout.contains("State the [noise]"), "{}", run.stdout);
}

/// A noise that is stated ten times too large would hide the error: it is not removed.
#[test]
fn a_noise_stated_too_large_is_not_removed() {
    let noise = "\n[noise]\nposition_mm = 0.5\njoint_deg = 0\n";
    let folder = folder(
        &format!("{NOMINAL}{noise}"),
        &shifted(16, [0.03, -0.04, 0.0]),
    );
    let run = validate(&folder, "--limit 0.02mm --json -");
    assert_eq!(run.code, 6, "{}", run.stdout);
    let report = report(&run);
    near(&report["rms_error"]["estimate_mm"], 0.05, 1e-9);
    let warning = report["warnings"][0].as_str().unwrap();
    assert!(warning.contains("stated too large"), "{warning}");
    // Without a noise nothing bounds the interval from below.
    let run = validate(&folder, "--limit 0.02mm");
    assert!(run.stdout.contains(" below 0.0"), "{}", run.stdout);
}

/// In the sensor's frame a rigid motion counts for nothing, and six coordinates are used up by it.
#[test]
fn in_the_frame_of_a_sensor_a_rigid_motion_does_not_count() {
    let mut samples = exact(&nominal_arms(), 20);
    let (sin, cos) = 0.4_f64.sin_cos();
    for (_, x) in &mut samples {
        *x = [
            cos * x[0] - sin * x[1] + 700.0,
            sin * x[0] + cos * x[1] - 20.0,
            x[2] + 300.0,
        ];
    }
    let folder = folder(NOMINAL, &samples);
    let run = validate(&folder, "--limit 1um --frame sensor --json -");
    assert_eq!(run.code, 0, "{}", run.stderr);
    let report = report(&run);
    near(&report["deviation_mm"]["max"], 0.0, 1e-6);
    near(&report["sensor_frame"]["translation_mm"][0], 700.0, 1e-6);
    let run = validate(&folder, "--limit 1um");
    assert_eq!(run.code, 1);
    assert!(run.stderr.contains("--frame sensor"), "{}", run.stderr);
}

/// Rows of one pose share the robot's error.
#[test]
fn rows_of_one_pose_count_once() {
    let mut samples = shifted(10, [0.03, 0.0, 0.0]);
    // A row that equals another to the last digit would be one measurement.
    let again: Vec<_> = samples
        .iter()
        .map(|(q, x)| (*q, x.map(|x| x + 1e-8)))
        .collect();
    samples.extend(again);
    let folder = folder(NOMINAL, &samples);
    let report = report(&validate(&folder, "--limit 1mm --json -"));
    assert_eq!(
        (&report["row_count"], &report["pose_count"]),
        (&20.into(), &10.into())
    );
    let once = self::folder(NOMINAL, &shifted(10, [0.03, 0.0, 0.0]));
    let once = self::report(&validate(&once, "--limit 1mm --json -"));
    near(
        &report["rms_error"]["degrees_of_freedom"],
        once["rms_error"]["degrees_of_freedom"].as_f64().unwrap(),
        1e-6,
    );
}

/// Heights above a plane, off by ±0.03 mm in turn: of a known plane all of that is error, of an unknown one not what a
/// plane takes up.
#[test]
fn heights_are_validated_above_known_and_unknown_planes() {
    let mut heights = String::from("q1_deg,q2_deg,q3_deg,height_mm,plane\n");
    let mut raised = heights.clone();
    for (index, (q, x)) in exact(&nominal_arms(), 40).into_iter().enumerate() {
        let off = if index % 2 == 0 { 0.03 } else { -0.03 };
        let height = x[2] + 700.0 + off;
        let _ = writeln!(heights, "{},{},{},{height:.6},table", q[0], q[1], q[2]);
        let _ = writeln!(
            raised,
            "{},{},{},{:.6},table",
            q[0],
            q[1],
            q[2],
            height + 0.5
        );
    }
    let noise = "\n[noise]\nheight_mm = 0.001\njoint_deg = 0\n";
    let known = "[planes.table]\nz_mm = -700\nsigma_mm = 0.0001\ntilt_deg = 0.00001\n";
    for (planes, heights, rms, limit) in [
        (known, &heights, 0.03, "0.05mm"),
        ("", &heights, 0.03, "0.05mm"),
        ("", &raised, 0.03, "0.05mm"),
        (known, &raised, 0.5, "1mm"),
    ] {
        let folder = Folder::new();
        folder.write("robot.toml", format!("{NOMINAL}{noise}{planes}"));
        folder.write("check.csv", heights);
        let run = validate(&folder, &format!("--limit {limit} --json -"));
        assert_eq!(run.code, 0, "{planes}: {}", run.stderr);
        let report = report(&run);
        near(&report["rms_error"]["estimate_mm"], rms, 0.1 * rms);
        let text = validate(&folder, &format!("--limit {limit}")).stdout;
        assert!(text.contains("Height error"), "{text}");
    }
}

/// A constant offset is taken up by a frame that is fitted, and not by one that is stored.
#[test]
fn a_stored_frame_is_not_fitted_again() {
    let frame = "\n[sensor_frame]\nrotation = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]\ntranslation_mm = [700, 10, -5]\n";
    let target = "\n[target]\nx_mm = 1\ny_mm = 2\nz_mm = -30\n";
    let mut samples = exact(&nominal_arms(), 20);
    for (_, x) in &mut samples {
        let [a, b, c] = [x[0] + 1.0, x[1] + 2.0, x[2] - 30.0];
        *x = [700.0 - b, 10.0 + a, -5.0 + c + 0.2];
    }
    let folder = folder(&format!("{NOMINAL}{NOISE}{frame}{target}"), &samples);
    for (of, deviation, code) in [("stored", 0.2, 6), ("sensor", 0.0, 0)] {
        let run = validate(&folder, &format!("--limit 0.1mm --frame {of} --json -"));
        assert_eq!(run.code, code, "{of}: {}", run.stderr);
        near(&report(&run)["deviation_mm"]["rms"], deviation, 1e-6);
    }
    let without = self::folder(&format!("{NOMINAL}{NOISE}"), &samples);
    let run = validate(&without, "--limit 0.1mm --frame stored");
    assert_eq!(run.code, 3);
    assert!(run.stderr.contains("[sensor_frame]"), "{}", run.stderr);
}

/// Points of the machine that fix no frame, or are not where the sensor saw them, are refused and not left out.
#[test]
fn datum_points_that_are_none_are_refused() {
    let point = |name: &str, [x, y, z]: Point, [a, b, c]: Point| {
        format!("[datum.{name}]\nx_mm = {x}\ny_mm = {y}\nz_mm = {z}\nsensor_mm = [{a}, {b}, {c}]\n")
    };
    let two = point("A", [300.0, 0.0, -500.0], [0.0, 0.0, 0.0])
        + &point("B", [0.0, 300.0, -500.0], [-300.0, 300.0, 0.0]);
    let line = two.clone() + &point("C", [150.0, 150.0, -500.0], [-150.0, 150.0, 0.0]);
    let off = two.clone() + &point("C", [0.0, 0.0, -500.0], [-300.0, 1.0, 0.0]);
    for (datum, cause) in [
        (&two, "2 datum points"),
        (&line, "on a line"),
        (&off, "do not fit"),
    ] {
        let folder = folder(&format!("{NOMINAL}{NOISE}{datum}"), &shifted(12, [0.0; 3]));
        for command in [
            "validate robot.toml check.csv --limit 1mm --frame sensor",
            "calibrate robot.toml check.csv --frame sensor",
        ] {
            let run = folder.run(command);
            assert_eq!(run.code, 3, "{command}: {}", run.stderr);
            let all = run.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(
                all.contains("[datum]") && all.contains(cause),
                "{command}: {all}"
            );
        }
    }
}

fn refused(robot: &str, samples: &str, code: i32, words: &[&str]) {
    let folder = Folder::new();
    folder.write("robot.toml", robot);
    folder.write("check.csv", samples);
    let run = validate(
        &folder,
        "--limit 0.1mm --report page.html --json report.json",
    );
    assert_eq!(run.code, code, "{}", run.stderr);
    for word in words {
        assert!(run.stderr.contains(word), "{word}: {}", run.stderr);
    }
    assert_eq!(folder.names(), ["check.csv", "robot.toml"]);
}

#[test]
fn what_cannot_be_validated_is_refused_with_place_cause_and_remedy() {
    let few = csv(&shifted(7, [0.03, 0.0, 0.0]));
    refused(
        NOMINAL,
        &few,
        1,
        &["7 different poses", "at least 8", "measure some 20"],
    );
    let heights = "q1_deg,q2_deg,q3_deg,height_mm\n10,20,30,0\n12,20,30,0\n";
    let robot = format!("{NOMINAL}\n[noise]\nheight_mm = 0.02\njoint_deg = 0\n");
    refused(&robot, heights, 1, &["2 different poses", "at least 8"]);
    // Metres under a header of millimetres.
    let metres: Vec<_> = exact(&true_arms(), 12)
        .into_iter()
        .map(|(q, x)| (q, x.map(|x| x / 1000.0)))
        .collect();
    refused(
        NOMINAL,
        &csv(&metres),
        1,
        &["half of the measured positions", "metres"],
    );
    // Joint angles at which these short forearms do not meet.
    let short = NOMINAL.replace("480", "300");
    let mut rows = csv(&shifted(12, [0.0; 3]));
    rows.push_str("-55,-55,80,0,0,-300\n");
    refused(&short, &rows, 3, &["check.csv:", "does not reach"]);
}

#[test]
fn the_measurements_of_the_calibration_are_no_validation() {
    let folder = folder(&format!("{NOMINAL}{NOISE}"), &exact(&true_arms(), 20));
    let run = folder.run("calibrate robot.toml check.csv --output calibrated.toml");
    assert_eq!(run.code, 0, "{}", run.stderr);
    let run = folder.run("validate calibrated.toml check.csv --limit 1mm");
    assert_eq!(run.code, 3);
    assert!(
        run.stderr.contains("these very measurements"),
        "{}",
        run.stderr
    );
    let other: Vec<(Point, Point)> = poses(60)[20..]
        .iter()
        .map(|q| (*q, crate::support::platform(&true_arms() as &[Arm; 3], *q)))
        .collect();
    folder.write("other.csv", csv(&other));
    let run = folder.run("validate calibrated.toml other.csv --limit 1mm");
    assert_eq!(run.code, 0, "{}", run.stderr);
}
