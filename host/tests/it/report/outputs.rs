//! Where the page is written: with the other files or not at all, to standard output, in no other file's place.

use crate::report::folder;
use crate::support::{NOMINAL, csv, exact, noisy, true_arms};

#[test]
fn a_refused_calibration_writes_no_report() {
    let folder = folder(NOMINAL, &csv(&exact(&true_arms(), 5)));
    folder.write("report.html", "of yesterday");
    let run = folder.run("calibrate robot.toml samples.csv --report report.html");
    assert_eq!(run.code, 1, "{}", run.stdout);
    assert_eq!(folder.read("report.html"), "of yesterday");
    assert_eq!(folder.names(), ["report.html", "robot.toml", "samples.csv"]);
}

#[test]
fn the_report_is_written_with_the_other_files_or_none_is() {
    let folder = folder(NOMINAL, &csv(&noisy(&true_arms(), 20, 0.01)));
    let run = folder.run(
        "calibrate robot.toml samples.csv --output out.toml --json report.json --report none/report.html",
    );
    assert_eq!(run.code, 4, "{}", run.stderr);
    assert_eq!(folder.names(), ["robot.toml", "samples.csv"]);
}

/// Whatever can be a file can be standard output, which then holds nothing else.
#[test]
fn each_output_can_be_standard_output() {
    let folder = folder(NOMINAL, &csv(&noisy(&true_arms(), 20, 0.01)));
    for (command, options) in [
        (
            "calibrate robot.toml samples.csv",
            &["--output", "--json", "--report"][..],
        ),
        (
            "validate robot.toml samples.csv --limit 5mm",
            &["--json", "--report"],
        ),
    ] {
        for option in options {
            folder.run(&format!("{command} {option} file")).ok();
            let streamed = folder.run(&format!("{command} {option} -")).ok();
            let file = folder.read("file");
            // The report for people names the file; nothing else may differ.
            assert_eq!(streamed.stdout, file, "{command} {option}");
            assert!(file.len() > 500);
        }
    }
}

#[test]
fn the_report_takes_no_other_file_s_place() {
    let folder = folder(NOMINAL, &csv(&noisy(&true_arms(), 20, 0.01)));
    for arguments in [
        "--report robot.toml",
        "--report ./samples.csv",
        "--report out --output out",
        "--report out --json out",
        "--report - --json -",
        "--report - --output -",
    ] {
        let run = folder.run(&format!("calibrate robot.toml samples.csv {arguments}"));
        assert_eq!(run.code, 2, "{arguments}: {}", run.stderr);
        assert!(run.stderr.contains("--report"), "{}", run.stderr);
    }
    assert_eq!(folder.names(), ["robot.toml", "samples.csv"]);
    assert_eq!(folder.read("robot.toml"), NOMINAL);
}
