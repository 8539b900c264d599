//! `delta-cal validate`: a robot file against independent measurements and a limit.

use crate::support::{
    Folder, NOISE, NOMINAL, Point, Run, assert_refused, csv, exact, nominal_arms, number, platform,
    poses, true_arms,
};
use serde_json::Value;

/// Exact samples of the nominal robot with every position shifted by this vector.
fn shifted(count: u32, by: Point) -> Vec<(Point, Point)> {
    let mut samples = exact(&nominal_arms(), count);
    for (_, x) in &mut samples {
        for (own, by) in x.iter_mut().zip(by) {
            *own += by;
        }
    }
    samples
}

/// Samples shifted by 0.05 mm.
fn off(count: u32) -> Vec<(Point, Point)> {
    shifted(count, [0.03, -0.04, 0.0])
}

fn folder(robot: &str, samples: &[(Point, Point)]) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot);
    folder.write("check.csv", csv(samples));
    folder
}

fn stated() -> String {
    format!("{NOMINAL}{NOISE}")
}

fn validate(folder: &Folder, options: &str) -> Run {
    folder.run(&format!("validate robot.toml check.csv {options}"))
}

/// The report, after checking the exit code.
fn report(folder: &Folder, code: i32, options: &str) -> Value {
    let run = validate(folder, &format!("{options} --json -"));
    assert_eq!(run.code, code, "{options}: {}", run.stderr);
    run.json()
}

fn near(report: &Value, path: &str, expected: f64, within: f64) {
    let found = number(report, path);
    assert!(
        (found - expected).abs() < within,
        "{path}: {found} {expected}"
    );
}

/// The requested number of poses suffices for a decision if they scatter as before.
#[test]
fn as_many_poses_as_are_asked_for_decide() {
    let limit = "--limit 0.051mm";
    let few = folder(&stated(), &off(16));
    let asked = report(&few, 6, limit)["rms_error"]["poses_to_decide"].as_u64();
    let asked = u32::try_from(asked.unwrap()).unwrap();
    assert!(asked > 16, "{asked}");
    validate(&few, limit).ends(6, "Measure ");
    // All rows are identical, so the scatter falls with each further row and the requested number is more than enough.
    report(&folder(&stated(), &off(asked)), 0, limit);
}

/// Rows of the same pose share the robot's error.
#[test]
fn rows_of_one_pose_count_once() {
    let samples = shifted(10, [0.03, 0.0, 0.0]);
    // An exact copy of a row would be merged with it.
    let again = samples.iter().map(|(q, x)| (*q, x.map(|x| x + 1e-8)));
    let twice: Vec<_> = samples.iter().copied().chain(again).collect();
    let [once, twice] =
        [samples, twice].map(|rows| report(&folder(NOMINAL, &rows), 0, "--limit 1mm"));
    assert_eq!(
        (&twice["row_count"], &twice["pose_count"]),
        (&20.into(), &10.into())
    );
    let degrees = "rms_error/degrees_of_freedom";
    near(&twice, degrees, number(&once, degrees), 1e-6);
}

#[test]
fn the_measurements_of_the_calibration_are_no_validation() {
    let arms = true_arms();
    let folder = folder(&stated(), &exact(&arms, 20));
    folder
        .run("calibrate robot.toml check.csv --output calibrated.toml")
        .ok();
    let table = "check.csv ⇒ 3 ⇒ the same measurements";
    assert_refused(&folder, "validate calibrated.toml --limit 1mm", table);
    let other: Vec<_> = poses(60)[20..]
        .iter()
        .map(|q| (*q, platform(&arms, *q)))
        .collect();
    folder.write("other.csv", csv(&other));
    folder
        .run("validate calibrated.toml other.csv --limit 1mm")
        .ok();
}
