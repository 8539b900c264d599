//! Gears and encoders that are not exact: `[tolerance] transmission_deg`, and robot files that hold what was found.

use crate::support::Folder;
use delta_cal::Robot;
use delta_cal::robot::Transmission;
use delta_cal::simulate::{random_pose, standard_normal};
use delta_cal_host::{InputText, RobotFile};
use delta_cal_tests::{Spread, generator, paper_limits, paper_robot, perturbed};
use rand_pcg::Pcg32;
use serde_json::Value;
use std::fmt::Write;

const NUMBERS: [[f64; 5]; 3] = [
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [1.5e-3, 1.2e-3, -1.0e-3, 0.0, 0.0],
    [0.0, 0.0, 0.0, 6e-4, -4e-4],
];

fn robot_file(tolerance: &str) -> String {
    format!(
        "[nominal]\nbase_radius_mm = 194\nplatform_radius_mm = 30\nupper_arm_mm = 260\nforearm_mm = 480\n\
         [joints]\nmin_deg = -60\nmax_deg = 90\n\
         [tolerance]\nlength_mm = 0.5\nangle_deg = 0.2\n{tolerance}\
         [noise]\nposition_mm = 0.02\njoint_deg = 0.002\n"
    )
}

const ASKED: &str = "transmission_deg = 0.05\n";

fn made(rng: &mut Pcg32) -> Robot<f64> {
    let truth = perturbed(
        &paper_robot(),
        0.5,
        0.2f64.to_radians(),
        Spread::Normal,
        rng,
    );
    let numbers = NUMBERS.map(|numbers| Transmission::new(numbers).unwrap());
    truth.with_transmissions(numbers).unwrap()
}

fn positions(truth: &Robot<f64>, rows: u32, sigma: f64, rng: &mut Pcg32) -> String {
    let mut text = String::from("q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm\n");
    for _ in 0..rows {
        let pose = random_pose(truth, &paper_limits(), rng).unwrap();
        let [a, b, c] = pose.joints.map(f64::to_degrees);
        let position = pose
            .position
            .map(|x| x + sigma * standard_normal::<f64, _>(rng));
        writeln!(
            text,
            "{a},{b},{c},{},{},{}",
            position.x, position.y, position.z
        )
        .unwrap();
    }
    text
}

fn read(text: &str) -> RobotFile {
    RobotFile::read(&InputText::new("robot.toml", text)).unwrap()
}

fn rms(robot: &Robot<f64>, truth: &Robot<f64>, rng: &mut Pcg32) -> f64 {
    let squares = (0..200).map(|_| {
        let pose = random_pose(truth, &paper_limits(), rng).unwrap();
        (robot.forward(&pose.joints).unwrap() - pose.position).norm_squared()
    });
    (squares.sum::<f64>() / 200.0).sqrt()
}

/// What a controller with an independent model of gears would be told: the calibrated file, read again, moves the
/// platform as the real robot does, and nine times better than without the transmissions.
#[test]
fn gears_are_found_written_and_used() {
    let folder = Folder::new();
    let mut rng = generator(61, 0);
    let truth = made(&mut rng);
    folder.write("robot.toml", robot_file(ASKED));
    folder.write("samples.csv", positions(&truth, 80, 0.02, &mut rng));
    let output = folder.run("calibrate robot.toml samples.csv --output c.toml --json c.json");
    let output = output.ok();
    let shown = output.stdout;
    assert!(shown.contains("Gears and encoders"), "{shown}");

    let after = read(&folder.read("c.toml"));
    let error = rms(&after.robot, &truth, &mut rng);
    // 240 readings of 0.02 mm tell 39 numbers: 0.02 √(39/240) in each coordinate, √3 of that, on average.
    assert!(error < 2.0 * 0.014, "{error}");
    let [first, second, third] = *after.robot.arms();
    let without =
        Robot::from_parameters([first, second, third].map(|arm| arm.parameters())).unwrap();
    assert!(rms(&without, &truth, &mut rng) > 9.0 * error);

    let json: Value = serde_json::from_str(&folder.read("c.json")).unwrap();
    for (arm, found) in after.robot.transmissions().iter().enumerate() {
        let stated = &json["arms"][arm]["transmission"];
        let number = |kind: &str, key: &str| stated[kind][key].as_f64().unwrap();
        let [gain, cos, ..] = found.numbers();
        assert!((number("found", "gain") - gain).abs() < 1e-15);
        assert!((number("found", "cos_deg") - cos.to_degrees()).abs() < 1e-12);
        for (index, key) in ["gain", "cos_deg", "sin_deg", "cos2_deg", "sin2_deg"]
            .iter()
            .enumerate()
        {
            let unit = if index == 0 { 1.0 } else { 1f64.to_degrees() };
            let off = number("found", key) - NUMBERS[arm][index] * unit;
            let sigma = number("sigma", key);
            // Fifteen numbers within four σ, and σ not above what was stated.
            assert!(
                off.abs() < 4.0 * sigma && sigma < 0.0501 * unit.max(1.0),
                "{arm} {key} {off} {sigma}"
            );
        }
    }

    // The same file without: 24 parameters take up some of it.
    folder.write("plain.toml", robot_file(""));
    folder
        .run("calibrate plain.toml samples.csv --output p.toml")
        .ok();
    let plain = read(&folder.read("p.toml")).robot;
    assert!(rms(&plain, &truth, &mut rng) > 2.0 * error);
}

