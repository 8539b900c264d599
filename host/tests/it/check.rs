//! `delta-cal check`, as a user runs it.

use crate::support::{Folder, HEADER, csv, exact, nominal_arms, true_arms};
use serde_json::Value;

const ROBOT: &str = "[nominal]\nbase_radius_mm = 194\nplatform_radius_mm = 30\nupper_arm_mm = 260\n\
                     forearm_mm = 480\n[joints]\nmin_deg = -60\nmax_deg = 90\n";

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", ROBOT);
    folder.write("samples.csv", csv(&exact(&nominal_arms(), 20)));
    folder
}

fn json(folder: &Folder, arguments: &str) -> (i32, Value) {
    let run = folder.run(&format!("check {arguments} --json -"));
    (
        run.code,
        serde_json::from_str(&run.stdout).unwrap_or(Value::Null),
    )
}

fn sum(values: &Value, key: &str) -> f64 {
    let values = values.as_array().unwrap();
    values
        .iter()
        .map(|value| value[key].as_f64().unwrap())
        .sum()
}

#[test]
fn twenty_poses_determine_the_robot_by_either_method() {
    let folder = folder();
    for (method, blocks) in [("ikm", 3), ("fkm", 1)] {
        let (code, json) = json(
            &folder,
            &format!("robot.toml samples.csv --method {method}"),
        );
        assert_eq!(code, 0);
        assert_eq!(json["determined"], true);
        assert_eq!(json["blocks"].as_array().unwrap().len(), blocks);
        // The hat matrix is a projection: its trace is the rank.
        assert!((sum(&json["leverages"], "total") - 24.0).abs() < 1e-6);
        let now = json["position_sigma_mm"].as_f64().unwrap();
        assert!(json["position_sigma_with_next_mm"].as_f64().unwrap() < now);
        assert_eq!(json["next"].as_array().unwrap().len(), 4);
    }
}

#[test]
fn without_poses_to_add_there_is_no_list_of_them() {
    let folder = folder();
    let run = folder.run("check robot.toml samples.csv --add 0").ok();
    assert!(
        !run.stdout.contains("Poses that would help most"),
        "{}",
        run.stdout
    );
    assert!(run.stdout.ends_with("rms now.\n"), "{}", run.stdout);
}

#[test]
fn only_the_joint_angles_count() {
    let folder = folder();
    let moved: Vec<_> = exact(&nominal_arms(), 20)
        .into_iter()
        .map(|(q, [x, y, z])| (q, [z + 900.0, x - 40.0, y]))
        .collect();
    folder.write("tracker.csv", csv(&moved));
    folder.write("true.csv", csv(&exact(&true_arms(), 20)));
    let (_, expected) = json(&folder, "robot.toml samples.csv");
    for file in ["tracker.csv", "true.csv"] {
        let (code, found) = json(&folder, &format!("robot.toml {file}"));
        assert_eq!(code, 0);
        assert_eq!(found["blocks"], expected["blocks"]);
        assert_eq!(found["next"], expected["next"]);
    }
}

#[test]
fn too_few_poses_and_repeated_poses_are_refused_and_the_rank_is_stated() {
    let folder = folder();
    let samples = exact(&nominal_arms(), 20);
    let repeated: Vec<_> = (0..14).map(|index| samples[index % 7]).collect();
    for (few, rank) in [(&samples[..5], 5), (&samples[..7], 7), (&repeated[..], 7)] {
        folder.write("few.csv", csv(few));
        let (code, found) = json(&folder, "robot.toml few.csv --method ikm");
        assert_eq!(code, 1);
        assert_eq!(found["determined"], false);
        for block in found["blocks"].as_array().unwrap() {
            assert_eq!(block["rank"], rank);
            assert_eq!(block["weakest"]["sigma_mm"], Value::Null);
        }
        assert!((sum(&found["leverages"], "total") - 3.0 * f64::from(rank)).abs() < 1e-6);
        let run = folder.run("check robot.toml few.csv --method ikm");
        assert!(
            run.stderr
                .contains("refused: these samples do not determine arm 1")
        );
        assert!(run.stdout.contains("Poses that would help most"));
    }
}

/// The poses that it proposes make of seven samples a robot that is determined.
#[test]
fn what_is_best_added_mends_it() {
    let folder = folder();
    folder.write("few.csv", csv(&exact(&nominal_arms(), 20)[..6]));
    let (code, found) = json(&folder, "robot.toml few.csv --add 6");
    assert_eq!(code, 1);
    let mut text = folder.read("few.csv");
    for pose in found["next"].as_array().unwrap() {
        let numbers = ["joints_deg", "position_mm"]
            .into_iter()
            .flat_map(|key| pose[key].as_array().unwrap())
            .map(ToString::to_string);
        text.push_str(&(numbers.collect::<Vec<_>>().join(",") + "\n"));
    }
    folder.write("mended.csv", text);
    folder.run("check robot.toml mended.csv").ok();
}

