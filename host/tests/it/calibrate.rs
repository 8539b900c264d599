//! The command `calibrate`: its output and exit codes. Refusals are in `bad_input`.

use crate::support::schema::violations;
use crate::support::{
    Folder, NOISE, NOMINAL, Point, TOLERANCE, arms_of, csv, exact, noisy, number, true_arms,
};
use serde_json::Value;

/// With a robot file that states tolerance and noise.
fn folder(samples: &[(Point, Point)]) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}{NOISE}"));
    folder.write("samples.csv", csv(samples));
    folder
}

fn json(folder: &Folder, files: &str) -> Value {
    let run = folder.run(&format!("calibrate {files} --json -"));
    run.ok().json()
}

#[test]
fn exact_samples_give_back_the_robot() {
    let folder = folder(&exact(&true_arms(), 20));
    folder
        .run("calibrate robot.toml samples.csv --output out.toml --json out.json")
        .ok();
    let found = arms_of(&folder.read("out.toml"));
    let json = folder.json("out.json");
    // Without noise only the tolerance biases the result, by less than its share of σ.
    for (arm, (found, truth)) in found.iter().zip(&true_arms()).enumerate() {
        for (place, (found, truth)) in found.iter().zip(truth).enumerate() {
            let sigma = number(&json, &format!("arms/{arm}/parameters/{place}/sigma"));
            let off = (found - truth).abs();
            assert!(off < sigma, "{off} of {sigma}");
        }
    }
    // The output is itself a robot file, and calibrating it with the same samples changes nothing.
    let again = folder.run("calibrate out.toml samples.csv").ok().stdout;
    assert!(again.contains("do not change the robot"), "{again}");
}

#[test]
fn the_report_has_the_same_parts_in_text_json_and_html() {
    let folder = folder(&noisy(&true_arms(), 30, 0.02));
    let run = folder
        .run("calibrate robot.toml samples.csv --json report.json --report report.html")
        .ok();
    let json = folder.json("report.json");
    let html = folder.read("report.html");
    let parameter = number(&json, "arms/1/parameters/7/after");
    for part in [
        "Parameters",
        "Errors over the samples",
        "Noise",
        "Expected position error",
        "What to measure next",
        &format!("{parameter:.4}"),
    ] {
        assert!(run.stdout.contains(part), "text: {part}");
        assert!(html.contains(part), "page: {part}");
    }
    for from_elsewhere in ["src=\"http", "href=\"http", "<script"] {
        assert!(!html.contains(from_elsewhere), "{from_elsewhere}");
    }
}

#[test]
fn the_schema_of_the_json_holds_every_key() {
    let folder = folder(&noisy(&true_arms(), 30, 0.02));
    let printer = include_str!("../../examples/printer/printer.cfg");
    folder.write("printer.cfg", printer);
    let beside = format!("[probe]\nx_offset: 25\ny_offset: 0\n{printer}");
    folder.write("beside.cfg", beside);
    let schema = include_str!("../../../docs/calibration.schema.json");
    let schema: Value = serde_json::from_str(schema).unwrap();
    for files in ["robot.toml samples.csv", "printer.cfg", "beside.cfg"] {
        let json = json(&folder, files);
        assert_eq!(json["schema_version"], 3);
        let found = violations(&schema, &json);
        assert!(found.is_empty(), "{files}: {found:#?}");
        for key in json.as_object().unwrap().keys() {
            assert!(schema["properties"].get(key).is_some(), "schema: {key}");
        }
        let printer = json["printer"].as_object().into_iter().flatten();
        for (key, _) in printer {
            let described = &schema["properties"]["printer"]["properties"];
            assert!(described.get(key).is_some(), "schema: {key}");
        }
    }
}

#[test]
fn without_tolerance_and_noise_five_samples_are_refused_and_thirty_are_not() {
    let of = |count| {
        let folder = folder(&noisy(&true_arms(), count, 0.02));
        folder.write("robot.toml", NOMINAL);
        folder
    };
    of(5).run("calibrate robot.toml samples.csv").ends(1, "");
    let json = json(&of(30), "robot.toml samples.csv");
    assert_eq!(json["noise"][0]["verdict"], "estimated");
    // Uniform within ±0.02 mm: σ is 0.0115 mm; with 66 degrees of freedom it is known to 9 %.
    let sigma = number(&json, "noise/0/sigma_mm");
    assert!((0.0085..0.0148).contains(&sigma), "{sigma}");
    assert!(number(&json, "noise/0/degrees_of_freedom") > 60.0);
}

