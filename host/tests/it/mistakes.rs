//! Files in each other's place, of the other kind of robot, or in another unit than mm.

use crate::support::{
    Folder, HEADER, NOMINAL, TOLERANCE, TOWERS, csv, exact, good_samples, true_arms,
};
use std::fmt::Write;

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}"));
    folder.write("towers.toml", TOWERS);
    folder.write("samples.csv", good_samples());
    folder.write(
        "travels.csv",
        good_samples().replace(HEADER, "s1_mm,s2_mm,s3_mm,x_mm,y_mm,z_mm\n"),
    );
    folder
}

#[test]
fn files_in_each_others_place_are_recognised() {
    let folder = folder();
    for (command, parts) in [
        (
            "calibrate samples.csv robot.toml",
            [
                "samples.csv:1: this looks like a table of samples",
                "give the robot file",
            ],
        ),
        (
            "calibrate robot.toml robot.toml",
            ["robot.toml:1: ", "this looks like a robot file"],
        ),
        (
            "calibrate towers.toml samples.csv",
            [
                "s1_mm",
                "this file holds joint angles, and carriages drive the robot",
            ],
        ),
        (
            "calibrate robot.toml travels.csv",
            ["q1_deg", "this file holds the travels of carriages"],
        ),
        (
            "export robot.toml --for klipper --nominal towers.toml",
            [
                "towers.toml: carriages on towers drive this robot, named with --nominal",
                "name with --nominal a robot file of the same kind as robot.toml",
            ],
        ),
        (
            "export towers.toml --for correction-table --nominal robot.toml",
            [
                "robot.toml: motors turn the arms of this robot, named with --nominal",
                "of the same kind as towers.toml",
            ],
        ),
    ] {
        let run = folder.run(command);
        assert_eq!(run.code, 3, "{command}: {}{}", run.stdout, run.stderr);
        for part in parts {
            assert!(
                run.stderr.contains(part),
                "{command}: {part}: {}",
                run.stderr
            );
        }
        assert_eq!(run.stdout, "", "{command}");
    }
}

/// The robot file states metres: that is named first, and its own figures are in millimetres. The robot differs from
/// the file by up to 0.9 mm and 0.25°, which is some millimetres at the platform.
#[test]
fn a_robot_file_in_metres_is_named_with_figures_in_millimetres() {
    let folder = folder();
    folder.write(
        "rm.toml",
        "[nominal]\nbase_radius_mm = 0.194\nplatform_radius_mm = 0.03\nupper_arm_mm = 0.26\nforearm_mm = 0.48\n\
         [joints]\nmin_deg = -60\nmax_deg = 90\n",
    );
    let run = folder.run("calibrate rm.toml samples.csv");
    assert_ne!(run.code, 0);
    let said = &run.stderr;
    let robot = said.find("the lengths in rm.toml are metres").unwrap();
    let positions = said.find("the positions are micrometres").unwrap();
    assert!(robot < positions, "{said}");
    let (_, rest) = said.split_once("points are within ").unwrap();
    let within: f64 = rest.split_whitespace().next().unwrap().parse().unwrap();
    assert!((0.5..10.0).contains(&within), "{said}");
}

#[test]
fn init_takes_no_lengths_in_metres() {
    let folder = Folder::new();
    for lengths in [
        "--base-radius 0.194 --platform-radius 0.03 --upper-arm 0.26 --forearm 0.48",
        "--kind linear --tower-radius 0.14 --forearm 0.33 --travel-min 0.1 --travel-max 0.6",
    ] {
        let run = folder.run(&format!("init {lengths}"));
        assert_eq!(run.code, 3, "{}", run.stderr);
        assert!(run.stderr.contains("in metres"), "{}", run.stderr);
        assert!(folder.names().is_empty());
    }
}

/// Heights above the bare plate where it was touched on gauge blocks of 60 and 120 mm.
#[test]
fn gauge_blocks_that_were_left_out_are_asked_for() {
    let folder = Folder::new();
    folder.write("robot.toml", crate::support::TO_MEASURE);
    let mut rows = String::from("q1_deg,q2_deg,q3_deg,height_mm\n");
    for (index, ([a, b, c], _)) in (0..).zip(exact(&true_arms(), 40)) {
        // Wherever the platform is, the gauge reads nearly nothing.
        writeln!(rows, "{a},{b},{c},{}", f64::from(index % 3) * 0.01).unwrap();
    }
    folder.write("touches.csv", rows);
    let run = folder.run("calibrate robot.toml touches.csv");
    assert_eq!(run.code, 1, "{}{}", run.stdout, run.stderr);
    assert!(
        run.stderr
            .contains("is the height of the gauge block in height_mm?"),
        "{}",
        run.stderr
    );
}

/// The error over a region is not called that over the workspace, and rows to add hold nothing that looks measured.
#[test]
fn plans_and_checks_say_what_their_figures_and_rows_are() {
    let folder = Folder::new();
    folder.write("robot.toml", crate::support::TO_MEASURE);
    let plan = "plan robot.toml --measure plane --plane -560 --count 20";
    let run = folder.run(plan).ok();
    assert!(run.stdout.contains("over the workspace"), "{}", run.stdout);
    let run = folder
        .run(&format!("{plan} --within r=150,z=-600..-400"))
        .ok();
    assert!(
        run.stdout
            .contains("over the positions within r=150,z=-600..-400 mm")
            && run.stdout.contains("the worst over the whole workspace")
            && !run.stdout.contains("over the workspace"),
        "{}",
        run.stdout
    );
    folder.write("few.csv", csv(&exact(&true_arms(), 12)));
    let run = folder.run("check robot.toml few.csv").ok();
    let (_, rows) = run.stdout.split_once("Poses that would help most").unwrap();
    let rows: Vec<_> = rows
        .lines()
        .filter(|line| line.matches(',').count() == 8)
        .collect();
    assert!(
        rows[0].ends_with("x_mm,y_mm,z_mm,_nominal_x_mm,_nominal_y_mm,_nominal_z_mm"),
        "{}",
        run.stdout
    );
    assert!(rows.len() == 5 && rows[1..].iter().all(|row| row.contains(",,,,")));
}
