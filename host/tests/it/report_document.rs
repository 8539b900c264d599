//! Reports as documents: whose, of what, when, and whether a limit is met.

use crate::support::{Folder, NOMINAL, csv, noisy, true_arms};
use delta_cal_host::InputText;
use delta_cal_host::accuracy::coverage::CoverageFactor;
use serde_json::Value;

const RECORD: &str = "
[robot]
name = \"Packer <3>\"
serial = 1170
[measurement]
operator = \"A. Meier\"
instrument = \"laser tracker\"
date = 2026-03-14
";
const NOISE: &str = "\n[noise]\nposition_mm = 0.01\njoint_deg = 0\n";

fn folder(robot: &str) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot);
    folder.write("samples.csv", csv(&noisy(&true_arms(), 24, 0.017)));
    folder
}

fn json(folder: &Folder, options: &str) -> Value {
    let arguments = format!("calibrate robot.toml samples.csv --json - {options}");
    let run = folder.run_where(&arguments, "", &[("SOURCE_DATE_EPOCH", "1709164800")]);
    serde_json::from_str(&run.stdout).unwrap()
}

/// FIPS 180-2, appendix B.1, and the bytes of a file with byte order mark and CR LF as `sha256sum` has them.
#[test]
fn files_are_identified_by_the_sha_256_of_their_bytes() {
    let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
    assert_eq!(InputText::new("abc", "abc").sha256(), abc);
    let bytes_sha256 = "c3199f17595cd7b59cea561d9cb96f204ef903c38b1b9cb4a50b7e68d286f675";
    let bytes = &b"\xef\xbb\xbfabc\r\n"[..];
    let text = InputText::from_reader("stream", bytes).unwrap();
    assert_eq!(text.text(), "abc\n");
    assert_eq!(text.sha256(), bytes_sha256);
}

#[test]
fn a_report_says_whose_it_is_and_when() {
    let folder = folder(&format!("{NOMINAL}{NOISE}{RECORD}"));
    let report = json(&folder, "--report page.html --output calibrated.toml");
    let document = &report["document"];
    for (key, expected) in [
        ("date", "2024-02-29"),
        ("program_version", env!("CARGO_PKG_VERSION")),
        ("robot_name", "Packer <3>"),
        ("robot_serial", "1170"),
        ("operator", "A. Meier"),
        ("instrument", "laser tracker"),
        ("measured_on", "2026-03-14"),
    ] {
        assert_eq!(document[key], expected, "{key}");
    }
    let sha256 = InputText::new("samples.csv", &folder.read("samples.csv"));
    assert_eq!(document["samples_file"]["sha256"], sha256.sha256());
    let page = folder.read("page.html");
    for words in [
        "Packer &lt;3&gt;",
        "1170",
        "A. Meier",
        "laser tracker",
        "2024-02-29",
        sha256.sha256(),
    ] {
        assert!(page.contains(words), "{words}");
    }
    // The drawing of the arm, and its parameters in words.
    for words in [
        "La = (La_x, La_y)",
        "azimuth θ of each arm plane",
        "What the parameters mean",
    ] {
        assert!(page.contains(words), "{words}");
    }
    // The calibrated robot is the same robot; its next measurement is another.
    let calibrated = folder.read("calibrated.toml");
    assert!(
        calibrated.contains("name = \"Packer <3>\"") && calibrated.contains("serial = \"1170\"")
    );
    assert!(!calibrated.contains("[measurement]") && calibrated.contains("by A. Meier"));
}

#[test]
fn a_date_that_is_none_and_texts_that_are_none_are_errors() {
    let folder = folder(&format!("{NOMINAL}{NOISE}"));
    let run = folder.run_where(
        "calibrate robot.toml samples.csv",
        "",
        &[("SOURCE_DATE_EPOCH", "tomorrow")],
    );
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("SOURCE_DATE_EPOCH"), "{}", run.stderr);
    for (line, words) in [
        ("name = 1.5", "expected text"),
        ("serial = \"\"", "one line of text"),
        ("name = \"a\\nb\"", "one line of text"),
        (&format!("name = \"{}\"", "x".repeat(61)), "more than 60"),
        ("nmae = \"x\"", "unknown field"),
    ] {
        folder.write("robot.toml", format!("{NOMINAL}\n[robot]\n{line}\n"));
        let run = folder.run("calibrate robot.toml samples.csv");
        assert_eq!(run.code, 3, "{line}");
        assert!(
            run.stderr.contains("robot.toml:12") && run.stderr.contains(words),
            "{}",
            run.stderr
        );
    }
}

/// With k = 2 for a stated noise.
#[test]
fn a_limit_is_compared_with_the_expanded_uncertainty() {
    let folder = folder(&format!("{NOMINAL}{NOISE}"));
    let report = json(&folder, "");
    let expanded = &report["expanded_uncertainty"];
    let rms = expanded["rms_mm"].as_f64().unwrap();
    let expected = report["expected_error"]["absolute_rms_mm"]
        .as_f64()
        .unwrap();
    assert_eq!(expanded["coverage_factor"], 2.0);
    assert!((rms / expected - 2.0).abs() < 1e-12);
    assert_eq!(report["acceptance"], Value::Null);
    for (limit, code, words) in [(1.001 * rms, 0, "Pass"), (0.999 * rms, 6, "Fail")] {
        let arguments = format!(
            "calibrate robot.toml samples.csv --limit {limit}mm --output calibrated.toml --report page.html"
        );
        let run = folder.run(&arguments);
        assert_eq!(run.code, code, "{}", run.stderr);
        assert!(run.stdout.contains(words), "{}", run.stdout);
        assert!(
            folder
                .read("page.html")
                .contains(&format!("{words}: the expanded"))
        );
        assert!(folder.read("calibrated.toml").contains("[[arm]]"));
        let report = json(&folder, &format!("--limit {limit}mm"));
        assert_eq!(report["acceptance"]["passed"], code == 0);
    }
}

/// Table G.2 of the GUM, 95.45 %: the standard uncertainty of a calibration contains √(ν/(ν − 2)).
#[test]
fn coverage_factors_are_those_of_the_guide() {
    for (freedom, published) in [(5.0, 2.65), (10.0, 2.28), (20.0, 2.13), (50.0, 2.05)] {
        let found = CoverageFactor::estimated(freedom).unwrap();
        let student = found.factor * (freedom / (freedom - 2.0)).sqrt();
        assert!((student - published).abs() < 0.005, "{freedom}: {student}");
    }
    assert_eq!(CoverageFactor::estimated(2.0), None);
    let folder = folder(NOMINAL);
    let report = json(&folder, "--no-guess");
    let freedom = report["expanded_uncertainty"]["degrees_of_freedom"]
        .as_f64()
        .unwrap();
    // 72 coordinates less 24 parameters.
    assert!((freedom - 48.0).abs() < 1e-6, "{freedom}");
}
