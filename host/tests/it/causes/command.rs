//! What the command says of a cause. The positions are computed without the program's code.

use crate::support::{Folder, NOMINAL, Point, TOLERANCE, csv, platform, poses, true_arms};
use delta_cal::simulate::standard_normal;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;
use serde_json::Value;

const NOISE: &str = "\n[noise]\nposition_mm = 0.02\njoint_deg = 0\n";

/// The second arm's joint reports angles that are off by `amplitude` · cos(q − 40°), in degrees;
/// noise of 0.02 mm in each coordinate.
fn eccentric(amplitude: f64, rows: u32) -> Folder {
    let mut rng = Pcg32::seed_from_u64(17);
    let arms = true_arms();
    let measured = |reported: Point| {
        let mut joints = reported;
        joints[1] += amplitude * (reported[1] - 40.0).to_radians().cos();
        let x = platform(&arms, joints);
        (
            reported,
            x.map(|c| c + 0.02 * standard_normal::<f64, _>(&mut rng)),
        )
    };
    let samples: Vec<_> = poses(rows).into_iter().map(measured).collect();
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}{NOISE}"));
    folder.write("samples.csv", csv(&samples));
    folder
}

fn json(folder: &Folder, options: &str) -> Value {
    let run = folder.run(&format!(
        "calibrate robot.toml samples.csv --json - {options}"
    ));
    serde_json::from_str(&run.stdout).unwrap()
}

#[test]
fn a_cause_is_named_with_its_size_in_every_report() {
    let folder = eccentric(0.2, 40);
    for method in ["joint", "ikm", "fkm"] {
        let report = json(&folder, &format!("--method {method}"));
        let cause = &report["causes"][0];
        assert_eq!(cause["kind"], "eccentricity", "{method}");
        assert_eq!(cause["arm"], 2);
        assert_eq!(cause["unit"], "deg");
        let (size, sigma) = (
            cause["size"].as_f64().unwrap(),
            cause["sigma"].as_f64().unwrap(),
        );
        // The estimated amplitude is normal: four σ.
        assert!((size - 0.2).abs() < 4.0 * sigma, "{size} ± {sigma}");
        assert!(sigma < 0.04, "{sigma}");
        assert!(cause["p"].as_f64().unwrap() < 1e-4);
        let remedy = cause["remedy"].as_str().unwrap();
        assert!(
            remedy.contains("transmission_deg in [tolerance]"),
            "{remedy}"
        );
        assert!(report["causes_not_tested"].is_null());
        assert!(report["sigma_widened_by"].as_f64().unwrap() > 1.0);
    }
    let run = folder
        .run("calibrate robot.toml samples.csv --method fkm --report report.html")
        .ok();
    for said in [
        "Errors that the model does not hold",
        "eccentricity",
        "arm 2: the joint has an error that repeats once a turn",
    ] {
        assert!(run.stdout.contains(said), "{said}: {}", run.stdout);
    }
    for line in run.stdout.lines() {
        assert!(line.chars().count() <= 100, "{line}");
    }
    let page = folder.read("report.html");
    assert!(page.contains("Errors that the model does not hold"));
    assert_eq!(page.matches("closure error, mm").count(), 3);
}

#[test]
fn a_refusal_of_the_residuals_names_the_cause() {
    let folder = eccentric(0.6, 40);
    for method in ["joint", "ikm", "fkm"] {
        let run = folder.run(&format!(
            "calibrate robot.toml samples.csv --method {method} --output out.toml"
        ));
        assert_eq!(run.code, 1, "{}", run.stdout);
        for said in [
            "what the stated [noise] allows",
            "arm 2: the joint has an error that repeats once a turn, with an amplitude of 0.",
            "help: centre the gear or the encoder",
        ] {
            assert!(run.stderr.contains(said), "{said}: {}", run.stderr);
        }
    }
}

#[test]
fn too_few_samples_are_not_tested_and_the_report_says_so() {
    let folder = eccentric(0.0, 6);
    let report = json(&folder, "");
    assert!(report["causes"].is_null());
    let why = report["causes_not_tested"].as_str().unwrap();
    assert!(why.contains("too few samples"), "{why}");
    let run = folder.run("calibrate robot.toml samples.csv").ok();
    assert!(run.stdout.contains("were not looked for"), "{}", run.stdout);
}

/// One reflector that slipped is no gear.
#[test]
fn a_single_wrong_sample_is_no_cause() {
    for (row, off) in (0..40).flat_map(|row| [(row, 0.3), (row, 3.0)]) {
        let folder = eccentric(0.0, 40);
        let mut lines: Vec<_> = folder
            .read("samples.csv")
            .lines()
            .map(str::to_owned)
            .collect();
        let mut cells: Vec<f64> = lines[row + 1]
            .split(',')
            .map(|c| c.parse().unwrap())
            .collect();
        cells[3] += off;
        lines[row + 1] = cells
            .iter()
            .map(f64::to_string)
            .collect::<Vec<_>>()
            .join(",");
        folder.write("samples.csv", lines.join("\n"));
        let run = folder.run("calibrate robot.toml samples.csv --method fkm --json -");
        if run.code == 0 {
            let report: Value = serde_json::from_str(&run.stdout).unwrap();
            assert_eq!(
                report["causes"],
                Value::Array(Vec::new()),
                "row {row}, {off} mm"
            );
        } else {
            assert!(!run.stderr.contains("a cause that the model"), "row {row}");
        }
    }
}
