//! Of many rows the reports show some, and say so.

use crate::support::{Folder, NOMINAL, TOLERANCE, csv, noisy, true_arms};
use serde_json::Value;

#[test]
fn reports_of_many_rows_stay_small_and_say_what_they_show() {
    let folder = Folder::new();
    let mut samples = noisy(&true_arms(), 10_001, 0.02);
    // In line 7002, far from every other.
    samples[7000].1[2] += 1.0;
    folder.write("samples.csv", csv(&samples));
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}"));
    folder
        .run("calibrate robot.toml samples.csv --json report.json --report report.html")
        .ok();
    let json: Value = serde_json::from_str(&folder.read("report.json")).unwrap();
    let (sampled, shown) = (&json["sampled"], json["samples"].as_array().unwrap());
    assert_eq!(json["sample_count"], 10_001);
    assert_eq!(sampled["of"], 10_001);
    assert_eq!(sampled["shown"], shown.len());
    assert!((1_500..=2_000).contains(&shown.len()), "{}", shown.len());
    let lines: Vec<_> = shown
        .iter()
        .map(|row| row["line"].as_u64().unwrap())
        .collect();
    assert!(lines.is_sorted_by(|a, b| a < b));
    assert!(lines.contains(&7002), "the farthest off is not shown");
    for key in ["error_after_mm", "error_after_sigma"] {
        let histogram = &sampled[key];
        let bars = histogram["counts"].as_array().unwrap().iter();
        let counted: u64 = bars.map(|bar| bar.as_u64().unwrap()).sum();
        assert_eq!(
            counted + histogram["beyond"].as_u64().unwrap(),
            10_001,
            "{key}"
        );
    }
    // 5 MB, as promised for a million rows, which show no more rows than this.
    let page = folder.read("report.html");
    assert!(page.len() < 5_000_000, "{}", page.len());
    let note = format!("{} of 10001 samples", shown.len());
    assert!(page.contains(&note), "{note}");
    assert!(page.contains("line 7002"));
}
