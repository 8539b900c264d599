//! `delta-cal calibrate` of a printer's configuration.

use crate::export::klipper::Delta;
use crate::import::fixtures::{SECRETS, block, folder, printer, printers, rotary};
use crate::support::{Run, number};
use serde_json::Value;
use std::fmt::Write;

fn statements(run: &Run) -> usize {
    let above = run.stdout.split("\n\n").next().unwrap();
    above
        .lines()
        .filter(|line| line.get(2..4) == Some(". "))
        .count()
}

fn json(run: &Run) -> Value {
    serde_json::from_str(&run.stdout).unwrap()
}

/// What is said agrees with itself and with the JSON, and no secret is told.
#[test]
fn ten_printers_are_assessed() {
    for own in printers() {
        let folder = folder(&own.configuration());
        let run = folder.run("calibrate printer.cfg").ok();
        for secret in SECRETS {
            assert!(!run.stdout.contains(secret) && !run.stderr.contains(secret));
        }
        assert!((6..=11).contains(&statements(&run)), "{}", run.stdout);
        let words: Vec<_> = run.stdout.split_whitespace().collect();
        let words = words.join(" ");
        let readings = own.rows.len();
        assert!(
            words.contains(&format!("The {readings} readings improve ")),
            "{words}"
        );
        let report = json(&folder.run("calibrate printer.cfg --json -").ok());
        let kept = report["printer"]["lines"].is_null();
        assert_eq!(kept, words.contains("Nothing to change"), "{words}");
        for line in [
            "delta_radius: ",
            "[stepper_c]",
            "arm_length: ",
            "position_endstop: ",
        ] {
            assert_ne!(run.stdout.contains(line), kept, "{line}: {}", run.stdout);
        }
        let known = report["determined"]["scale"].as_bool().unwrap();
        assert_eq!(words.contains("100 mm come out as"), known, "{words}");
        assert_eq!(
            words.contains("The size of parts stays at"),
            !known,
            "{words}"
        );
        assert!(known || !words.contains("Measure next: nothing"), "{words}");
        assert_eq!(report["reading_count"], readings);
    }
}

/// One distance that is a millimetre off makes the estimated noise and every σ larger, and is named.
#[test]
fn a_doubtful_distance_is_named_and_makes_sigma_larger() {
    let own = printer("05");
    let right = own.configuration();
    let doubtful = right.replace("distance11 = 63.9", "distance11 = 62.9");
    assert_ne!(right, doubtful);
    let report = |text: &str| {
        let folder = folder(text);
        let run = folder.run("calibrate printer.cfg --json r.json").ok();
        let words: Vec<_> = run.stdout.split_whitespace().collect();
        let report: Value = serde_json::from_str(&folder.read("r.json")).unwrap();
        (words.join(" "), report)
    };
    let [(_, right), (said, doubtful)] = [report(&right), report(&doubtful)];
    let now = |report: &Value| number(report, "printer/next/sigma_now_mm");
    assert!(
        now(&doubtful) > 1.1 * now(&right),
        "{} {}",
        now(&doubtful),
        now(&right)
    );
    let error = format!("Expected position error: {:.2} mm rms", now(&doubtful));
    assert!(said.contains(&error), "{said}");
    assert!(said.contains("distance11 fits worst"), "{said}");
}

/// 3 mm off the other distances: refused by the name that the configuration has for it, nothing written.
#[test]
fn a_distance_that_is_far_off_is_refused_by_its_name() {
    let own = printer("05");
    let right = own.configuration();
    let wrong = right.replace("distance11 = 63.9", "distance11 = 60.9");
    assert_ne!(right, wrong);
    let folder = folder(&wrong);
    let run = folder.run("calibrate printer.cfg --output c.toml --paste p.cfg");
    assert_eq!(run.code, 1, "{}", run.stderr);
    assert_eq!(run.stdout, "");
    assert!(
        run.stderr.contains("Measure distance11 again"),
        "{}",
        run.stderr
    );
    assert_eq!(folder.names(), ["printer.cfg"]);
}

/// The heights that the lines to paste give at the measured steps are nearer to the measured ones than those of a
/// printer that was never calibrated.
#[test]
fn the_lines_to_paste_improve_a_printer_that_was_not_calibrated() {
    // Round radius and angles: nobody calibrated it.
    let own = printer("13");
    let folder = folder(&own.configuration());
    let run = folder
        .run("calibrate printer.cfg --output c.toml --paste paste.cfg")
        .ok();
    let lines = folder.read("paste.cfg");
    assert!(run.stdout.contains(&lines), "{}", run.stdout);
    let pasted = Delta::pasted(&lines, own.klipper.step_lengths);
    let off = |klipper: &Delta| {
        let squares: f64 = own
            .rows
            .iter()
            .map(|row| match row {
                crate::import::fixtures::Row::Height(carriages, height) => {
                    (klipper.position(own.steps(*carriages))[2] - height).powi(2)
                }
                crate::import::fixtures::Row::Distance(..) => 0.0,
            })
            .sum();
        (squares / 7.0).sqrt()
    };
    let (before, after) = (off(&own.klipper), off(&pasted));
    println!("{before} {after}");
    assert!(after < 0.5 * before, "{before} {after}");
    assert!(folder.path("c.toml").exists());
    assert_eq!(folder.read("printer.cfg"), own.configuration());
}