#[test]
fn joints_that_move_together_leave_a_combination_that_is_named() {
    let folder = folder();
    let samples: Vec<_> = (0..12)
        .map(|index| {
            let q = -50.0 + 11.0 * f64::from(index);
            (
                [q, q, q],
                crate::support::platform(&nominal_arms(), [q, q, q]),
            )
        })
        .collect();
    folder.write("line.csv", csv(&samples));
    let run = folder.run("check robot.toml line.csv");
    assert_eq!(run.code, 1);
    assert!(
        run.stdout.contains("nothing is known of it"),
        "{}",
        run.stdout
    );
    // With a tolerance it is still said, and what follows from it.
    folder.write(
        "known.toml",
        format!("{ROBOT}[tolerance]\nlength_mm = 0.5\nangle_deg = 0.2\n"),
    );
    let run = folder.run("check known.toml line.csv");
    assert_eq!(run.code, 1);
    assert!(
        run.stderr.contains("the [tolerance] decides"),
        "{}",
        run.stderr
    );
}

#[test]
fn a_sample_that_nothing_checks_is_marked() {
    let folder = folder();
    folder.write("eight.csv", csv(&exact(&nominal_arms(), 20)[..8]));
    let run = folder.run("check robot.toml eight.csv");
    // Eight equations for eight unknowns: every leverage is 1.
    assert_eq!(
        run.stdout.matches("hardly checked by the others").count(),
        8
    );
    let run = folder.run("check robot.toml samples.csv").ok();
    assert!(run.stdout.matches("hardly checked").count() < 8);
}

#[test]
fn wrong_input_is_refused_with_its_place() {
    let folder = folder();
    folder.write(
        "far.csv",
        format!("{HEADER}10,20,30,1,2,-300\n-58,-58,89,0,0,-100\n"),
    );
    folder.write("text.csv", format!("{HEADER}10,20,x,1,2,-300\n"));
    let cases = [
        ("robot.toml text.csv", 3, "text.csv:2: column q3_deg"),
        ("robot.toml none.csv", 3, "none.csv"),
        (
            "robot.toml samples.csv --within x=1..2",
            2,
            "y and z are missing",
        ),
        (
            "robot.toml samples.csv --within r=5,z=10..20",
            2,
            "the robot reaches",
        ),
        ("robot.toml samples.csv --add 500", 2, "--add"),
        ("robot.toml samples.csv --add -1", 2, "--add"),
        (
            "robot.toml samples.csv --json samples.csv",
            2,
            "the same file",
        ),
        ("robot.toml", 2, "SAMPLES.csv"),
    ];
    for (arguments, code, cause) in cases {
        let run = folder.run(&format!("check {arguments}"));
        assert_eq!(run.code, code, "{arguments}: {}", run.stderr);
        assert!(run.stderr.contains(cause), "{arguments}: {}", run.stderr);
    }
    // Forearms that do not meet: no such pose.
    let short = ROBOT.replace("forearm_mm = 480", "forearm_mm = 250");
    folder.write("short.toml", short);
    let run = folder.run("check short.toml far.csv");
    assert_eq!(run.code, 3, "{}", run.stderr);
    assert!(
        run.stderr.contains("far.csv:2: unreachable"),
        "{}",
        run.stderr
    );
}

/// Ball joints of half the range leave no pose to propose within them; what was measured is judged all the same.
#[test]
fn samples_are_judged_even_if_no_pose_can_be_proposed() {
    let folder = folder();
    folder.write(
        "ball.toml",
        ROBOT.replace("max_deg = 90\n", "max_deg = 90\nforearm_max_deg = 0.001\n"),
    );
    let (_, expected) = json(&folder, "robot.toml samples.csv");
    let (code, found) = json(&folder, "ball.toml samples.csv");
    assert_eq!(code, 0);
    assert_eq!(found["blocks"], expected["blocks"]);
    assert_eq!(found["next"].as_array().unwrap().len(), 0);
    assert!(
        found["no_next"]
            .as_str()
            .unwrap()
            .contains("no usable pose")
    );
    assert_eq!(expected["no_next"], Value::Null);
    let run = folder.run("check ball.toml samples.csv").ok();
    assert!(
        run.stdout.contains("No pose can be proposed in addition"),
        "{}",
        run.stdout
    );
    // What is missing is still said.
    folder.write("few.csv", csv(&exact(&nominal_arms(), 20)[..5]));
    let run = folder.run("check ball.toml few.csv");
    assert_eq!(run.code, 1, "{}", run.stderr);
    assert!(!run.stderr.contains("proposed poses"), "{}", run.stderr);
}