/// Forward and inverse kinematics of the command line use a file's transmissions.
#[test]
fn kinematics_use_the_transmissions_of_a_file() {
    let folder = Folder::new();
    let mut rng = generator(62, 0);
    let truth = made(&mut rng);
    let mut file = read(&robot_file(ASKED));
    file.robot = truth;
    let text = file.to_toml("");
    assert_eq!(read(&text).robot, truth);
    folder.write("robot.toml", &text);
    folder.write("joints.csv", "q1_deg,q2_deg,q3_deg\n20,-10,35\n");
    let output = folder.run("forward robot.toml joints.csv");
    let output = output.ok();
    let shown = output.stdout;
    let numbers =
        |line: &str| -> Vec<f64> { line.split(',').map(|cell| cell.parse().unwrap()).collect() };
    let found = numbers(shown.lines().last().unwrap());
    let expected = truth
        .forward(&[20f64, -10.0, 35.0].map(f64::to_radians))
        .unwrap();
    for (found, expected) in found.iter().rev().zip(expected.iter().rev()) {
        assert!((found - expected).abs() < 1e-5);
    }
    folder.write(
        "positions.csv",
        format!(
            "x_mm,y_mm,z_mm\n{:?},{:?},{:?}\n",
            expected.x, expected.y, expected.z
        ),
    );
    let output = folder.run("inverse robot.toml positions.csv");
    let shown = output.stdout;
    let found = numbers(shown.lines().last().unwrap());
    for (found, expected) in found.iter().zip([20.0, -10.0, 35.0]) {
        assert!((found - expected).abs() < 1e-4, "{shown}");
    }
}

#[test]
fn what_cannot_be_is_refused_with_its_place() {
    let folder = Folder::new();
    let mut rng = generator(63, 0);
    let samples = positions(&made(&mut rng), 30, 0.02, &mut rng);
    folder.write("samples.csv", &samples);
    let arm = "[[arm]]\ndx_mm = 164\ndy_mm = 0\ndz_mm = 0\ntheta_deg = 0\nalpha_deg = 0\nla_x_mm = 260\nla_y_mm = 0\nlb_mm = 480\n";
    let linear = "[nominal]\nkind = \"linear\"\ntower_radius_mm = 140\nforearm_mm = 330\n[joints]\nmin_mm = 100\nmax_mm = 600\n\
                  [tolerance]\nlength_mm = 0.5\nangle_deg = 0.2\nscale = 0.001\n";
    let cases = [
        (
            robot_file("transmission_deg = 0\n"),
            vec!["robot.toml:12", "transmission_deg", "0 is not above 0"],
        ),
        (
            robot_file("transmission_deg = 6\n"),
            vec!["robot.toml:12", "below 5.7 degrees"],
        ),
        (
            robot_file("transmission_deg = nan\n"),
            vec!["robot.toml:12", "not a finite number"],
        ),
        (
            format!("{linear}transmission_deg = 0.05\n"),
            vec!["robot.toml:12", "kind = \"linear\" has no such key"],
        ),
        (
            format!(
                "{arm}transmission_sin_deg = 7\n{arm}{arm}[joints]\nmin_deg = -60\nmax_deg = 90\n"
            ),
            vec!["robot.toml:10", "transmission_sin_deg", "exact but for"],
        ),
    ];
    for (text, expected) in cases {
        folder.write("robot.toml", &text);
        let output = folder.run("calibrate robot.toml samples.csv --output c.toml");
        let shown = output.stderr;
        assert_eq!(output.code, 3, "{shown}");
        for expected in expected {
            assert!(shown.contains(expected), "{expected}: {shown}");
        }
        assert!(!folder.path("c.toml").exists());
    }
    folder.write("robot.toml", robot_file(ASKED));
    for option in ["--method ikm", "--gate", "--no-guess"] {
        let output = folder.run(&format!("calibrate robot.toml samples.csv {option}"));
        let shown = output.stderr;
        assert!(
            shown.contains("cannot be used where transmissions are to be found"),
            "{shown}"
        );
    }
}

/// A plan for transmissions has x, y and z to fill in, and `check` says what the poses are worth.
#[test]
fn poses_are_planned_and_checked_for_transmissions() {
    let folder = Folder::new();
    folder.write("robot.toml", robot_file(ASKED));
    let output = folder.run("plan robot.toml --count 30 --output plan.csv --json plan.json");
    output.ok();
    let header = folder.read("plan.csv");
    assert!(
        header.lines().any(|line| line.contains("x_mm,y_mm,z_mm")),
        "{header}"
    );
    let plan: Value = serde_json::from_str(&folder.read("plan.json")).unwrap();
    let output = folder.run("check robot.toml plan.csv --add 0 --json check.json");
    output.ok();
    let check: Value = serde_json::from_str(&folder.read("check.json")).unwrap();
    assert!(plan.is_object() && check.is_object());
    let output = folder.run("plan robot.toml --accuracy 0.1mm");
    assert_eq!(output.code, 2);
}
