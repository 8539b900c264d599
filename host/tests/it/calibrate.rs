//! The command `calibrate`: its output. Refusals and exit codes are `cases`.

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
