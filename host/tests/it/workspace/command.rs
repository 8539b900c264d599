use crate::support::{Arm, Folder, KEYS, NOMINAL, TOLERANCE, nominal_arms, rows_of};
use std::fmt::Write;

const FILES: [&str; 17] = [
    "band.csv",
    "boundary.csv",
    "boundary.stl",
    "conditioning.csv",
    "cylinders.csv",
    "cylinders.svg",
    "horizontal.svg",
    "influence.csv",
    "influence.svg",
    "parallel.svg",
    "parallel_horizontal.svg",
    "report.html",
    "serial.svg",
    "serial_horizontal.svg",
    "vertical_xz.svg",
    "vertical_yz.svg",
    "view.svg",
];

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}"));
    folder.write("other.toml", NOMINAL.replace("480", "480.5"));
    folder
}

#[test]
fn all_files_are_written_and_the_same_for_any_number_of_threads() {
    let folder = folder();
    let command = "workspace robot.toml --spacing 20 --compare other.toml --output";
    let one = folder.run_where(&format!("{command} one"), "", &[("RAYON_NUM_THREADS", "1")]);
    assert_eq!(one.code, 0, "{}", one.stderr);
    let four = folder.run_where(
        &format!("{command} four"),
        "",
        &[("RAYON_NUM_THREADS", "4")],
    );
    assert_eq!(four.code, 0, "{}", four.stderr);
    let mut names: Vec<_> = std::fs::read_dir(folder.path("one"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, FILES);
    for name in FILES {
        let read = |run: &str| std::fs::read(folder.path(run).join(name)).unwrap();
        assert!(read("one") == read("four"), "{name}");
    }
}

#[test]
fn the_boundary_file_has_its_columns_and_the_json_its_numbers() {
    let folder = folder();
    folder
        .run("workspace robot.toml --spacing 20 --output out --json out.json")
        .ok();
    let csv = folder.read("out/boundary.csv");
    assert!(csv.starts_with("x_mm,y_mm,z_mm,kind\n"), "{csv:.80}");
    assert!(csv.lines().skip(1).all(|line| line.split(',').count() == 4));
    let json: serde_json::Value = serde_json::from_str(&folder.read("out.json")).unwrap();
    assert_eq!(json["boundary_points"], csv.lines().count() - 1);
    let largest = &json["largest_cylinder"];
    let litres = largest["litres"].as_f64().unwrap();
    assert!(litres > 40.0, "{largest}");
    let rows = rows_of(&folder.read("out/cylinders.csv"));
    assert!(rows.iter().all(|row| row[4] <= litres + 1e-3));
    assert_eq!(json["influence"].as_array().unwrap().len(), 24);
    assert_eq!(json["comparison"], serde_json::Value::Null);
    // The lowest place, all joints at 90°; and a joint's motor, platform and elbow in line, folded, on the z axis.
    let [bottom, top] = [0, 1].map(|end| json["extent_mm"]["z"][end].as_f64().unwrap());
    let below = |reach: f64| -f64::sqrt(reach * reach - 164.0 * 164.0);
    assert!((bottom - (below(480.0) - 260.0)).abs() < 0.05, "{bottom}");
    assert!((top - below(480.0 - 260.0)).abs() < 0.05, "{top}");
    // A figure is XML, the page refers to nothing outside itself.
    roxmltree::Document::parse(&folder.read("out/view.svg")).unwrap();
    let page = folder.read("out/report.html");
    let outside = page.matches("http").count();
    assert_eq!(
        outside,
        page.matches("http-equiv").count() + page.matches("http://www.w3.org/2000/svg").count()
    );
}

#[test]
fn rows_of_a_path_are_measured_and_those_beyond_reach_named() {
    let folder = folder();
    let path = "x_mm,y_mm,z_mm\n0,0,-400\n0,0,-147\n0,0,-1000\n0,0,-705\n";
    folder.write("path.csv", path);
    let run = folder
        .run("workspace robot.toml --spacing 30 --path path.csv --output out")
        .ok();
    assert!(run.stdout.contains("line 4: unreachable"), "{}", run.stdout);
    assert!(run.stdout.contains("away from line 3"), "{}", run.stdout);
    let csv = folder.read("out/path.csv");
    assert_eq!(csv.lines().count(), 5);
    assert!(
        csv.lines().nth(3).unwrap().ends_with(",unreachable_1"),
        "{csv}"
    );
    // Joint angles of the same poses give the same distances.
    folder.write("good.csv", "x_mm,y_mm,z_mm\n0,0,-400\n50,-80,-300\n");
    let joints = folder.run("inverse robot.toml good.csv").ok().stdout;
    folder.write("joints.csv", joints);
    let distance = |file: &str| {
        let command = format!("workspace robot.toml --spacing 30 --path {file} --json -");
        let json: serde_json::Value =
            serde_json::from_str(&folder.run(&command).ok().stdout).unwrap();
        json["path"]["rows"][1]["singularity_mm"].as_f64().unwrap()
    };
    assert!((distance("good.csv") - distance("joints.csv")).abs() < 1e-6);
}

fn robot_toml(arms: &[Arm; 3]) -> String {
    let mut toml = String::new();
    for arm in arms {
        toml.push_str("[[arm]]\n");
        for (key, value) in KEYS.iter().zip(arm) {
            writeln!(toml, "{key} = {value:?}").unwrap();
        }
    }
    toml + "[joints]\nmin_deg = -60\nmax_deg = 90\n"
}

/// Nothing but an error of two lines.
fn refused(robot: &str, arguments: &str, code: i32, expected: &[&str]) {
    let folder = Folder::new();
    folder.write("robot.toml", robot);
    folder.write("path.csv", "x_mm,y_mm,z_mm\n0,0,-400\n0,zero,-500\n");
    let run = folder.run(&format!("workspace robot.toml {arguments}"));
    assert_eq!(run.code, code, "{}", run.stderr);
    for part in expected {
        assert!(run.stderr.contains(part), "{part}: {}", run.stderr);
    }
    assert_eq!(run.stdout, "");
    assert_eq!(folder.names(), ["path.csv", "robot.toml"]);
}

#[test]
fn an_empty_workspace_says_why() {
    let short = NOMINAL.replace("480", "80");
    refused(
        &short,
        "--output out",
        3,
        &["robot.toml:", "forearms do not meet", "[joints]"],
    );
    // The planes in which the arms move have no line in common.
    let mut arms = nominal_arms();
    arms[0][1] = 50.0;
    let tight = robot_toml(&arms) + "forearm_max_deg = 1\n";
    refused(
        &tight,
        "--output out",
        3,
        &[
            "the workspace is empty",
            "forearm_max_deg forbids",
            "enlarge",
        ],
    );
    let high = NOMINAL
        .replace("480", "300")
        .replace("-60", "-30")
        .replace("= 90", "= 30");
    refused(
        &high,
        "--output out",
        3,
        &["robot.toml:", "forearms do not meet"],
    );
}

#[test]
fn wrong_options_and_paths_are_refused_with_place_and_cause() {
    refused(NOMINAL, "--tolerance 0", 2, &["--tolerance", "above 0"]);
    refused(NOMINAL, "--spacing -3", 2, &["--spacing"]);
    refused(
        NOMINAL,
        "--spacing 0.01",
        2,
        &["--spacing 0.01 is too small", "smallest value"],
    );
    refused(
        NOMINAL,
        "--spacing 5000",
        3,
        &["thinner", "smaller --spacing"],
    );
    refused(
        NOMINAL,
        "--path path.csv",
        3,
        &["path.csv:3: column y_mm", "zero"],
    );
    refused(NOMINAL, "--path missing.csv", 3, &["missing.csv"]);
    refused(NOMINAL, "--compare missing.toml", 3, &["missing.toml"]);
    refused(
        NOMINAL,
        "--output -",
        2,
        &["--output needs the name of a folder"],
    );
    refused(
        NOMINAL,
        "--json robot.toml",
        2,
        &["--json robot.toml is the same file as the robot file"],
    );
    refused(NOMINAL, "--output robot.toml", 4, &["robot.toml"]);
}
