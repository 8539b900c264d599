//! The command `calibrate`: what it writes, what it refuses, and its exit codes.

use crate::support::{
    Folder, HEADER, NOISE, NOMINAL, TOLERANCE, arms_of, csv, exact, good_samples, noisy,
    nominal_arms, robot_toml, true_arms,
};
use serde_json::Value;
use std::fmt::Write;

fn folder(robot: &str, samples: &str) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot);
    folder.write("samples.csv", samples);
    folder
}

fn stated() -> String {
    format!("{NOMINAL}{TOLERANCE}{NOISE}")
}

#[test]
fn exact_samples_give_back_the_robot() {
    let folder = folder(&stated(), &good_samples());
    folder
        .run("calibrate robot.toml samples.csv --output out.toml")
        .ok();
    let found = arms_of(&folder.read("out.toml"));
    let json = folder.run("calibrate robot.toml samples.csv --json -").ok();
    let json: serde_json::Value = serde_json::from_str(&json.stdout).unwrap();
    // Without noise the tolerance alone draws it away, by less than its own part of σ.
    for (arm, (found, truth)) in found.iter().zip(&true_arms()).enumerate() {
        for (place, (found, truth)) in found.iter().zip(truth).enumerate() {
            let sigma = json["arms"][arm]["parameters"][place]["sigma"]
                .as_f64()
                .unwrap();
            assert!(
                (found - truth).abs() < sigma,
                "{found} ± {sigma} for {truth}"
            );
        }
    }
    // The result is a robot file again, which the same samples do not change.
    let again = folder.run("calibrate out.toml samples.csv").ok();
    assert!(
        again.stdout.contains("do not change the robot"),
        "{}",
        again.stdout
    );
}

#[test]
fn the_report_has_the_same_parts_in_text_json_and_html() {
    let samples = csv(&noisy(&true_arms(), 30, 0.02));
    let folder = folder(&stated(), &samples);
    let run = folder
        .run("calibrate robot.toml samples.csv --json report.json --report report.html")
        .ok();
    let json: Value = serde_json::from_str(&folder.read("report.json")).unwrap();
    let html = folder.read("report.html");
    assert_eq!(json["schema_version"], 2);
    for part in [
        "Parameters",
        "Errors over the samples",
        "Noise",
        "Expected position error",
        "What to measure next",
    ] {
        assert!(run.stdout.contains(part), "text: {part}");
        assert!(html.contains(part), "page: {part}");
    }
    let parameter = &json["arms"][1]["parameters"][7];
    assert_eq!(parameter["symbol"], "Lb");
    let shown = format!("{:.4}", parameter["after"].as_f64().unwrap());
    assert!(
        run.stdout.contains(&shown) && html.contains(&shown),
        "{shown}"
    );
    assert!(
        !html.contains("src=\"http") && !html.contains("href=\"http") && !html.contains("<script"),
        "the page needs nothing"
    );
    assert_eq!(
        json["document"]["samples_file"]["sha256"]
            .as_str()
            .unwrap()
            .len(),
        64
    );
}

#[test]
fn the_schema_of_the_json_holds_every_key() {
    let folder = folder(&stated(), &csv(&noisy(&true_arms(), 30, 0.02)));
    folder.write(
        "printer.cfg",
        include_str!("../../examples/printer/printer.cfg"),
    );
    let schema = include_str!("../../../docs/calibration.schema.json");
    let schema: Value = serde_json::from_str(schema).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    let page = include_str!("../../../docs/json.md");
    for files in ["robot.toml samples.csv", "printer.cfg"] {
        let run = folder.run(&format!("calibrate {files} --json -")).ok();
        let json: Value = serde_json::from_str(&run.stdout).unwrap();
        let errors = validator.iter_errors(&json).map(|error| error.to_string());
        let errors: Vec<_> = errors.collect();
        assert!(errors.is_empty(), "{files}: {errors:#?}");
        for key in json.as_object().unwrap().keys() {
            assert!(schema["properties"].get(key).is_some(), "schema: {key}");
            assert!(page.contains(&format!("`{key}`")), "docs/json.md: {key}");
        }
        let printer = json["printer"].as_object().into_iter().flatten();
        for (key, _) in printer {
            let described = &schema["properties"]["printer"]["properties"];
            assert!(described.get(key).is_some(), "schema: {key}");
        }
    }
}

/// Joint angles and position.
type Sample = ([f64; 3], [f64; 3]);

