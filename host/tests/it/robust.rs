//! `calibrate --loss`: wrong rows do not count, and every report names them.

use crate::support::{Folder, NOMINAL, TOLERANCE, csv, noisy, true_arms};
use serde_json::Value;

const NOISE: &str = "\n[noise]\nposition_mm = 0.02\njoint_deg = 0.002\n";
/// Line and axis of the positions that are off, and by how many mm.
const WRONG: [(u64, usize, f64); 8] = [
    (3, 0, 5.0),
    (8, 1, -200.0),
    (11, 2, 30.0),
    (17, 0, -60.0),
    (22, 1, 12.0),
    (29, 2, -7.0),
    (33, 0, 150.0),
    (40, 2, 90.0),
];

fn spoilt(folder: &Folder, tolerance: &str) {
    folder.write("robot.toml", format!("{NOMINAL}{NOISE}{tolerance}"));
    let mut samples = noisy(&true_arms(), 40, 0.03);
    for (line, axis, by) in WRONG {
        let index = usize::try_from(line).unwrap() - 2;
        samples[index].1[axis] += by;
    }
    folder.write("samples.csv", csv(&samples));
}

fn lines(report: &Value) -> Vec<u64> {
    let rows = report["suspected_samples"].as_array().unwrap().iter();
    let mut lines: Vec<_> = rows.map(|row| row["line"].as_u64().unwrap()).collect();
    lines.sort_unstable();
    lines
}

#[test]
fn wrong_rows_are_named_by_line_with_residual_and_weight() {
    let folder = Folder::new();
    for tolerance in ["", TOLERANCE] {
        spoilt(&folder, tolerance);
        for how in ["", "--method fkm", "--solver gn", "--frame sensor"] {
            for loss in ["tukey", "huber"] {
                // The page takes a second, and is the same however the fit was made.
                let paged = how.is_empty();
                let page = if paged { "--report report.html" } else { "" };
                let run = folder.run(&format!(
                    "calibrate robot.toml samples.csv --loss {loss} {how} --json report.json {page}"
                ));
                assert_eq!(run.code, 0, "{how} {loss}: {}", run.stderr);
                let report: Value = serde_json::from_str(&folder.read("report.json")).unwrap();
                assert_eq!(report["loss"], loss);
                assert_eq!(lines(&report), WRONG.map(|(line, ..)| line), "{how} {loss}");
                for row in report["suspected_samples"].as_array().unwrap() {
                    assert_eq!(row["weight"], 0.0);
                    assert!(row["residual_sigma"].as_f64().unwrap() > 4.685);
                }
                assert!(run.stdout.contains("8 of 40 samples suspected"));
                if !paged {
                    continue;
                }
                let page = folder.read("report.html");
                assert!(page.contains("Suspected samples"), "{how} {loss}");
                for (line, ..) in WRONG {
                    assert!(page.contains(&format!("<th scope=\"row\">{line}</th>")));
                }
            }
        }
    }
}

#[test]
fn without_a_loss_the_refusal_says_how_many_rows_agree_and_which_do_not() {
    let folder = Folder::new();
    spoilt(&folder, "");
    let run = folder.run("calibrate robot.toml samples.csv");
    assert_eq!(run.code, 1, "{}", run.stdout);
    let words = run.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    let lines =
        "32 of 40 samples agree with each other, and lines 3, 8, 11, 17, 22, 29, 33 and 40 do not";
    assert!(words.contains(lines), "{}", run.stderr);
    assert!(run.stderr.contains("--loss tukey"), "{}", run.stderr);
}

#[test]
fn twelve_samples_are_too_few_and_what_would_do_is_said() {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{NOISE}"));
    folder.write("samples.csv", csv(&noisy(&true_arms(), 12, 0.03)));
    let run = folder.run("calibrate robot.toml samples.csv --loss tukey");
    assert_eq!(run.code, 1, "{}", run.stdout);
    assert!(run.stderr.contains("it needs 16"), "{}", run.stderr);
    assert!(run.stderr.contains("--loss squared"), "{}", run.stderr);
}
