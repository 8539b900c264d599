//! What the page says is doubtful, and what is to be measured next.

use crate::report::{NOISE, drawings, folder, rows};
use crate::support::{Folder, NOMINAL, TOLERANCE, csv, exact, noisy, true_arms};
use serde_json::Value;

#[test]
fn the_built_in_example_says_in_its_report_that_it_is_simulated() {
    let folder = Folder::new();
    folder.run("calibrate --report report.html").ok();
    let page = folder.read("report.html");
    assert!(page.contains("simulated"));
    assert!(page.contains("Nothing doubtful was found"));
    assert!(page.contains("Nothing needs to be measured"));
}

#[test]
fn an_outlier_is_marked_with_its_line_in_the_figure_and_in_the_table() {
    let mut samples = noisy(&true_arms(), 60, 0.01);
    samples[20].1[0] += 1.0;
    let folder = folder(&format!("{NOMINAL}{TOLERANCE}"), &csv(&samples));
    folder
        .run("calibrate robot.toml samples.csv --report report.html")
        .ok();
    let page = folder.read("report.html");
    let marked: Vec<_> = rows(&page)
        .into_iter()
        .filter(|row| row.last().is_some_and(|cell| cell == "stands out"))
        .map(|row| row[0].clone())
        .collect();
    assert_eq!(marked, ["22"]);
    let labelled = |drawing: &&str| drawing.contains("line 22</text>");
    assert_eq!(
        drawings(&page)
            .iter()
            .filter(|drawing| labelled(drawing))
            .count(),
        6
    );
    assert!(page.contains("First measure the sample of line 22 again"));
}

#[test]
fn poses_in_a_corner_are_told_what_is_missing() {
    // Joint angles of 40° to 65° only: each above the middle of −60° to 90°.
    let corner: Vec<_> = exact(&true_arms(), 400)
        .into_iter()
        .filter(|(q, _)| q.iter().all(|angle| *angle > 40.0))
        .collect();
    assert!(corner.len() > 4);
    let folder = folder(&format!("{NOMINAL}{TOLERANCE}{NOISE}"), &csv(&corner));
    folder
        .run("calibrate robot.toml samples.csv --report report.html")
        .ok();
    let page = folder.read("report.html");
    assert!(page.contains("These samples hardly distinguish "));
    assert!(page.contains(
        "The samples move these joints through only a small part of their range of -60° to 90°"
    ));
    let (_, proposed) = page
        .split_once("These joint angles would tell most about the robot, the best first: ")
        .unwrap();
    let (proposed, _) = proposed.split_once('.').unwrap();
    for pose in proposed.split("; ") {
        let angles: Vec<f64> = pose
            .split(", ")
            .map(|angle| angle.trim_end_matches('°').parse().unwrap())
            .collect();
        assert_eq!(angles.len(), 3);
        assert!(angles.iter().any(|angle| *angle < 40.0), "{pose}");
    }
    assert!(!page.contains("Nothing needs to be measured"));
}

/// The numbers of a field of all 24 parameters.
fn numbers(json: &Value, field: &str) -> Vec<f64> {
    let arms = json["arms"].as_array().unwrap().iter();
    arms.flat_map(|arm| arm["parameters"].as_array().unwrap())
        .map(|parameter| parameter[field].as_f64().unwrap())
        .collect()
}

fn is_angle(index: usize) -> bool {
    matches!(index % 8, 3 | 4)
}

/// The advice names the worst parameter, and how many beyond the first four exceed their limit.
fn assert_named(page: &str, against: &str, ratios: &[f64]) {
    let symbols = ["Dx", "Dy", "Dz", "theta", "alpha", "La_x", "La_y", "Lb"];
    let exceeding = ratios.iter().filter(|ratio| **ratio > 1.0).count();
    let worst = (0..24)
        .max_by(|a, b| ratios[*a].total_cmp(&ratios[*b]))
        .unwrap();
    let (symbol, arm) = (symbols[worst % 8], worst / 8 + 1);
    let sentence = format!(
        "The σ of these parameters is larger than {against}, the largest first: {symbol} of arm {arm} (σ "
    );
    assert!(page.contains(&sentence), "{sentence}");
    assert!(exceeding > 0);
    if exceeding > 4 {
        let others = exceeding - 4;
        assert!(page.contains(&format!(", and {others} more. Four times")));
    }
    assert!(!page.contains("Nothing needs to be measured"));
}

#[test]
fn a_sigma_above_half_the_tolerance_is_named_though_the_poses_are_good() {
    let folder = folder(
        &format!("{NOMINAL}{TOLERANCE}\n[noise]\nposition_mm = 0.06\njoint_deg = 0.0\n"),
        &csv(&noisy(&true_arms(), 40, 0.06)),
    );
    folder
        .run("calibrate robot.toml samples.csv --json report.json --report report.html")
        .ok();
    let json: Value = serde_json::from_str(&folder.read("report.json")).unwrap();
    assert!(
        numbers(&json, "prior_share")
            .iter()
            .all(|share| *share < 0.5)
    );
    let sigmas = numbers(&json, "sigma").into_iter().enumerate();
    let half = |index| if is_angle(index) { 0.1 } else { 0.25 };
    let ratios: Vec<_> = sigmas.map(|(index, sigma)| sigma / half(index)).collect();
    assert_named(&folder.read("report.html"), "half its tolerance", &ratios);
}

#[test]
fn without_a_tolerance_a_sigma_above_the_median_change_is_named() {
    let folder = folder(NOMINAL, &csv(&noisy(&true_arms(), 40, 0.3)));
    folder
        .run("calibrate robot.toml samples.csv --json report.json --report report.html")
        .ok();
    let json: Value = serde_json::from_str(&folder.read("report.json")).unwrap();
    // An angle moves the end of the upper arm, of 260 mm.
    let in_millimetres = |field| {
        let values = numbers(&json, field).into_iter().enumerate();
        let length = |(index, value): (usize, f64)| {
            if is_angle(index) {
                value.abs().to_radians() * 260.0
            } else {
                value.abs()
            }
        };
        values.map(length).collect::<Vec<_>>()
    };
    let mut changes = in_millimetres("change");
    changes.sort_by(f64::total_cmp);
    let sigmas = in_millimetres("sigma").into_iter();
    let ratios: Vec<_> = sigmas.map(|sigma| sigma / changes[12]).collect();
    assert_named(
        &folder.read("report.html"),
        "the change of the median parameter",
        &ratios,
    );
}
