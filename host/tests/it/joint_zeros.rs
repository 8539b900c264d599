//! Robots whose joint zeros are known by degrees alone: `[tolerance] zero_deg`.

use crate::support::{Folder, NOISE, NOMINAL, arms_of, csv, noisy, true_arms};
use serde_json::Value;

const SHEET: &str = "\
[nominal]
base_radius_mm = 130
platform_radius_mm = 100
upper_arm_mm = 309
forearm_mm = 595
[joints]
min_deg = -40
max_deg = 80
[tolerance]
length_mm = 0.5
angle_deg = 0.2
zero_deg = 6
[noise]
position_mm = 0.6
joint_deg = 0.01
";

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// A laboratory robot that touched 44 circles of a printed sheet (TaarLab, Delta_robot_Cam_in_Hand_Calibration). Its lengths
/// are as drawn and its arms hang lower than the controller believes: by 9.9, 9.2 and 6.8 degrees, as a Gauss–Newton of
/// its own finds, with χ² 128 of 132 readings.
#[test]
fn the_zeros_of_a_real_robot_are_found() {
    let folder = Folder::new();
    folder.write("robot.toml", SHEET);
    folder.write(
        "samples.csv",
        include_str!("../../examples/circle-sheet/samples.csv"),
    );
    let run = folder
        .run("calibrate robot.toml samples.csv --frame sensor --output out.toml --json report.json --report report.html")
        .ok();
    assert!(run.stdout.contains("joint zero"), "{}", run.stdout);
    assert!(folder.read("report.html").contains("joint zero"));
    let json: Value = serde_json::from_str(&folder.read("report.json")).unwrap();
    let arms = json["arms"].as_array().unwrap();
    for ((arm, zero), found) in arms
        .iter()
        .zip([-9.88, -9.19, -6.81])
        .zip(arms_of(&folder.read("out.toml")))
    {
        let [length, direction] = [&arm["upper_arm"][0], &arm["upper_arm"][1]];
        assert!(
            (number(&direction["after"]) - zero).abs() < 0.01,
            "{direction}"
        );
        assert!(number(&direction["sigma"]) > 0.3, "{direction}");
        assert!((number(&length["change"])).abs() < 0.2 * 0.5, "{length}");
        // The file keeps the components.
        let [.., x, y, _] = found;
        assert!((y.atan2(x).to_degrees() - zero).abs() < 0.01);
        for own in arm["parameters"].as_array().unwrap() {
            let tolerance = match own["symbol"].as_str().unwrap() {
                "La_x" | "La_y" => continue,
                "theta" | "alpha" => 0.2,
                _ => 0.5,
            };
            assert!(number(&own["change"]).abs() < 0.2 * tolerance, "{own}");
        }
    }
    let residuals = number(&json["residuals"][0]["after_rms_mm"]);
    assert!((residuals - 0.58).abs() < 0.005, "{residuals}");
    let readings: f64 = 132.0;
    let zeros: f64 = [9.88_f64, 9.19, 6.81]
        .iter()
        .map(|zero| (zero / 6.0).powi(2))
        .sum();
    let chi_square = readings * (residuals / 0.6).powi(2) + zeros;
    assert!((chi_square - 129.0).abs() < 2.0, "{chi_square}");
    // With the size of the print free χ² is 79: that is as likely as any sag.
    assert!(
        run.stdout.contains("about as likely: a wrong scale of"),
        "{}",
        run.stdout
    );
    // One plane shows no scale, and the report asks for a known length.
    assert!(
        run.stdout.contains("Measure one known length"),
        "{}",
        run.stdout
    );
}

/// By every method, also by the robust one, and in plans; what is written reads back.
#[test]
fn every_method_takes_the_tolerance_of_joint_zeros() {
    let zeros = [8.0_f64, -5.0, 11.0];
    let mut turned = true_arms();
    for (arm, zero) in turned.iter_mut().zip(zeros) {
        let (x, y) = (arm[5], arm[6]);
        let angle = y.atan2(x) + zero.to_radians();
        (arm[5], arm[6]) = (x.hypot(y) * angle.cos(), x.hypot(y) * angle.sin());
    }
    let folder = Folder::new();
    let tolerance = "[tolerance]\nlength_mm = 0.5\nangle_deg = 0.2\nzero_deg = 8\n";
    folder.write("robot.toml", format!("{NOMINAL}{tolerance}{NOISE}"));
    folder.write("samples.csv", csv(&noisy(&turned, 30, 0.02)));
    for method in [
        "--method ikm",
        "--method joint",
        "--method fkm",
        "--robust",
        "--frame sensor",
    ] {
        let run = format!("calibrate robot.toml samples.csv --output out.toml {method}");
        folder.run(&run).ok();
        let file = folder.read("out.toml");
        assert!(file.contains("zero_deg = 8"), "{file}");
        for (found, truth) in arms_of(&file).iter().zip(&turned) {
            let zero = |arm: &[f64; 8]| arm[6].atan2(arm[5]).to_degrees();
            // One σ is 0.02 degrees with the base's frame given, and 0.1 without it.
            let off = (zero(found) - zero(truth)).abs();
            assert!(off < 0.4, "{method}: {off}");
        }
    }
    let plan = folder.run("plan robot.toml --count 12").ok();
    assert!(plan.stdout.contains("joint zeros 8°"), "{}", plan.stdout);
}

/// A tolerance of the zeros that they are far beyond: the refusal names them.
#[test]
fn zeros_far_beyond_their_tolerance_are_named() {
    let mut turned = true_arms();
    for arm in &mut turned {
        let (x, y) = (arm[5], arm[6]);
        let angle = y.atan2(x) + 12.0_f64.to_radians();
        (arm[5], arm[6]) = (x.hypot(y) * angle.cos(), x.hypot(y) * angle.sin());
    }
    let folder = Folder::new();
    let tolerance = "[tolerance]\nlength_mm = 0.5\nangle_deg = 0.2\nzero_deg = 1\n";
    folder.write("robot.toml", format!("{NOMINAL}{tolerance}{NOISE}"));
    folder.write("samples.csv", csv(&noisy(&turned, 30, 0.02)));
    let run = folder.run("calibrate robot.toml samples.csv");
    assert!(run.stderr.contains("joint zero"), "{}", run.stderr);
}
