//! `delta-cal calibrate --report`: one self-contained file with every number.

use crate::support::{Folder, NOMINAL, TOLERANCE, csv, exact, noisy, true_arms};
use delta_cal_host::files::example;
use delta_cal_host::{CalibrationMethod, Options, calibrate};
use nalgebra::Matrix3;
use roxmltree::Document;
use serde_json::Value;

const NOISE: &str = "\n[noise]\nposition_mm = 0.01\njoint_deg = 0.0\n";

fn folder(robot: &str, samples: &str) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot);
    folder.write("samples.csv", samples);
    folder
}

/// Every drawing of the page.
fn drawings(page: &str) -> Vec<&str> {
    page.match_indices("<svg")
        .map(|(start, _)| {
            let end = start + page[start..].find("</svg>").unwrap() + "</svg>".len();
            &page[start..end]
        })
        .collect()
}

/// The cells of each row of the page's tables.
fn rows(page: &str) -> Vec<Vec<String>> {
    page.match_indices("<tr")
        .map(|(start, _)| {
            let end = start + page[start..].find("</tr>").unwrap() + "</tr>".len();
            let document = Document::parse(&page[start..end]).unwrap();
            let cells = document.root_element().children();
            let text = |cell: roxmltree::Node<'_, '_>| {
                cell.descendants()
                    .filter(roxmltree::Node::is_text)
                    .filter_map(|node| node.text())
                    .collect()
            };
            cells.map(text).collect()
        })
        .collect()
}

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

#[test]
fn every_sample_is_drawn_in_every_view() {
    let folder = folder(NOMINAL, &csv(&noisy(&true_arms(), 30, 0.01)));
    folder
        .run("calibrate robot.toml samples.csv --report report.html")
        .ok();
    let page = folder.read("report.html");
    let discs: Vec<_> = drawings(&page)
        .into_iter()
        .map(|drawing| {
            let document = Document::parse(drawing).unwrap();
            document
                .descendants()
                .filter(|node| node.tag_name().name() == "circle")
                .count()
        })
        .collect();
    // With those of the legends: parameters, before and after, in σ those after only, three arms'
    // closure errors without legends, four views, conditions, four maps without any, joints; the joints of the
    // arms in the drawing that explains the parameters.
    let mut expected = vec![24 + 3, 60 + 2, 31, 30, 30, 30, 31, 31, 31, 31, 3 + 1];
    expected.extend([0; 4]);
    expected.extend([90 + 1, 10]);
    assert_eq!(discs, expected);
}

#[test]
fn the_page_fetches_nothing_and_runs_nothing() {
    let folder = folder(NOMINAL, &csv(&noisy(&true_arms(), 20, 0.01)));
    folder
        .run("calibrate robot.toml samples.csv --report report.html")
        .ok();
    // Every drawing names its language by an address that nothing is fetched from.
    let page = folder
        .read("report.html")
        .replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for part in [
        "http:", "https:", "//", "<script", "<link", "<img", "url(", "@import", "src=", "href=",
    ] {
        assert!(!page.contains(part), "{part}");
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let folder = folder(
        &format!("{NOMINAL}{TOLERANCE}"),
        &csv(&noisy(&true_arms(), 20, 0.01)),
    );
    for name in ["first.html", "second.html"] {
        let arguments = format!("calibrate robot.toml samples.csv --report {name}");
        let date = [("SOURCE_DATE_EPOCH", "0")];
        folder.run_where(&arguments, "", &date).ok();
    }
    assert_eq!(folder.read("first.html"), folder.read("second.html"));
}

#[test]
#[cfg(unix)]
fn file_names_are_escaped() {
    let folder = folder(NOMINAL, "");
    let samples = csv(&noisy(&true_arms(), 20, 0.01));
    folder.write("<i>&\"'samples.csv", samples);
    folder
        .run("calibrate robot.toml <i>&\"'samples.csv --report report.html")
        .ok();
    let page = folder.read("report.html");
    assert!(
        page.contains("&lt;i&gt;&amp;&quot;'samples.csv"),
        "{page:.3000}"
    );
    assert!(!page.contains("<i>"));
}

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
    let labelled = |drawing: &&str| drawing.contains("line 22\n");
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

#[test]
fn three_samples_without_a_known_sigma_have_a_report() {
    let folder = folder(
        &format!("{NOMINAL}{TOLERANCE}"),
        &csv(&exact(&true_arms(), 3)),
    );
    folder
        .run("calibrate robot.toml samples.csv --report report.html")
        .ok();
    let page = folder.read("report.html");
    for drawing in drawings(&page) {
        Document::parse(drawing).unwrap();
    }
    assert!(page.contains("its σ is not known"));
    assert!(!page.contains("NaN"));
}

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
