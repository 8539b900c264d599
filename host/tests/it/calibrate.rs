//! `delta-cal calibrate` on input that is in order.

use crate::support::{
    Folder, KEYS, NOISE, NOMINAL, Point, TOLERANCE, arms_of, assert_fails, csv, distance, exact,
    noisy, nominal_arms, platform, poses, true_arms,
};
use serde_json::Value;
use std::fmt::Write;

/// A folder with `robot.toml` and `samples.csv`.
fn folder(robot: &str, samples: &[(Point, Point)]) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot);
    folder.write("samples.csv", csv(samples));
    folder
}

fn assert_arms_near(found: &[[f64; 8]; 3], expected: &[[f64; 8]; 3], tolerance: f64) {
    for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
        assert!((found - expected).abs() < tolerance, "{found} {expected}");
    }
}

#[test]
fn the_built_in_example_is_calibrated_and_says_that_it_is_simulated() {
    let run = Folder::new().run("calibrate").ok();
    for part in [
        "simulated",
        "40 samples",
        "1  Dx",
        "3  Lb",
        "condition",
        "Nothing doubtful",
    ] {
        assert!(run.stdout.contains(part), "{part}: {}", run.stdout);
    }
    assert!(run.stdout.lines().all(|line| line.chars().count() <= 100));
    assert!(!run.stdout.contains('\u{1b}'), "colour in a pipe");
    assert!(run.stderr.is_empty());
}

#[test]
fn exact_measurements_give_back_the_robot_that_made_them() {
    let folder = folder(NOMINAL, &exact(&true_arms(), 30));
    for solver in ["lm", "gn"] {
        folder
            .run(&format!(
                "calibrate robot.toml samples.csv --solver {solver} --output out.toml"
            ))
            .ok();
        assert_arms_near(&arms_of(&folder.read("out.toml")), &true_arms(), 1e-7);
    }
}

#[test]
fn units_column_order_comments_mark_and_line_ends_do_not_matter() {
    let samples = exact(&true_arms(), 20);
    let mut text =
        String::from("\u{feff}# tracker, day 1\r\nz_m, q3_rad ,x_mm,q1_deg,q2_rad,y_m\r\n");
    for ([q1, q2, q3], [x, y, z]) in &samples {
        let (q2, q3, y, z) = (q2.to_radians(), q3.to_radians(), y / 1e3, z / 1e3);
        write!(text, "\r\n # a pose\r\n{z}, {q3},\"{x}\",{q1},{q2},{y}\r\n").unwrap();
    }
    let folder = folder(NOMINAL, &[]);
    folder.write("samples.csv", text);
    folder
        .run("calibrate robot.toml samples.csv --output out.toml")
        .ok();
    assert_arms_near(&arms_of(&folder.read("out.toml")), &true_arms(), 1e-7);
}

#[test]
fn the_report_as_json_agrees_with_the_calibrated_file() {
    let robot = format!("{NOMINAL}{TOLERANCE}\n[noise]\nposition_mm = 0.01\njoint_deg = 0.0\n");
    let samples = noisy(&true_arms(), 30, 0.01 * 3f64.sqrt());
    let folder = folder(&robot, &samples);
    let run = folder
        .run("calibrate robot.toml samples.csv --output out.toml --json -")
        .ok();
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(report["schema_version"], 1);
    assert_eq!(report["sample_count"], 30);
    assert_eq!(report["robot_file"], "robot.toml");
    assert_eq!(report["samples_file"], "samples.csv");
    assert_eq!(report["sensor_frame"], Value::Null);
    let calibrated = arms_of(&folder.read("out.toml"));
    let (mut squares, mut largest) = (0.0, 0.0_f64);
    for (k, (q, x)) in samples.iter().enumerate() {
        let error = distance(platform(&calibrated, *q), *x);
        squares += error * error;
        largest = largest.max(error);
        let sample = &report["samples"][k];
        assert_eq!(sample["line"], k + 2);
        assert!((sample["error_after_mm"].as_f64().unwrap() - error).abs() < 1e-9);
        let error = distance(platform(&nominal_arms(), *q), *x);
        assert!((sample["error_before_mm"].as_f64().unwrap() - error).abs() < 1e-9);
    }
    let after = &report["position_error_mm"]["after"];
    assert!((after["rms"].as_f64().unwrap() - (squares / 30.0).sqrt()).abs() < 1e-9);
    assert!((after["max"].as_f64().unwrap() - largest).abs() < 1e-9);
    // The positions elsewhere are as far off as the report expects.
    let elsewhere = poses(60).split_off(30);
    let errors = elsewhere.iter().map(|q| {
        let truth = platform(&true_arms(), *q);
        distance(platform(&calibrated, *q), truth).powi(2)
    });
    let rms = (errors.sum::<f64>() / 30.0).sqrt();
    let expected = report["workspace"]["position_sigma_mm"].as_f64().unwrap();
    assert!((0.3..2.0).contains(&(rms / expected)), "{rms} {expected}");
    let mut z_squares = 0.0;
    for (k, (arm, truth)) in calibrated.iter().zip(true_arms()).enumerate() {
        for (j, symbol) in ["Dx", "Dy", "Dz", "theta", "alpha", "La_x", "La_y", "Lb"]
            .into_iter()
            .enumerate()
        {
            let parameter = &report["arms"][k]["parameters"][j];
            assert_eq!(parameter["symbol"], symbol);
            assert_eq!(parameter["unit"] == "deg", KEYS[j].ends_with("deg"));
            let written = parameter["after"].as_f64().unwrap();
            assert_eq!(written.to_bits(), arm[j].to_bits());
            let sigma = parameter["sigma"].as_f64().unwrap();
            z_squares += ((arm[j] - truth[j]) / sigma).powi(2);
            assert!((0.0..=1.0).contains(&parameter["prior_share"].as_f64().unwrap()));
        }
    }
    // 24 errors of unit variance: Σz² is 24 ± 7.
    assert!((4.0..52.0).contains(&z_squares), "{z_squares}");
}

