//! Commands that do what they should.

use crate::device::{controller, folder, json, run};
use crate::support::{
    NOMINAL, arms_of, csv, distance, exact, noisy, nominal_arms, platform, true_arms,
};

/// rms distance between the samples and where Newton's method puts the platform.
fn rms(
    arms: &[crate::support::Arm; 3],
    samples: &[(crate::support::Point, crate::support::Point)],
) -> f64 {
    let squares: f64 = samples
        .iter()
        .map(|(q, x)| distance(*x, platform(arms, *q)).powi(2))
        .sum();
    (squares / f64::from(u32::try_from(samples.len()).unwrap())).sqrt()
}

#[test]
fn calibrates_applies_and_reverts() {
    let folder = folder();
    let port = controller();
    let samples = noisy(&true_arms(), 40, 0.02);

    let looked_at = run(&folder, &port, "calibrate robot.toml samples.csv").ok();
    assert!(
        looked_at.stdout.contains("Not applied"),
        "{}",
        looked_at.stdout
    );
    assert!(
        looked_at.stdout.contains("Cortex-M4 r0p1"),
        "{}",
        looked_at.stdout
    );
    let status = json(&run(&folder, &port, "status --json -").ok().stdout);
    assert_eq!(status["origin"], "nominal");
    assert_eq!(status["phase"], "solved, from 40 samples");

    let command = "calibrate robot.toml samples.csv --apply --output out.toml --json report.json";
    let applied = run(&folder, &port, command).ok();
    assert!(applied.stdout.contains("Applied"), "{}", applied.stdout);
    let report = json(&folder.read("report.json"));
    assert_eq!(report["applied"], true);
    // Single precision, and printed with all digits.
    let errors = &report["calibration"]["position_error_mm"];
    let before = errors["before"]["rms"].as_f64().unwrap();
    let after = errors["after"]["rms"].as_f64().unwrap();
    assert!(
        (before - rms(&nominal_arms(), &samples)).abs() < 1e-4,
        "{before}"
    );
    assert!(
        (after - rms(&arms_of(&folder.read("out.toml")), &samples)).abs() < 1e-9,
        "{after}"
    );
    assert!(after < 0.05 && before > 0.5, "{before} {after}");

    // The controller's parameters are those that were written, to the bit.
    run(&folder, &port, "parameters robot.toml --output now.toml").ok();
    let (out, now) = (folder.read("out.toml"), folder.read("now.toml"));
    assert_eq!(arms_of(&out), arms_of(&now));
    let below = |text: &str| text[text.find("[[arm]]").unwrap()..].to_owned();
    assert_eq!(below(&out), below(&now));
    let status = json(&run(&folder, &port, "status --json -").ok().stdout);
    assert_eq!(status["origin"], "calibrated");
    assert_eq!(status["control_loop"]["fingerprint"], report["fingerprint"]);
    assert_eq!(status["control_loop"]["switches"], 1);

    // Seen from the calibrated robot there is nothing left to gain.
    let again = run(&folder, &port, "calibrate robot.toml samples.csv --json -").ok();
    let again = json(&again.stdout);
    assert_eq!(again["fingerprint"], report["fingerprint"]);
    let errors = &again["calibration"]["position_error_mm"];
    assert_eq!(errors["before"], errors["after"]);

    let reverted = run(&folder, &port, "revert").ok();
    assert!(
        reverted.stdout.contains("in use: nominal"),
        "{}",
        reverted.stdout
    );
    let parameters = json(&run(&folder, &port, "parameters --json -").ok().stdout);
    assert_eq!(
        parameters["fingerprint"],
        parameters["device"]["nominal_fingerprint"]
    );
    // Given again it changes nothing: what was rejected does not come back.
    for again in ["revert", "revert --nominal"] {
        let unchanged = run(&folder, &port, again).ok().stdout;
        assert!(unchanged.contains("in use: nominal"), "{unchanged}");
        assert!(unchanged.contains("as before"), "{unchanged}");
    }
}

#[test]
fn works_without_files_and_with_the_controllers_own_robot_file() {
    let folder = folder();
    let port = controller();
    let example = run(&folder, &port, "calibrate").ok();
    assert!(
        example.stdout.starts_with("The built-in example"),
        "{}",
        example.stdout
    );
    run(&folder, &port, "parameters --nominal --output nominal.toml").ok();
    run(&folder, &port, "calibrate nominal.toml samples.csv").ok();
    let printed = run(&folder, &port, "parameters --nominal").ok().stdout;
    assert_eq!(printed, folder.read("nominal.toml"));
}

#[test]
fn verifies_calibrations_and_refusals() {
    let folder = folder();
    let port = controller();
    folder.write("few.csv", csv(&exact(&true_arms(), 5)));
    folder.write("bare.toml", NOMINAL);
    let good = run(&folder, &port, "verify robot.toml samples.csv").ok();
    assert!(
        good.stdout.contains("270 of 270 figures are equal"),
        "{}",
        good.stdout
    );
    let refused = run(&folder, &port, "verify bare.toml few.csv").ok();
    assert!(
        refused.stdout.contains("both refused"),
        "{}",
        refused.stdout
    );
    let report = json(&run(&folder, &port, "verify --json -").ok().stdout);
    assert_eq!(report["differences"], serde_json::json!([]));
    assert_eq!(report["calibrated"], true);
    let status = json(&run(&folder, &port, "status --json -").ok().stdout);
    assert_eq!(status["origin"], "nominal");
}
