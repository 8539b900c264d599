//! Rows that hold no measurement, one measurement many times, or the place of a reflector; files that
//! hold nothing.

use crate::support::{
    Folder, HEADER, NOMINAL, Point, TOLERANCE, assert_fails, csv, exact, good_samples, platform,
    rows_of, true_arms,
};

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}"));
    folder
}

#[test]
fn rows_that_are_one_measurement_are_refused() {
    let first = good_samples().lines().nth(1).unwrap().to_owned() + "\n";
    let robot = format!("{NOMINAL}{TOLERANCE}");
    let same = format!("{HEADER}{}", first.repeat(25));
    let expected: &[&str] = &[
        "samples.csv: all 25 rows are identical, so they are one measurement",
        "different poses",
    ];
    assert_fails(robot.as_bytes(), same.as_bytes(), 1, expected);
    // The same of heights above a plane.
    let height = format!("q1_deg,q2_deg,q3_deg,height_mm\n{}", "1,2,3,4\n".repeat(25));
    assert_fails(robot.as_bytes(), height.as_bytes(), 1, expected);
}

/// 40 mm is far more than this robot is off anywhere.
#[test]
fn a_reflector_below_the_platform_is_named() {
    let below: Vec<_> = exact(&true_arms(), 20)
        .into_iter()
        .map(|(q, [x, y, z])| (q, [x, y, z - 40.0]))
        .collect();
    let (robot, below) = (format!("{NOMINAL}{TOLERANCE}"), csv(&below));
    let expected = [
        "refused: samples.csv: ",
        " mm below where robot.toml puts the platform point",
        "state its place in robot.toml: [target] with x_mm = ",
        "z_mm = -4",
        "--frame sensor",
    ];
    assert_fails(robot.as_bytes(), below.as_bytes(), 1, &expected);
    let folder = Folder::new();
    folder.write("samples.csv", &below);
    // Without a tolerance 40 mm are accepted as an error of the robot, with a doubt.
    folder.write("robot.toml", NOMINAL);
    let run = folder.run("calibrate robot.toml samples.csv --json -").ok();
    let report: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    let doubts = report["warnings"].to_string();
    assert!(doubts.contains("[target] with x_mm = "), "{doubts}");
    let target = "\n[target]\nx_mm = 0\ny_mm = 0\nz_mm = -40\n";
    folder.write("robot.toml", format!("{robot}{target}"));
    let run = folder.run("calibrate robot.toml samples.csv").ok();
    assert!(!run.stdout.contains("[target]"), "{}", run.stdout);
}

/// The positions that `delta-cal plan` wrote before they had columns of their own: those of the nominal
/// robot, to the millionth of a mm.
fn planned(count: u32) -> Vec<(Point, Point)> {
    let nominal = crate::support::nominal_arms();
    let poses = crate::support::poses(count).into_iter();
    let poses = poses.map(|q| q.map(|q| (q * 1e3).round() / 1e3));
    poses
        .map(|q| (q, platform(&nominal, q).map(|x| (x * 1e6).round() / 1e6)))
        .collect()
}

#[test]
fn rows_that_are_still_as_planned_are_named() {
    let folder = folder();
    let plan = planned(20);
    let mut some = plan.clone();
    for (index, (q, x)) in some.iter_mut().enumerate() {
        if ![3, 8].contains(&index) {
            *x = platform(&true_arms(), *q);
        }
    }
    let emptied: String = csv(&some)
        .lines()
        .enumerate()
        .map(|(index, line)| match index {
            4 | 9 => line.split(',').take(3).collect::<Vec<_>>().join(",") + ",,,\n",
            _ => format!("{line}\n"),
        })
        .collect();
    for (samples, refused, checked) in [
        (
            csv(&plan),
            "samples.csv:2: 20 rows are still as planned, not measured (lines 2, 3,",
            "Not measured yet: lines 2, 3,",
        ),
        (
            csv(&some),
            "samples.csv:5: 2 rows are still as planned, not measured (lines 5 and 10): their x, y and z are \
             those of robot.toml to the last digit",
            "Not measured yet: lines 5 and 10.",
        ),
        (
            emptied,
            "samples.csv:5: nothing was measured in this row",
            "Not measured yet: lines 5 and 10.",
        ),
    ] {
        folder.write("samples.csv", samples);
        let run = folder.run("calibrate robot.toml samples.csv --output out.toml");
        assert_eq!(run.code, 3, "{}", run.stderr);
        assert!(run.stderr.contains(refused), "{}", run.stderr);
        assert_eq!(folder.names(), ["robot.toml", "samples.csv"]);
        let check = folder
            .run("plan robot.toml --samples samples.csv --count 0")
            .ok()
            .stdout;
        assert!(check.contains(checked), "{checked}: {check}");
    }
}

/// Whoever simulates the nominal robot, or measures where it agrees with the file, has not these digits.
#[test]
fn positions_that_agree_with_the_robot_file_are_no_plan() {
    let folder = folder();
    for digits in [1e3, 1e9] {
        let nominal: Vec<_> = planned(20)
            .into_iter()
            .map(|(q, _)| {
                (
                    q,
                    platform(&crate::support::nominal_arms(), q)
                        .map(|x| (x * digits).round() / digits),
                )
            })
            .collect();
        folder.write("samples.csv", csv(&nominal));
        folder.run("calibrate robot.toml samples.csv").ok();
    }
    // Forward states nine digits.
    folder.write("angles.csv", csv(&planned(20)));
    let forward = folder.run("forward robot.toml angles.csv").ok().stdout;
    assert_eq!(rows_of(&forward).len(), 20);
    folder.write("samples.csv", forward);
    folder.run("calibrate robot.toml samples.csv").ok();
}

#[test]
fn files_without_end_are_refused_by_size_or_content() {
    if !std::path::Path::new("/dev/zero").exists() {
        return;
    }
    let folder = Folder::new();
    folder.write("robot.toml", NOMINAL);
    folder.write("samples.csv", good_samples());
    for (command, cause) in [
        (
            "calibrate /dev/zero samples.csv",
            "/dev/zero: the file is larger than 1 MB, and no robot file or campaign is",
        ),
        (
            "calibrate robot.toml /dev/zero",
            "/dev/zero: is not a text file",
        ),
    ] {
        let run = folder.run(command);
        assert_eq!(run.code, 3, "{}", run.stderr);
        assert!(run.stderr.contains(cause), "{}", run.stderr);
    }
}