#[test]
fn json_and_calibrated_file_are_both_written_and_the_table_names_them() {
    let folder = folder(NOMINAL, &noisy(&true_arms(), 20, 0.01));
    let run = folder
        .run("calibrate robot.toml samples.csv --output out.toml --json report.json")
        .ok();
    assert!(
        run.stdout
            .contains("Written: out.toml\nWritten: report.json")
    );
    assert!(run.stdout.contains("Tip: state the [noise]"));
    let header = "# Options: --method joint --solver lm --frame base; tolerance not stated, noise \
                  not stated.\n";
    assert!(folder.read("out.toml").contains(header));
    let report: Value = serde_json::from_str(&folder.read("report.json")).unwrap();
    assert_eq!(report["method"], "joint");
    assert_eq!(
        folder.names(),
        ["out.toml", "report.json", "robot.toml", "samples.csv"]
    );
}

#[test]
fn a_calibrated_file_is_a_robot_file_with_the_same_numbers() {
    let robot = format!("{NOMINAL}{TOLERANCE}\n[noise]\nposition_mm = 0.01\njoint_deg = 0.001\n");
    let folder = folder(&robot, &noisy(&true_arms(), 30, 0.02));
    folder
        .run("calibrate robot.toml samples.csv --output first.toml")
        .ok();
    let run = folder
        .run("calibrate first.toml samples.csv --output second.toml --json -")
        .ok();
    // The second run's "before" is what the first one found, digit for digit.
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    for (k, arm) in arms_of(&folder.read("first.toml")).iter().enumerate() {
        for (j, value) in arm.iter().enumerate() {
            let before = report["arms"][k]["parameters"][j]["before"]
                .as_f64()
                .unwrap();
            assert_eq!(before.to_bits(), value.to_bits());
        }
    }
    for name in ["first.toml", "second.toml"] {
        let table: toml::Table = folder.read(name).parse().unwrap();
        let number = |section: &str, key: &str| table[section][key].as_float().unwrap();
        assert_eq!(number("joints", "min_deg").to_bits(), (-60f64).to_bits());
        assert_eq!(number("tolerance", "angle_deg").to_bits(), 0.2f64.to_bits());
        assert_eq!(number("noise", "joint_deg").to_bits(), 0.001f64.to_bits());
    }
}

/// A sensor far away, looking at the robot askew.
fn seen_by_sensor(x: Point) -> Point {
    let ((s1, c1), (s2, c2)) = (0.7f64.sin_cos(), 2.0f64.sin_cos());
    let (a, b) = (c1 * x[0] - s1 * x[1], s1 * x[0] + c1 * x[1]);
    let (b, c) = (c2 * b - s2 * x[2], s2 * b + c2 * x[2]);
    [a + 1500.0, b - 2000.0, c + 350.0]
}

