//! The numbers of the page: those of the JSON report, and residuals in σ.

use crate::report::{NOISE, folder, rows};
use crate::support::{NOMINAL, TOLERANCE, csv, noisy, true_arms};
use delta_cal_host::files::example;
use delta_cal_host::{CalibrationMethod, Options, calibrate};
use nalgebra::Matrix3;
use serde_json::Value;

/// Four decimals, as the report for people writes them; smaller numbers with two digits.
fn shown(number: f64) -> String {
    if number >= 1e-3 {
        format!("{number:.4}")
    } else {
        format!("{number:.1e}")
    }
}

#[test]
fn every_parameter_and_sample_of_the_json_report_is_in_the_page() {
    let folder = folder(
        &format!("{NOMINAL}{TOLERANCE}{NOISE}"),
        &csv(&noisy(&true_arms(), 30, 0.017)),
    );
    let run = folder
        .run("calibrate robot.toml samples.csv --json report.json --report report.html")
        .ok();
    assert!(
        run.stdout
            .contains("Written: report.json\nWritten: report.html")
    );
    let page = folder.read("report.html");
    let json: Value = serde_json::from_str(&folder.read("report.json")).unwrap();
    let rows = rows(&page);
    let number = |value: &Value| value.as_f64().unwrap();
    for arm in json["arms"].as_array().unwrap() {
        for parameter in arm["parameters"].as_array().unwrap() {
            let expected = [
                arm["arm"].to_string(),
                parameter["symbol"].as_str().unwrap().to_owned(),
                format!("{:.4}", number(&parameter["before"])),
                format!("{:.4}", number(&parameter["after"])),
                format!("{:+.4}", number(&parameter["change"])),
                shown(number(&parameter["sigma"])),
                parameter["unit"].as_str().unwrap().to_owned(),
                format!("{:.0} %", 100.0 * number(&parameter["prior_share"])),
            ];
            assert!(rows.iter().any(|row| *row == expected), "{expected:?}");
        }
    }
    for sample in json["samples"].as_array().unwrap() {
        let line = sample["line"].to_string();
        let row = rows
            .iter()
            .find(|row| row.len() == 11 && row[0] == line)
            .unwrap();
        assert_eq!(row[7], shown(number(&sample["error_before_mm"])));
        let after = number(&sample["error_after_mm"]);
        assert_eq!(row[8], shown(after));
        let sigmas = number(&sample["error_after_sigma"]);
        assert_eq!(row[9], format!("{sigmas:.2}"));
        // The stated noise, of each coordinate, is 0.01 mm; of the joints there is none.
        assert!((sigmas - after / (3f64.sqrt() * 0.01)).abs() < 1e-9 * sigmas);
    }
    let after = &json["position_error_mm"]["after"];
    for part in ["rms", "max"] {
        assert!(
            page.contains(&format!("{} mm", shown(number(&after[part])))),
            "{part}"
        );
    }
    let conditions = json["arms"].as_array().unwrap().iter();
    let conditions = conditions.map(|arm| format!("{:.1}", number(&arm["condition"])));
    let expected: Vec<_> = ["condition".to_owned()]
        .into_iter()
        .chain(conditions)
        .collect();
    assert!(rows.contains(&expected), "{expected:?}");
}

#[test]
fn a_sample_is_off_by_as_many_sigmas_as_finite_differences_have_it() {
    let (robot, samples) = example::load().unwrap();
    let report = calibrate(&robot, &samples, Options::default()).unwrap();
    let noise = robot.noise.unwrap();
    let after = &report.after.robot;
    for sample in &report.sample_errors {
        let joints = sample.measured.joints;
        let step = 1e-6;
        let mut covariance = Matrix3::identity() * noise.position().powi(2);
        for joint in 0..3 {
            let at = |delta: f64| {
                let mut moved = joints;
                moved[joint] += delta;
                after.forward(&moved).unwrap()
            };
            let by_joint = (at(step) - at(-step)) / (2.0 * step) * noise.joint();
            covariance += by_joint * by_joint.transpose();
        }
        let off = sample.measured.position - after.forward(&joints).unwrap();
        let expected = (off.dot(&(covariance.try_inverse().unwrap() * off)) / 3.0).sqrt();
        let found = sample.after_in_sigmas.unwrap();
        // The weights belong to the measured position, which is off by a few 1e-4 of an arm.
        assert!(
            (found - expected).abs() < 1e-3 * expected,
            "{found} {expected}"
        );
    }
}

#[test]
fn without_a_stated_noise_the_estimated_one_is_the_unit_of_the_residuals() {
    let (mut robot, samples) = example::load().unwrap();
    (robot.noise, robot.tolerance) = (None, None);
    let options = Options {
        method: CalibrationMethod::Fkm,
        ..Options::default()
    };
    let report = calibrate(&robot, &samples, options).unwrap();
    let squares = report.sample_errors.iter();
    let squares: f64 = squares.map(|s| s.after_in_sigmas.unwrap().powi(2)).sum();
    // σ² = Σr²/(3n − 24), so that the mean of r²/(3σ²) is (3n − 24)/3n; n is 40.
    assert!((squares / 40.0 - 96.0 / 120.0).abs() < 1e-9, "{squares}");
}