#[test]
fn a_limit_that_is_not_met_has_its_exit_code_and_everything_is_written() {
    let folder = folder(&noisy(&true_arms(), 20, 0.02));
    let run = |limit: &str| {
        folder.run(&format!(
            "calibrate robot.toml samples.csv --output out.toml --limit {limit}"
        ))
    };
    run("5mm").ends(0, "Pass: ");
    std::fs::remove_file(folder.path("out.toml")).unwrap();
    run("1um").ends(6, "Fail: ");
    assert!(folder.names().contains(&"out.toml".to_owned()));
}

#[test]
fn copies_count_once_and_repeats_show_the_repeatability() {
    let mut rows = noisy(&true_arms(), 20, 0.01);
    rows.push(rows[0]);
    let mut again = rows[1];
    again.1[0] += 0.015;
    rows.push(again);
    let json = json(&folder(&rows), "robot.toml samples.csv");
    assert_eq!(json["sample_count"], 21);
    let of = |kind: &str| {
        let mut findings = json["findings"].as_array().unwrap().iter();
        let found = findings.find(|own| own["kind"] == kind);
        found.unwrap_or_else(|| panic!("{kind}: {json}"))
    };
    assert_eq!(of("copies")["lines"][0], 22);
    // √(0.015²/2 / 3): one difference in one of the three coordinates of one repeated pose.
    let sigma = number(of("repeatability"), "sigma_mm");
    assert!((sigma - 0.015 / 6.0_f64.sqrt()).abs() < 1e-6, "{sigma}");
}

#[test]
fn a_refusal_on_standard_output_is_json() {
    let mut rows = exact(&true_arms(), 20);
    for row in &mut rows {
        row.0.swap(0, 1);
    }
    let folder = folder(&rows);
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}"));
    let run = folder.run("calibrate robot.toml samples.csv --json -");
    assert_eq!(run.code, 1);
    let json = run.json();
    assert!(json["refused"].is_string() && json["remedy"].is_string());
    let cause = json["diagnosis"]["explanations"][0]["cause"]
        .as_str()
        .unwrap();
    assert!(cause.contains("exchanged"), "{cause}");
}

/// The angle, degrees, of an upper arm with these components when its joint reads 0.
fn zero(la_x: f64, la_y: f64) -> f64 {
    la_y.atan2(la_x).to_degrees()
}

/// The components of an upper arm turned by `by` degrees.
fn turned([la_x, la_y]: [f64; 2], by: f64) -> [f64; 2] {
    let (sine, cosine) = (zero(la_x, la_y) + by).to_radians().sin_cos();
    [cosine, sine].map(|part| la_x.hypot(la_y) * part)
}

/// All methods, the robust fit and plans support it, and output files read back. With a tolerance that the zeros exceed
/// by far, the refusal names them.
#[test]
fn every_method_takes_the_tolerance_of_joint_zeros() {
    let mut made = true_arms();
    for (arm, by) in made.iter_mut().zip([8.0, -5.0, 11.0]) {
        [arm[5], arm[6]] = turned([arm[5], arm[6]], by);
    }
    let folder = Folder::new();
    let tolerance = "[tolerance]\nlength_mm = 0.5\nangle_deg = 0.2\nzero_deg";
    folder.write("robot.toml", format!("{NOMINAL}{tolerance} = 8\n{NOISE}"));
    folder.write("strict.toml", format!("{NOMINAL}{tolerance} = 1\n{NOISE}"));
    folder.write("samples.csv", csv(&noisy(&made, 30, 0.02)));
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
        for (found, truth) in arms_of(&file).iter().zip(&made) {
            // σ is 0.02° if the base frame is given, and 0.1° otherwise.
            let off = (zero(found[5], found[6]) - zero(truth[5], truth[6])).abs();
            assert!(off < 0.4, "{method}: {off}");
        }
    }
    folder
        .run("plan robot.toml --count 12")
        .ends(0, "joint zeros 8°");
    folder
        .run("calibrate strict.toml samples.csv")
        .ends(1, "joint zero");
}