#[test]
fn the_sensor_frame_takes_the_calibrated_robot_to_the_measured_points() {
    let mut samples = exact(&true_arms(), 30);
    for (_, x) in &mut samples {
        *x = seen_by_sensor(*x);
    }
    let folder = folder(NOMINAL, &samples);
    folder
        .run("calibrate robot.toml samples.csv --frame sensor --output out.toml")
        .ok();
    let text = folder.read("out.toml");
    let table: toml::Table = text.parse().unwrap();
    let frame = &table["sensor_frame"];
    let number = |value: &toml::Value| value.as_float().unwrap();
    let arms = arms_of(&text);
    for (q, measured) in &samples {
        let x = platform(&arms, *q);
        let mut seen = [0.0; 3];
        for i in 0..3 {
            seen[i] = number(&frame["translation_mm"][i]);
            for (j, c) in x.iter().enumerate() {
                seen[i] += number(&frame["rotation"][i][j]) * c;
            }
        }
        assert!(distance(seen, *measured) < 1e-6);
    }
    // The robot stays where the file says it is, to the size of its errors.
    assert_arms_near(&arms, &true_arms(), 5.0);

    // The file with a frame is read by every command.
    folder.run("forward out.toml samples.csv").ok();
    folder.write("points.csv", "x_mm,y_mm,z_mm\n0,0,-400\n");
    folder.run("inverse out.toml points.csv").ok();
    let again = folder.run("calibrate out.toml samples.csv --frame sensor --json -");
    assert!(again.code <= 1, "{}", again.stderr);
}

#[test]
fn in_the_wrong_frame_the_refusal_points_to_the_sensor_frame() {
    let mut samples = exact(&true_arms(), 30);
    for (_, x) in &mut samples {
        *x = seen_by_sensor(*x);
    }
    // Without a tolerance the parameters may absorb any frame, but the sensor's is nearly upside
    // down, and the platform would be above the elbows.
    for tolerance in [TOLERANCE, ""] {
        let folder = folder(&format!("{NOMINAL}{tolerance}"), &samples);
        let run = folder.run("calibrate robot.toml samples.csv --output out.toml");
        assert_eq!(run.code, 1, "{}", run.stdout);
        assert!(run.stderr.contains("--frame sensor"), "{}", run.stderr);
        assert_eq!(folder.names(), ["robot.toml", "samples.csv"]);
    }
}

#[test]
fn five_samples_with_a_tolerance_calibrate_and_say_what_the_tolerance_decided() {
    let samples = exact(&true_arms(), 5);
    let folder = folder(&format!("{NOMINAL}{TOLERANCE}{NOISE}"), &samples);
    let run = folder
        .run("calibrate robot.toml samples.csv --output out.toml --json report.json")
        .ok();
    assert!(run.stdout.contains("by tolerance"));
    assert!(
        run.stdout
            .contains("5 samples cannot determine the 8 parameters")
    );
    let report: Value = serde_json::from_str(&folder.read("report.json")).unwrap();
    // Five equations leave at least three of the eight parameters to the tolerance.
    for arm in report["arms"].as_array().unwrap() {
        let shares: f64 = arm["parameters"]
            .as_array()
            .unwrap()
            .iter()
            .map(|parameter| parameter["prior_share"].as_f64().unwrap())
            .sum();
        assert!((2.99..8.0).contains(&shares), "{shares}");
    }
    let arms = arms_of(&folder.read("out.toml"));
    for (q, x) in &samples {
        assert!(distance(platform(&arms, *q), *x) < 0.1);
    }
}

/// A tolerance does not tell the noise, and three samples leave nothing over.
#[test]
fn few_samples_without_a_noise_are_refused() {
    for count in [3, 5] {
        assert_fails(
            format!("{NOMINAL}{TOLERANCE}").as_bytes(),
            csv(&exact(&true_arms(), count)).as_bytes(),
            1,
            &["too few to estimate it", "state the [noise]"],
        );
    }
}

/// Terminal and JSON, and every key of it, state the same number.
#[test]
fn the_expected_error_is_one_number() {
    let robot = format!("{NOMINAL}{TOLERANCE}\n[noise]\nposition_mm = 0.02\njoint_deg = 0\n");
    // Uniform errors of up to 0.034 mm have a σ of 0.02 mm.
    let folder = folder(&robot, &noisy(&true_arms(), 30, 0.034));
    let run = folder
        .run("calibrate robot.toml samples.csv --json report.json")
        .ok();
    let report: serde_json::Value = serde_json::from_str(&folder.read("report.json")).unwrap();
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let expected = &report["expected_error"];
    let rms = number(&expected["absolute_rms_mm"]);
    assert!((number(&report["workspace"]["position_sigma_mm"]) / rms - 1.0).abs() < 1e-9);
    let map = &report["position_uncertainty"];
    assert_eq!(map["rms_mm"], expected["absolute_rms_mm"]);
    let worst = number(&expected["absolute_worst_mm"]);
    assert_eq!(map["max_mm"], expected["absolute_worst_mm"]);
    assert!(
        run.stdout
            .contains(&format!("calibrated robot: {rms:.4} mm")),
        "{}",
        run.stdout
    );
    assert!(
        run.stdout.contains(&format!("at worst {worst:.4} mm")),
        "{}",
        run.stdout
    );
    let intrinsic = number(&expected["intrinsic_rms_mm"]);
    assert!(0.0 < intrinsic && intrinsic < rms);
    assert!(intrinsic < number(&expected["intrinsic_worst_mm"]));
    assert!(number(&report["workspace"]["chance_of_harm"]) < 0.005);
}