/// Samples, options, exit code, and what is said; the robot file states tolerance and noise.
#[test]
fn what_cannot_be_right_is_refused_with_its_cause_and_nothing_is_written() {
    let good = exact(&true_arms(), 20);
    let with = |change: &dyn Fn(usize, &mut Sample)| {
        let mut rows = good.clone();
        rows.iter_mut()
            .enumerate()
            .for_each(|(index, row)| change(index, row));
        csv(&rows)
    };
    let gap = good_samples().replacen(&format!("{}\n", good[4].1[2]), "\n", 1);
    let cases = [
        (
            gap,
            "",
            3,
            "samples.csv:6: column z_mm: the cell is blank in 1 of 20 rows",
        ),
        (
            format!("{HEADER}1,2,3,4,5,6\n1,2,3,4,5,6\n"),
            "",
            3,
            "equal to the last digit",
        ),
        (with(&|_, row| row.0.swap(0, 1)), "", 1, "q1_deg and q2_deg"),
        (
            with(&|_, row| row.1 = row.1.map(|x| x / 25.4)),
            "",
            1,
            "inches",
        ),
        (
            with(&|index, row| {
                if index == 7 {
                    row.1[0] += 3.0;
                }
            }),
            "",
            1,
            "line 9",
        ),
        (
            with(&|_, row| row.1 = [1.0, 2.0, -400.0]),
            "--frame sensor",
            1,
            "in one spot",
        ),
        (csv(&good[..3]), "--robust", 1, "too few"),
        (
            good_samples(),
            "--frame sensor --method joint",
            3,
            "--method fkm",
        ),
    ];
    for (samples, options, code, expected) in cases {
        let folder = folder(&stated(), &samples);
        let command = format!(
            "calibrate robot.toml samples.csv --output out.toml --json report.json {options}"
        );
        let run = folder.run(&command);
        assert_eq!(run.code, code, "{expected}: {}{}", run.stderr, run.stdout);
        assert!(run.stderr.contains(expected), "{expected}: {}", run.stderr);
        assert!(run.stderr.contains("help: "), "{}", run.stderr);
        assert_eq!(folder.names(), ["robot.toml", "samples.csv"], "{expected}");
    }
}

#[test]
fn without_tolerance_and_noise_five_samples_are_refused_and_thirty_are_not() {
    let of = |count| folder(NOMINAL, &csv(&noisy(&true_arms(), count, 0.02)));
    let few = of(5).run("calibrate robot.toml samples.csv");
    assert_eq!(few.code, 1, "{}", few.stdout);
    let json = of(30)
        .run("calibrate robot.toml samples.csv --json -")
        .ok()
        .stdout;
    let json: Value = serde_json::from_str(&json).unwrap();
    let noise = &json["noise"][0];
    assert_eq!(noise["verdict"], "estimated");
    // Uniform within ±0.02 mm: σ is 0.0115 mm; of 66 degrees of freedom it is known to 9 %.
    let sigma = noise["sigma_mm"].as_f64().unwrap();
    assert!((0.0085..0.0148).contains(&sigma), "{sigma}");
    assert!(noise["degrees_of_freedom"].as_f64().unwrap() > 60.0);
}

#[test]
fn a_limit_that_is_not_met_has_its_exit_code_and_everything_is_written() {
    let folder = folder(&stated(), &csv(&noisy(&true_arms(), 20, 0.02)));
    let passed = folder
        .run("calibrate robot.toml samples.csv --limit 5mm")
        .ok();
    assert!(passed.stdout.contains("Pass: "), "{}", passed.stdout);
    let failed = folder.run("calibrate robot.toml samples.csv --limit 1um --output out.toml");
    assert_eq!(failed.code, 6, "{}", failed.stderr);
    assert!(failed.stdout.contains("Fail: "), "{}", failed.stdout);
    assert!(folder.names().contains(&"out.toml".to_owned()));
}

#[test]
fn copies_count_once_and_repeats_show_the_repeatability() {
    let mut rows = noisy(&true_arms(), 20, 0.01);
    rows.push(rows[0]);
    let mut again = rows[1];
    again.1[0] += 0.015;
    rows.push(again);
    let folder = folder(&stated(), &csv(&rows));
    let json = folder
        .run("calibrate robot.toml samples.csv --json -")
        .ok()
        .stdout;
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["sample_count"], 21);
    let kinds: Vec<_> = json["findings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|own| own["kind"].as_str().unwrap())
        .collect();
    assert!(
        kinds.contains(&"copies") && kinds.contains(&"repeatability"),
        "{kinds:?}"
    );
    let of = |kind: &str| {
        json["findings"]
            .as_array()
            .unwrap()
            .iter()
            .find(|own| own["kind"] == kind)
            .unwrap()
            .clone()
    };
    assert_eq!(of("copies")["lines"][0], 22);
    // √(0.015²/2 / 3): one difference among the three coordinates of one repeated pose.
    let sigma = of("repeatability")["sigma_mm"].as_f64().unwrap();
    assert!((sigma - 0.015 / 6.0_f64.sqrt()).abs() < 1e-6, "{sigma}");
}

/// Rows of a camera, each without z, and others of a gauge, with z alone.
#[test]
fn blanks_that_whole_groups_of_rows_have_are_meant() {
    let mut text = HEADER.to_owned();
    for (index, ([q1, q2, q3], [x, y, z])) in exact(&true_arms(), 40).into_iter().enumerate() {
        let written = if index % 2 == 0 {
            writeln!(text, "{q1},{q2},{q3},{x},{y},")
        } else {
            writeln!(text, "{q1},{q2},{q3},,,{z}")
        };
        written.unwrap();
    }
    let folder = folder(&stated(), &text);
    let json = folder
        .run("calibrate robot.toml samples.csv --json -")
        .ok()
        .stdout;
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["method"], "fkm");
    assert_eq!(json["reading_count"], 60);
}

#[test]
fn a_refusal_on_standard_output_is_json() {
    let mut rows = exact(&true_arms(), 20);
    for row in &mut rows {
        row.0.swap(0, 1);
    }
    let folder = folder(&robot_toml(&nominal_arms()), &csv(&rows));
    let run = folder.run("calibrate robot.toml samples.csv --json -");
    assert_eq!(run.code, 1);
    let json: Value = serde_json::from_str(&run.stdout).unwrap();
    assert!(json["refused"].is_string() && json["remedy"].is_string());
    assert!(
        json["diagnosis"]["explanations"][0]["cause"]
            .as_str()
            .unwrap()
            .contains("exchanged")
    );
}
