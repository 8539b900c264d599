//! `delta-cal calibrate --method fkm`: everything that the IKM method offers.

use crate::support::{
    Folder, NOISE, NOMINAL, Point, TOLERANCE, arms_of, csv, distance, exact, noisy, nominal_arms,
    platform, poses, true_arms,
};
use serde_json::Value;

type Samples = Vec<(Point, Point)>;

fn folder(robot: &str, samples: &[(Point, Point)]) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot);
    folder.write("samples.csv", csv(samples));
    folder
}

fn assert_true_robot(toml: &str) {
    for (found, expected) in arms_of(toml)
        .iter()
        .flatten()
        .zip(true_arms().iter().flatten())
    {
        assert!((found - expected).abs() < 1e-7, "{found} {expected}");
    }
}

#[test]
fn exact_measurements_give_back_the_robot_with_either_solver() {
    for samples in [12, 30] {
        let folder = folder(NOMINAL, &exact(&true_arms(), samples));
        for solver in ["lm", "gn"] {
            let run = folder
                .run(&format!(
                    "calibrate robot.toml samples.csv --method fkm --solver {solver} --output out.toml"
                ))
                .ok();
            assert!(run.stdout.contains("FKM method"), "{}", run.stdout);
            for line in run.stdout.lines() {
                assert!(line.chars().count() <= 100, "{line}");
            }
            let toml = folder.read("out.toml");
            assert!(toml.contains(&format!(
                "# Options: --method fkm --solver {solver} --frame base"
            )));
            assert_true_robot(&toml);
        }
    }
}

#[test]
fn the_report_states_sigmas_that_the_errors_bear_out() {
    // Evenly distributed errors within ± √3 σ have the variance σ².
    let samples = noisy(&true_arms(), 30, 0.01 * 3f64.sqrt());
    let folder = folder(&format!("{NOMINAL}{TOLERANCE}{NOISE}"), &samples);
    let run = folder
        .run("calibrate robot.toml samples.csv --method fkm --output out.toml --json -")
        .ok();
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(report["method"], "fkm");
    let calibrated = arms_of(&folder.read("out.toml"));
    let mut z_squares = 0.0;
    for (k, (arm, truth)) in calibrated.iter().zip(true_arms()).enumerate() {
        for j in 0..8 {
            let parameter = &report["arms"][k]["parameters"][j];
            let sigma = parameter["sigma"].as_f64().unwrap();
            z_squares += ((arm[j] - truth[j]) / sigma).powi(2);
            assert!((0.0..=1.0).contains(&parameter["prior_share"].as_f64().unwrap()));
        }
        let arm = &report["arms"][k];
        assert_eq!(arm["residual_unit"], "sigma");
        assert_eq!(arm["start"], "robot file");
        assert_eq!(arm["termination"], "converged");
        // 90 residuals of unit variance less 24 parameters: √(66/90) ± 0.06.
        let residual = arm["residual"].as_f64().unwrap();
        assert!((0.6..1.15).contains(&residual), "{residual}");
    }
    // 24 errors of unit variance: Σz² is 24 ± 7.
    assert!((4.0..52.0).contains(&z_squares), "{z_squares}");
    // The positions elsewhere are as far off as the report expects.
    let errors = poses(60)
        .split_off(30)
        .into_iter()
        .map(|q| distance(platform(&calibrated, q), platform(&true_arms(), q)).powi(2));
    let rms = (errors.sum::<f64>() / 30.0).sqrt();
    let expected = report["workspace"]["position_sigma_mm"].as_f64().unwrap();
    assert!((0.3..2.0).contains(&(rms / expected)), "{rms} {expected}");
}

/// The residual of the FKM method is the distance that the position error over the samples is.
#[test]
fn without_a_stated_noise_it_is_estimated_from_the_residuals() {
    let folder = folder(NOMINAL, &noisy(&true_arms(), 40, 0.01 * 3f64.sqrt()));
    let run = folder
        .run("calibrate robot.toml samples.csv --method fkm --json -")
        .ok();
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    let rms = report["position_error_mm"]["after"]["rms"]
        .as_f64()
        .unwrap();
    for arm in report["arms"].as_array().unwrap() {
        let residual = arm["residual"].as_f64().unwrap();
        assert!((residual * 3f64.sqrt() - rms).abs() < 1e-9);
        // 96 degrees of freedom: 0.01 mm to 7 %.
        let noise = arm["estimated_noise_mm"].as_f64().unwrap();
        assert!((0.0075..0.0125).contains(&noise), "{noise}");
        assert!((arm["degrees_of_freedom"].as_f64().unwrap() - 32.0).abs() < 1e-6);
    }
}