#[test]
fn too_few_samples_to_know_the_error_are_refused() {
    for (samples, robot, cause) in [
        (
            8,
            NOMINAL.to_owned(),
            "neither a [noise] nor a [tolerance] is stated",
        ),
        (
            10,
            NOMINAL.to_owned(),
            "10 samples are too few to estimate the noise",
        ),
        (
            8,
            format!("{NOMINAL}\n[noise]\nposition_mm = 0.02\njoint_deg = 0\n"),
            "fit several robots exactly",
        ),
    ] {
        let folder = folder(&robot, &exact(&true_arms(), samples));
        // Three residuals a sample tell the joint method the noise from ten samples.
        let run = folder.run("calibrate robot.toml samples.csv --method ikm --output out.toml");
        assert_eq!(run.code, 1, "{}", run.stdout);
        for part in [
            cause,
            "measure 12 poses or more",
            "state the robot's manufacturing",
        ] {
            assert!(run.stderr.contains(part), "{part}: {}", run.stderr);
        }
        assert_eq!(folder.names(), ["robot.toml", "samples.csv"]);
    }
    let folder = folder(NOMINAL, &exact(&true_arms(), 11));
    let run = folder.run("calibrate robot.toml samples.csv").ok();
    assert!(run.stdout.contains("11 samples are few"), "{}", run.stdout);
}

#[test]
fn a_residual_far_below_the_stated_noise_is_doubtful() {
    let robot = format!("{NOMINAL}\n[noise]\nposition_mm = 0.05\njoint_deg = 0.0\n");
    let folder = folder(&robot, &noisy(&true_arms(), 40, 0.001));
    let run = folder.run("calibrate robot.toml samples.csv").ok();
    assert!(run.stdout.contains("overstated"), "{}", run.stdout);
}

#[test]
fn the_robot_file_is_replaced_only_with_force() {
    let folder = folder(NOMINAL, &noisy(&true_arms(), 30, 0.01));
    for same in ["robot.toml", "./robot.toml"] {
        let run = folder.run(&format!("calibrate robot.toml samples.csv --output {same}"));
        assert_eq!(run.code, 2);
        assert!(run.stderr.contains("--force"), "{}", run.stderr);
    }
    assert_eq!(folder.read("robot.toml"), NOMINAL);
    folder
        .run("calibrate robot.toml samples.csv --output robot.toml --force")
        .ok();
    assert_arms_near(&arms_of(&folder.read("robot.toml")), &true_arms(), 0.2);
}

#[test]
fn samples_come_from_standard_input_too() {
    let samples = csv(&exact(&true_arms(), 20));
    let folder = folder(NOMINAL, &[]);
    folder
        .run_with("calibrate robot.toml - --output out.toml", &samples)
        .ok();
    assert_arms_near(&arms_of(&folder.read("out.toml")), &true_arms(), 1e-7);
}

#[test]
fn columns_that_begin_with_an_underscore_are_not_looked_at() {
    let mut text = String::from("_point,q1_deg,q2_deg,_,q3_deg,x_mm,y_mm,z_mm,_time; local\n");
    for ([q1, q2, q3], [x, y, z]) in exact(&true_arms(), 20) {
        writeln!(text, "\"P 1\",{q1},{q2},,{q3},{x},{y},{z},12:30").unwrap();
    }
    let folder = folder(NOMINAL, &[]);
    folder.write("samples.csv", text);
    folder
        .run("calibrate robot.toml samples.csv --output out.toml")
        .ok();
    assert_arms_near(&arms_of(&folder.read("out.toml")), &true_arms(), 1e-7);
}

#[test]
fn repeated_poses_are_counted() {
    let mut samples = noisy(&true_arms(), 25, 0.01);
    samples.extend(noisy(&true_arms(), 5, 0.005));
    let run = folder(NOMINAL, &samples)
        .run("calibrate robot.toml samples.csv")
        .ok();
    assert!(
        run.stdout.contains("30 samples at 25 distinct poses"),
        "{}",
        run.stdout
    );
}

#[test]
fn the_same_samples_leave_the_robot_where_it_is() {
    let folder = folder(NOMINAL, &noisy(&true_arms(), 30, 0.02));
    folder
        .run("calibrate robot.toml samples.csv --output first.toml")
        .ok();
    let run = folder
        .run("calibrate first.toml samples.csv --output second.toml")
        .ok();
    assert!(
        run.stdout.contains("the samples do not change the robot"),
        "{}",
        run.stdout
    );
    // Far below the samples' noise of 0.02 mm.
    let first = arms_of(&folder.read("first.toml"));
    assert_arms_near(&arms_of(&folder.read("second.toml")), &first, 2e-3);
}