/// A printer whose towers, end stops and rods are known: the program finds its end stops again.
#[test]
fn a_printer_made_wrong_is_found_again() {
    let mut own = printer("01");
    // Klipper is told this; the real one is made otherwise, within the tolerance.
    let made = Delta {
        radius: own.klipper.radius + 0.4,
        angles: own.klipper.angles,
        arms: own.klipper.arms,
        endstops: [0, 1, 2].map(|k| own.klipper.endstops[k] + [0.9, -0.6, 0.3][k]),
        step_lengths: own.klipper.step_lengths,
    };
    for row in &mut own.rows {
        let crate::import::fixtures::Row::Height(carriages, height) = row else {
            unreachable!()
        };
        let high = own.klipper.absolute_endstops();
        let length = own.klipper.step_lengths;
        let steps = [0, 1, 2].map(|k| (high[k] - carriages[k]) / length[k]);
        *height = made.position(steps)[2];
    }
    let folder = folder(&own.configuration());
    let report = json(&folder.run("calibrate printer.cfg --json -").ok());
    assert_eq!(report["printer"]["kinematics"], "delta");
    assert_eq!(report["printer"]["heights"], 7);
    assert_eq!(report["printer"]["distances"], 0);
    assert_eq!(report["reading_count"], 7);
    assert!(number(&report, "printer/lack_of_fit") < 1.5);
    let [before, after] =
        ["before", "after"].map(|when| number(&report, &format!("printer/{when}/height_rms_mm")));
    assert!(before > 0.3 && after < 0.03, "{before} {after}");
    let lines = report["printer"]["lines"].as_str().unwrap();
    let pasted = Delta::pasted(lines, own.klipper.step_lengths);
    for at in [
        [0.0, 0.0, 0.0],
        [90.0, 0.0, 0.0],
        [-60.0, 90.0, 0.0],
        [0.0, -100.0, 0.0],
    ] {
        let is = made.position(pasted.steps(at));
        assert!((is[2] - at[2]).abs() < 0.05, "{at:?} {is:?}");
    }
    let of = |key: &str| number(&report, &format!("printer/{key}"));
    let now = of("next/sigma_now_mm");
    assert!(of("next/sigma_with_heights_mm") < now);
    assert!(of("next/sigma_with_printed_object_mm") < now);
    assert!(now < of("sigma_before_mm"));
}

/// Rods that are wrong by far more than rods are made: refused, nothing written.
#[test]
fn a_printer_that_no_tolerance_explains_is_refused() {
    let folder = folder(&printer("20").configuration());
    let command = "calibrate printer.cfg --rods 286mm";
    let run = folder.run(&format!(
        "{command} --output c.toml --paste p.cfg --json report.json"
    ));
    assert_eq!(run.code, 1, "{} {}", run.stdout, run.stderr);
    assert_eq!(run.stdout, "");
    // A program that reads standard output is told there.
    let run = folder.run(&format!("{command} --json -"));
    assert_eq!(run.code, 1, "{}", run.stderr);
    assert!(json(&run)["refused"].as_str().is_some(), "{}", run.stdout);
    assert_eq!(folder.names(), ["printer.cfg"]);
}

/// Motors that turn the arms: end stops that are off by up to a millimetre are found again over the bed.
#[test]
fn a_robot_whose_motors_turn_its_arms_is_assessed_too() {
    let (told, text) = rotary();
    let (mut made, _) = rotary();
    made.endstops = [0, 1, 2].map(|k| told.endstops[k] + [0.7, -0.9, 0.2][k]);
    let mut saved = String::from("[delta_calibrate]\n");
    for index in 0..12 {
        let (out, turn) = (90.0 * f64::from(index) / 11.0, 2.4 * f64::from(index));
        let steps = told.steps([out * turn.cos(), out * turn.sin(), 2.0]);
        let height = made.position(steps)[2];
        let steps = steps.map(|n| format!("{n:.6}")).join(",");
        writeln!(
            saved,
            "height{index} = {height}\nheight{index}_pos = {steps}"
        )
        .unwrap();
    }
    let folder = folder(&format!(
        "{text}[delta_calibrate]\nradius: 90\n{}",
        block(&saved)
    ));
    let report = json(&folder.run("calibrate printer.cfg --json -").ok());
    assert_eq!(report["printer"]["kinematics"], "rotary_delta");
    let lines = report["printer"]["lines"].as_str().unwrap();
    assert!(
        lines.contains("shoulder_radius: ") && lines.contains("upper_arm_length: "),
        "{lines}"
    );
    let [before, after] =
        ["before", "after"].map(|when| number(&report, &format!("printer/{when}/height_rms_mm")));
    assert!(before > 0.2 && after < 0.25 * before, "{before} {after}");
    // What the configuration states, beside what to paste.
    let changes = report["printer"]["changes"].as_array().unwrap();
    let of = |name: &str| changes.iter().find(|own| own["name"] == name).unwrap();
    for (name, told) in [
        ("shoulder_radius", told.shoulder_radius),
        ("shoulder_height", told.shoulder_height),
        ("stepper_b upper_arm_length", told.upper[1]),
        ("stepper_c angle", told.angles[2]),
        ("stepper_a position_endstop", told.endstops[0]),
    ] {
        let before = of(name)["before"].as_f64().unwrap();
        assert!((before - told).abs() < 1e-9, "{name}: {before}");
    }
}