#[test]
fn the_sensor_frame_is_found() {
    let mut samples = exact(&true_arms(), 30);
    let (sin, cos) = 0.8f64.sin_cos();
    for (_, x) in &mut samples {
        *x = [
            cos * x[0] - sin * x[1] + 900.0,
            x[2] - 400.0,
            -(sin * x[0] + cos * x[1]),
        ];
    }
    let folder = folder(NOMINAL, &samples);
    let run = folder
        .run("calibrate robot.toml samples.csv --method fkm --frame sensor --json -")
        .ok();
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert!(
        report["position_error_mm"]["after"]["max"]
            .as_f64()
            .unwrap()
            < 1e-6
    );
    assert!(report["sensor_frame"]["rotation"].is_array());
    // In the base frame the refusal points there.
    let run = folder.run("calibrate robot.toml samples.csv --method fkm");
    assert_eq!(run.code, 1);
    assert!(run.stderr.contains("--frame sensor"), "{}", run.stderr);
}

#[test]
fn without_a_guess_any_robot_is_found() {
    let guess = NOMINAL.replace("= 260", "= 150").replace("= 480", "= 700");
    let folder = folder(&guess, &exact(&true_arms(), 12));
    let run = folder
        .run("calibrate robot.toml samples.csv --method fkm --no-guess --output out.toml")
        .ok();
    assert!(run.stdout.contains("without a guess"), "{}", run.stdout);
    let arms = arms_of(&folder.read("out.toml"));
    for (q, x) in exact(&true_arms(), 40) {
        assert!(distance(platform(&arms, q), x) < 1e-6);
    }
}

#[test]
fn five_samples_with_a_tolerance_calibrate() {
    let samples = exact(&true_arms(), 5);
    let folder = folder(&format!("{NOMINAL}{TOLERANCE}{NOISE}"), &samples);
    let run = folder
        .run("calibrate robot.toml samples.csv --method fkm --output out.toml")
        .ok();
    assert!(run.stdout.contains("by tolerance"));
    let arms = arms_of(&folder.read("out.toml"));
    for (q, x) in &samples {
        assert!(distance(platform(&arms, *q), *x) < 0.1);
    }
}

/// What the IKM method refuses, the FKM method refuses in the same words and with the same code.
#[test]
fn refusals_have_the_same_kinds_and_words() {
    let arms = true_arms();
    let stiff: Vec<_> = exact(&arms, 20)
        .into_iter()
        .map(|(q, _)| [q[0], 20.0, q[2]])
        .map(|q| (q, platform(&arms, q)))
        .collect();
    let mut one_wrong = exact(&arms, 30);
    one_wrong[10].1 = [100.0, 0.0, -700.0];
    let mut other_arms = arms;
    other_arms[1][7] += 12.0;
    let mut implausible = arms;
    implausible[0][7] += 60.0;
    let upside_down: Vec<_> = exact(&arms, 30)
        .into_iter()
        .map(|(q, [x, y, z])| (q.map(|q| -q), [x, y, -z]))
        .filter(|(q, _)| q.iter().all(|q| *q > -60.0))
        .collect();
    let cases: [(&str, Samples, &str); 8] = [
        (
            "",
            exact(&arms, 7),
            "samples.csv:8: the file ends after 7 samples",
        ),
        (
            "",
            stiff,
            "the 20 poses do not determine the parameters of arm 2",
        ),
        (
            NOISE,
            noisy(&arms, 30, 0.5),
            "times what the stated [noise] allows",
        ),
        (NOISE, one_wrong, "the sample in line 12 ("),
        (
            TOLERANCE,
            exact(&other_arms, 30),
            "the fit puts Lb of arm 2 ",
        ),
        (
            "",
            noisy(&nominal_arms(), 12, 0.5),
            "may make the robot worse",
        ),
        (
            "",
            exact(&implausible, 20),
            "Lb of arm 1 is 480.000 mm in the robot file, and the fit makes it 540",
        ),
        ("", upside_down, "upside down or left-handed"),
    ];
    for (section, samples, expected) in cases {
        let folder = folder(&format!("{NOMINAL}{section}"), &samples);
        for method in ["ikm", "fkm"] {
            let run = folder.run(&format!(
                "calibrate robot.toml samples.csv --method {method} --output out.toml"
            ));
            assert_eq!(run.code, 1, "{method}, {expected}: {}", run.stdout);
            assert!(
                run.stderr.contains(expected),
                "{method}, {expected}: {}",
                run.stderr
            );
            assert!(run.stderr.contains("help:"));
            assert_eq!(folder.names(), ["robot.toml", "samples.csv"]);
        }
    }
}

#[test]
fn doubtful_noise_is_said_once_for_the_robot() {
    let folder = folder(
        &format!("{NOMINAL}{NOISE}"),
        &noisy(&true_arms(), 40, 0.001),
    );
    let run = folder
        .run("calibrate robot.toml samples.csv --method fkm")
        .ok();
    assert!(
        run.stdout.contains("the robot: the residuals are only"),
        "{}",
        run.stdout
    );
    assert_eq!(
        run.stdout.matches("overstated").count(),
        1,
        "{}",
        run.stdout
    );
}
