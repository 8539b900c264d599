//! `delta-cal calibrate` of a printer's configuration.

use crate::import::fixtures::{Row, block, folder, measured, printer, printers, rotary};
use crate::support::{Run, number};
use serde_json::Value;

fn statements(run: &Run) -> usize {
    let above = run.stdout.split("\n\n").next().unwrap();
    above
        .lines()
        .filter(|line| line.get(1..3) == Some(". "))
        .count()
}

/// What is said agrees with itself and with the JSON.
#[test]
fn ten_printers_are_assessed() {
    for own in printers() {
        let folder = folder(&own.configuration());
        let run = folder.run("calibrate printer.cfg").ok();
        assert!((4..=6).contains(&statements(&run)), "{}", run.stdout);
        let words = run.words();
        let readings = own.rows.len();
        assert!(
            words.contains(&format!("The {readings} readings improve ")),
            "{words}"
        );
        let report = folder.run("calibrate printer.cfg --json -").ok().json();
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
        assert_eq!(words.contains("Part size is "), !known, "{words}");
        assert!(known || !words.contains("Measure next: nothing"), "{words}");
        assert_eq!(report["reading_count"], readings);
        // More readings leave less.
        let now = number(&report, "printer/next/sigma_now_mm");
        assert!(now < number(&report, "printer/sigma_before_mm"));
        for more in ["sigma_with_heights_mm", "sigma_with_printed_object_mm"] {
            let left = report["printer"]["next"][more].as_f64();
            assert!(left.is_none_or(|own| own < now), "{more}: {left:?} {now}");
        }
        assert_eq!(folder.read("printer.cfg"), own.configuration());
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
        let run = folder
            .run("calibrate printer.cfg --shrinkage 0% --json r.json")
            .ok();
        (run.words(), folder.json("r.json"))
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

/// Motors that turn the arms: end stops that are off by up to a millimetre are found again over the bed.
#[test]
fn a_robot_whose_motors_turn_its_arms_is_assessed_too() {
    let (told, text) = rotary();
    let (mut made, _) = rotary();
    made.endstops = [0, 1, 2].map(|k| told.endstops[k] + [0.7, -0.9, 0.2][k]);
    let row = |index: u8| {
        let (out, turn) = (90.0 * f64::from(index) / 11.0, 2.4 * f64::from(index));
        let steps = told.steps([out * turn.cos(), out * turn.sin(), 2.0]);
        Row::Height(steps, made.position(steps)[2])
    };
    let saved = measured(&(0..12).map(row).collect::<Vec<_>>());
    let folder = folder(&format!(
        "{text}[delta_calibrate]\nradius: 90\n{}",
        block(&saved)
    ));
    let report = folder.run("calibrate printer.cfg --json -").ok().json();
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
        ("shoulder_radius", told.arms[0].radius),
        ("shoulder_height", told.arms[0].height),
        ("stepper_b upper_arm_length", told.arms[1].upper),
        ("stepper_c angle", told.arms[2].azimuth),
        ("stepper_a position_endstop", told.endstops[0]),
    ] {
        let before = of(name)["before"].as_f64().unwrap();
        assert!((before - told).abs() < 1e-9, "{name}: {before}");
    }
}
