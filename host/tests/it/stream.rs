//! `delta-cal calibrate` with `--gate`, `--held-out` and `--forget`.

use crate::support::{
    Folder, KEYS, NOMINAL, Point, TOLERANCE, arms_of, csv, exact, noisy, nominal_arms, true_arms,
};
use delta_cal::robust::Loss;
use delta_cal_host::files::example;
use delta_cal_host::{CalibrationMethod, Options, OptionsError, Reason, Streaming, calibrate};
use serde_json::Value;
use std::num::NonZeroU32;

const NOISE: &str = "\n[noise]\nposition_mm = 0.02\njoint_deg = 0\n";

fn folder(samples: &[(Point, Point)]) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{NOISE}{TOLERANCE}"));
    folder.write("samples.csv", csv(samples));
    folder
}

/// Uniform errors of up to 0.034 mm have a σ of 0.02 mm.
fn measured() -> Vec<(Point, Point)> {
    noisy(&true_arms(), 60, 0.034)
}

fn json(folder: &Folder) -> Value {
    serde_json::from_str(&folder.read("report.json")).unwrap()
}

fn assert_same_robot(a: &str, b: &str) {
    for (a, b) in arms_of(a).iter().flatten().zip(arms_of(b).iter().flatten()) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn rows_that_disagree_with_those_before_are_left_out_and_named() {
    let mut samples = measured();
    let wrong = [20, 33, 34, 51];
    for (number, index) in wrong.into_iter().enumerate() {
        samples[index].1[number % 3] += 5.0;
    }
    // A joint angle spoils one arm alone.
    samples[40].0[1] += 1.0;
    let folder = folder(&samples);
    let run = folder
        .run("calibrate robot.toml samples.csv --gate --json report.json --output out.toml --report r.html")
        .ok();
    assert!(
        run.stdout
            .contains("Gate: 55 samples accepted, 5 rejected, tested from line 2 on"),
        "{}",
        run.stdout
    );
    assert!(run.stdout.lines().all(|line| line.chars().count() <= 100));

    let report = json(&folder);
    let gate = &report["stream"]["gate"];
    assert_eq!(gate["taken"], 55);
    assert_eq!(gate["untested"], 0);
    assert_eq!(gate["longest_run"], 2);
    let rejected = gate["rejected"].as_array().unwrap();
    let lines: Vec<u64> = rejected
        .iter()
        .map(|row| row["line"].as_u64().unwrap())
        .collect();
    assert_eq!(lines, [22, 35, 36, 42, 53]);
    for row in rejected {
        assert!(row["sigma"].as_f64().unwrap().abs() > 20.0, "{row}");
    }
    assert_eq!(rejected[3]["arm"], 2);
    // Every row is somewhere: as suspected, and in the warning.
    assert_eq!(report["suspected_samples"].as_array().unwrap().len(), 5);
    let page = folder.read("r.html");
    assert!(page.contains("<h2>Gate</h2>") && page.contains("5 rejected"));
    assert!(folder.read("out.toml").contains("--gate"));

    // What is left is calibrated as if the others had never been there.
    let good = samples
        .iter()
        .enumerate()
        .filter(|(index, _)| *index != 40 && !wrong.contains(index))
        .map(|(_, sample)| *sample);
    folder.write("good.csv", csv(&good.collect::<Vec<_>>()));
    folder
        .run("calibrate robot.toml good.csv --output good.toml")
        .ok();
    assert_same_robot(&folder.read("out.toml"), &folder.read("good.toml"));
}

#[test]
fn a_robot_that_changes_in_the_middle_is_refused_with_the_line() {
    let mut changed = true_arms();
    changed[2][7] += 1.0;
    let mut samples = noisy(&true_arms(), 60, 0.034);
    let after = noisy(&changed, 60, 0.034);
    samples[40..].copy_from_slice(&after[40..]);
    let folder = folder(&samples);
    let run = folder.run("calibrate robot.toml samples.csv --gate --output out.toml");
    assert_eq!(run.code, 1, "{}", run.stdout);
    for part in [
        "the 20 samples from line 42 on disagree",
        "the robot has changed",
        "40 samples before",
    ] {
        assert!(run.stderr.contains(part), "{part}: {}", run.stderr);
    }
    assert!(!folder.names().contains(&"out.toml".to_owned()));
}

#[test]
fn rows_that_disagree_with_the_robot_file_from_the_start_are_not_a_changed_robot() {
    let mut exchanged = measured();
    for (q, _) in &mut exchanged {
        q.swap(0, 1);
    }
    let run = folder(&exchanged).run("calibrate robot.toml samples.csv --gate");
    assert_eq!(run.code, 1, "{}", run.stdout);
    assert!(run.stderr.contains("too few to tell"), "{}", run.stderr);
    assert!(!run.stderr.contains("has changed"), "{}", run.stderr);
}

/// Without noise and tolerance the gate begins with an estimate of the first twelve samples and more.
#[test]
fn without_noise_and_tolerance_the_first_rows_go_untested() {
    let mut samples = measured();
    samples[50].1[2] += 5.0;
    let folder = folder(&samples);
    folder.write("robot.toml", NOMINAL);
    let run = folder
        .run("calibrate robot.toml samples.csv --gate --json report.json")
        .ok();
    let gate = &json(&folder)["stream"]["gate"];
    assert_eq!(gate["untested"], 12, "{}", run.stdout);
    assert_eq!(gate["tested_from_line"], 14);
    assert_eq!(gate["rejected"][0]["line"], 52);

    // Too few to begin with: that is said, and nothing is rejected.
    folder.write("samples.csv", csv(&noisy(&true_arms(), 11, 0.034)));
    let run = folder.run("calibrate robot.toml samples.csv --gate").ok();
    assert!(
        run.stdout.contains("no sample could be tested"),
        "{}",
        run.stdout
    );
}

#[test]
fn held_out_rows_that_agree_count_in_the_result() {
    let folder = folder(&measured());
    let run = folder
        .run("calibrate robot.toml samples.csv --held-out 4 --json report.json --output out.toml")
        .ok();
    assert!(
        run.stdout.contains("Held out: 15 samples"),
        "{}",
        run.stdout
    );
    let held_out = &json(&folder)["stream"]["held_out"];
    for arm in held_out.as_array().unwrap() {
        let found = arm["residual_rms"].as_f64().unwrap();
        let expected = arm["expected_rms"].as_f64().unwrap();
        // Fifteen residuals tell their rms to 1/√30.
        assert!((found / expected - 1.0).abs() < 4.0 / 30f64.sqrt(), "{arm}");
    }
    folder
        .run("calibrate robot.toml samples.csv --output all.toml")
        .ok();
    assert_same_robot(&folder.read("out.toml"), &folder.read("all.toml"));
}

#[test]
fn held_out_rows_that_disagree_refuse_the_calibration() {
    let mut samples = measured();
    for (_, x) in samples.iter_mut().skip(3).step_by(4) {
        // Measured with another tool.
        x[2] -= 0.2;
    }
    let folder = folder(&samples);
    let run = folder.run("calibrate robot.toml samples.csv --held-out 4 --output out.toml");
    assert_eq!(run.code, 1, "{}", run.stdout);
    assert!(
        run.stderr.contains("the held-out samples of arm"),
        "{}",
        run.stderr
    );
    assert!(run.stderr.contains("help:"), "{}", run.stderr);
    assert!(!folder.names().contains(&"out.toml".to_owned()));
}

/// A forearm that grows by a tenth of a micrometre a row, too slowly for the noise to be contradicted: with forgetting the result is the last robot's, not the
/// mean one's.
#[test]
fn forgetting_follows_a_robot_that_warms_up() {
    let rows = 600;
    let at = |row: u32| {
        let mut arms = nominal_arms();
        arms[0][7] += 1e-4 * f64::from(row);
        arms
    };
    let poses = exact(&at(0), rows);
    let samples: Vec<_> = (0..rows)
        .zip(&poses)
        .map(|(row, (q, _))| (*q, crate::support::platform(&at(row), *q)))
        .collect();
    let folder = folder(&samples);
    let lb = KEYS.iter().position(|key| *key == "lb_mm").unwrap();
    let mut behind = Vec::new();
    for options in ["", "--forget 60", "--gate --forget 60"] {
        let run = folder
            .run(&format!(
                "calibrate robot.toml samples.csv --output out.toml {options}"
            ))
            .ok();
        assert_eq!(run.stdout.contains("Forgetting: "), !options.is_empty());
        behind.push(480.0 + 0.0599 - arms_of(&folder.read("out.toml"))[0][lb]);
    }
    // Half of all rows without forgetting. How far behind a memory of 60 is depends on the poses: by 60
    // rows on average over many robots, by 50 more or less in one.
    assert!((behind[0] - 0.03).abs() < 0.003, "{behind:?}");
    assert!(behind[1] > 0.0 && behind[1] < 0.6 * behind[0], "{behind:?}");
    // The gate takes samples out of their blocks earlier.
    assert!(
        (behind[2] - behind[1]).abs() < 0.05 * behind[1],
        "{behind:?}"
    );
}

/// The newest row counts 1, the one before λ = N/(N + 1), and so on.
#[test]
fn with_forgetting_the_position_error_is_that_of_what_is_remembered() {
    let folder = folder(&measured());
    let run = folder
        .run("calibrate robot.toml samples.csv --json report.json --forget 20")
        .ok();
    assert!(run.stdout.contains("as far as they are remembered"));
    let report = json(&folder);
    let samples = report["samples"].as_array().unwrap();
    let (mut squares, mut sum) = (0.0, 0.0);
    let mut largest = 0.0_f64;
    for (age, sample) in (0..).zip(samples.iter().rev()) {
        let weight = (20.0_f64 / 21.0).powi(age);
        let error = sample["error_after_mm"].as_f64().unwrap();
        assert!((sample["weight"].as_f64().unwrap() - weight).abs() < 1e-12);
        squares += weight * error * error;
        sum += weight;
        // 20/21 to the power of 61 is 0.051.
        largest = largest.max(error);
    }
    assert_eq!(samples.len(), 60);
    let after = &report["position_error_mm"]["after"];
    assert!((after["rms"].as_f64().unwrap() - (squares / sum).sqrt()).abs() < 1e-12);
    assert!((after["max"].as_f64().unwrap() - largest).abs() < 1e-12);
}

#[test]
fn options_that_exclude_each_other_are_refused() {
    let folder = folder(&measured());
    for options in [
        "--gate --held-out 4",
        "--forget 20 --held-out 4",
        "--held-out 1",
        "--forget 0",
    ] {
        let run = folder.run(&format!("calibrate robot.toml samples.csv {options}"));
        assert_eq!(run.code, 2, "{options}: {}", run.stdout);
    }
}

#[test]
fn options_that_exclude_each_other_are_refused_where_they_are_computed_with() {
    let (robot, samples) = example::load().unwrap();
    let gate = Streaming {
        gate: true,
        ..Streaming::default()
    };
    let held_out = Streaming {
        held_out: NonZeroU32::new(4),
        ..Streaming::default()
    };
    let forget = NonZeroU32::new(50);
    let alone = |streaming| Options {
        streaming,
        ..Options::default()
    };
    let all = OptionsError::HeldOutNeedsAllSamples;
    for streaming in [
        Streaming {
            gate: true,
            ..held_out
        },
        Streaming { forget, ..held_out },
    ] {
        let error = calibrate(&robot, &samples, alone(streaming)).unwrap_err();
        assert_eq!(error.reason, Reason::Options(all), "{streaming:?}");
        assert_eq!(error.diagnosis, None);
    }
    for streaming in [gate, held_out, Streaming { forget, ..gate }] {
        for method in [
            CalibrationMethod::Joint,
            CalibrationMethod::Ikm,
            CalibrationMethod::Fkm,
        ] {
            for loss in [None, Some(Loss::Tukey)] {
                let options = Options {
                    method,
                    loss,
                    ..alone(streaming)
                };
                let report = calibrate(&robot, &samples, options).unwrap();
                assert_eq!(report.stream.map(|stream| stream.asked), Some(streaming));
            }
        }
    }
}
