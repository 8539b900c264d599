//! Robots with linear drives, from their files to the report.

use crate::support::{Folder, TOWERS};
use delta_cal::kinematics::JointLimits;
use delta_cal::simulate::{random_pose, standard_normal};
use delta_cal::{Parameter, Robot};
use delta_cal_host::{InputText, RobotFile};
use delta_cal_tests::generator;
use rand_pcg::Pcg32;
use serde_json::Value;
use std::fmt::Write;

fn file(text: &str) -> RobotFile {
    RobotFile::read(&InputText::new("robot.toml", text)).unwrap()
}

/// Off by one tolerance in every parameter.
fn made(rng: &mut Pcg32) -> Robot<f64> {
    made_to(1.0, rng)
}

/// Off by a multiple of the tolerance in every parameter.
fn made_to(factor: f64, rng: &mut Pcg32) -> Robot<f64> {
    let file = file(TOWERS);
    let sigmas = file.tolerance.unwrap().of_places(&file.robot.arms()[0]);
    let parameters = file.robot.parameters().map(|mut arm| {
        for (value, sigma) in arm.iter_mut().zip(sigmas) {
            *value += factor * sigma * standard_normal::<f64, _>(rng);
        }
        arm
    });
    file.robot.with_parameters(parameters).unwrap()
}

fn samples(truth: &Robot<f64>, rows: usize, rng: &mut Pcg32) -> String {
    let limits = JointLimits::travel(100.0, 600.0).unwrap();
    let mut text = String::from("s1_mm,s2_mm,s3_mm,x_mm,y_mm,z_mm\n");
    for _ in 0..rows {
        let pose = random_pose(truth, &limits, rng).unwrap();
        let [a, b, c] = pose.joints;
        let [x, y, z] = pose.position.data.0[0].map(|x| x + 0.02 * standard_normal::<f64, _>(rng));
        writeln!(text, "{a},{b},{c},{x},{y},{z}").unwrap();
    }
    text
}

#[test]
fn a_calibrated_robot_file_holds_the_towers() {
    let folder = Folder::new();
    folder.write("robot.toml", TOWERS);
    let mut rng = generator(51, 0);
    let truth = made(&mut rng);
    folder.write("samples.csv", samples(&truth, 40, &mut rng));
    for method in ["joint", "fkm", "ikm"] {
        folder
            .run(&format!(
                "calibrate robot.toml samples.csv --method {method} --output new.toml --json new.json --force"
            ))
            .ok();
        let calibrated = file(&folder.read("new.toml"));
        assert_eq!(calibrated.limits, file(TOWERS).limits);
        assert_eq!(calibrated.tolerance, file(TOWERS).tolerance);
        let json: Value = serde_json::from_str(&folder.read("new.json")).unwrap();
        let listed: Vec<(usize, &Value)> = json["arms"]
            .as_array()
            .unwrap()
            .iter()
            .enumerate()
            .flat_map(|(arm, own)| {
                let parameters = own["parameters"].as_array().unwrap();
                parameters.iter().map(move |own| (arm, own))
            })
            .collect();
        assert_eq!(listed.len(), 21);
        for (arm, own) in listed {
            let number = |key: &str| own[key].as_f64().unwrap();
            let symbol = own["symbol"].as_str().unwrap();
            let mut all = Parameter::LINEAR.into_iter();
            let parameter = all.find(|known| known.symbol() == symbol).unwrap();
            let mut expected = truth.arms()[arm].get(parameter);
            if own["unit"] == "deg" {
                expected = expected.to_degrees();
            }
            // Five σ: of 63 parameters none is beyond by chance.
            let off = (number("after") - expected).abs();
            assert!(
                off < 5.0 * number("sigma"),
                "{method} {arm} {symbol}: {off}"
            );
        }
    }
}

#[test]
fn positions_in_the_sensors_frame_need_no_place() {
    let folder = Folder::new();
    folder.write("robot.toml", TOWERS);
    let mut rng = generator(52, 0);
    let truth = made(&mut rng);
    let text = samples(&truth, 40, &mut rng);
    // The sensor's x is the robot's −y, and it stands elsewhere.
    let mut moved = String::new();
    for line in text.lines() {
        let cells: Vec<_> = line.split(',').collect();
        match cells[3].parse::<f64>() {
            Err(_) => writeln!(moved, "{line}").unwrap(),
            Ok(x) => {
                let [y, z] = [4, 5].map(|cell| cells[cell].parse::<f64>().unwrap());
                let joints = cells[..3].join(",");
                writeln!(moved, "{joints},{},{},{}", 300.0 - y, 20.0 + x, z - 5.0).unwrap();
            }
        }
    }
    folder.write("samples.csv", moved);
    let json = folder
        .run("calibrate robot.toml samples.csv --frame sensor --json -")
        .ok()
        .stdout;
    let json: Value = serde_json::from_str(&json).unwrap();
    let expected = json["expected_error"]["intrinsic_rms_mm"].as_f64().unwrap();
    assert!(expected < 0.02, "{expected}");
}

#[test]
fn what_does_not_fit_the_drive_is_refused_with_its_place() {
    let cases = [
        (
            "kind = \"linear\"",
            "kind = \"turning\"",
            "unknown variant `turning`",
        ),
        ("forearm_mm = 330", "", "missing field `forearm_mm`"),
        ("forearm_mm = 330", "forearm_mm = -330", "a number above 0"),
        (
            "tower_radius_mm = 140",
            "tower_radius_mm = 400",
            "do not meet",
        ),
        (
            "tower_radius_mm = 140",
            "tower_radius_mm = 140\nupper_arm_mm = 3",
            "unknown field",
        ),
        ("min_mm = 100", "min_deg = 100", "unknown field"),
        ("max_mm = 600", "max_mm = 50", "is not above the smallest"),
        ("max_mm = 600", "", "missing field `max_mm`"),
        (
            "max_mm = 600",
            "max_mm = 600\nforearm_max_deg = 30",
            "unknown field",
        ),
        ("scale = 0.001", "", "missing field `scale`"),
        ("scale = 0.001", "scale = 0", "a number above 0"),
        ("zero_mm = 5", "zero_mm = -5", "a number above 0"),
        (
            "zero_mm = 5",
            "zero_mm = 5\nradius_mm = -2",
            "common radius must be",
        ),
        ("joint_mm = 0", "joint_deg = 0", "unknown field"),
        ("joint_mm = 0", "", "missing field `joint_mm`"),
    ];
    for (before, after, cause) in cases {
        let text = TOWERS.replace(before, after);
        assert_ne!(text, TOWERS);
        let error = RobotFile::read(&InputText::new("robot.toml", &text)).unwrap_err();
        let error = error.to_string();
        assert!(error.contains(cause), "{after}: {error}");
        assert!(error.starts_with("robot.toml:"), "{error}");
    }
    let rotary = "[nominal]\nbase_radius_mm = 194\nplatform_radius_mm = 30\nupper_arm_mm = 260\n\
                  forearm_mm = 480\ntower_radius_mm = 3\n[joints]\nmin_deg = -60\nmax_deg = 90\n";
    let error = RobotFile::read(&InputText::new("robot.toml", rotary)).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("unknown field `tower_radius_mm`"),
        "{error}"
    );
    let rotary = rotary.replace("tower_radius_mm = 3\n", "");
    let rotary = format!("{rotary}[tolerance]\nlength_mm = 1\nangle_deg = 1\nradius_mm = 2\n");
    let error = RobotFile::read(&InputText::new("robot.toml", &rotary)).unwrap_err();
    let error = error.to_string();
    assert!(error.starts_with("robot.toml:12:"), "{error}");
    assert!(error.contains("radius_mm"), "{error}");
}

#[test]
fn a_common_radius_is_read_and_written() {
    let stated = TOWERS.replace("zero_mm = 5", "zero_mm = 5\nradius_mm = 2.5");
    let read = file(&stated);
    assert!((read.tolerance.unwrap().radius() - 2.5).abs() < 1e-12);
    assert_eq!(
        file(&read.to_toml("")).tolerance.unwrap(),
        read.tolerance.unwrap()
    );
    assert!(!file(TOWERS).to_toml("").contains("radius_mm"));
}

/// End stops that are off as far as the tolerance allows are no other frame.
#[test]
fn what_the_tolerance_allows_is_not_doubtful() {
    let folder = Folder::new();
    let mut parameters = file(TOWERS).robot.parameters();
    for arm in &mut parameters {
        arm[Parameter::Zero.index()] += 20.0;
    }
    let truth = file(TOWERS).robot.with_parameters(parameters).unwrap();
    let doubts = |robot: &str, rng: &mut Pcg32| {
        folder.write("robot.toml", robot);
        folder.write("samples.csv", samples(&truth, 30, rng));
        let run = folder.run("calibrate robot.toml samples.csv");
        assert!(run.stdout.contains("Calibrated"), "{}", run.stderr);
        run.stdout
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ")
            .contains("from where the robot")
    };
    let mut rng = generator(9600, 0);
    let wide = TOWERS.replace("zero_mm = 5", "zero_mm = 10");
    assert!(!doubts(&wide, &mut rng));
    let (before, rest) = TOWERS.split_once("[tolerance]").unwrap();
    let (_, after) = rest.split_once("[noise]").unwrap();
    assert!(doubts(&format!("{before}[noise]{after}"), &mut rng));
}

/// Towers have 21 parameters, and where an end stop stands is no sign of another robot.
#[test]
fn samples_that_decide_widen_a_tolerance_that_is_too_small() {
    let folder = Folder::new();
    folder.write("robot.toml", TOWERS);
    for number in 0..4 {
        let mut rng = generator(9700, number);
        let truth = made_to(2.5, &mut rng);
        folder.write("samples.csv", samples(&truth, 40, &mut rng));
        folder
            .run("calibrate robot.toml samples.csv --json report.json")
            .ok();
        let report: Value = serde_json::from_str(&folder.read("report.json")).unwrap();
        let test = &report["tolerance"];
        assert_eq!(test["widened"], true, "{test}");
        assert_eq!(test["combinations"], 21);
        // χ² with 21 degrees of freedom: four standard deviations are 0.62 of the ratio.
        let ratio = test["ratio"].as_f64().unwrap() / 2.5;
        assert!((ratio - 1.0).abs() < 0.62, "{ratio}");
    }
}

#[test]
fn three_arms_have_one_drive() {
    let tower = |x: f64, y: f64| {
        format!(
            "[[arm]]\ndx_mm = {x}\ndy_mm = {y}\ndz_mm = 0\nlean_x_deg = 0\nlean_y_deg = 0\nscale = 1\n\
             lb_mm = 330\n"
        )
    };
    let joints = "[joints]\nmin_mm = 100\nmax_mm = 600\n";
    let towers = [tower(-121.0, -70.0), tower(121.0, -70.0), tower(0.0, 140.0)].concat();
    let read = file(&format!("{towers}{joints}"));
    let written = [0.0, 140.0, 0.0, 0.0, 0.0, 1.0, 0.0, 330.0].map(f64::to_bits);
    assert_eq!(read.robot.parameters()[2].map(f64::to_bits), written);
    for (from, to, cause) in [
        ("lean_x_deg = 0", "theta_deg = 0", "unknown field"),
        ("lean_x_deg = 0\n", "", "missing field `lean_x_deg`"),
        ("lean_x_deg = 0", "lean_x_deg = 90", "less than 90°"),
        ("scale = 1", "scale = -1", "scale must be above 0"),
    ] {
        let text = format!("{}{joints}", towers.replacen(from, to, 1));
        let error = RobotFile::read(&InputText::new("robot.toml", &text)).unwrap_err();
        assert!(error.to_string().contains(cause), "{to}: {error}");
    }
}

#[test]
fn joint_angles_are_no_travels() {
    let folder = Folder::new();
    folder.write("robot.toml", TOWERS);
    folder.write(
        "angles.csv",
        "q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm\n1,2,3,4,5,6\n",
    );
    let refused = folder.run("calibrate robot.toml angles.csv");
    assert_eq!(refused.code, 3);
    assert!(refused.stderr.contains("s1_mm"), "{}", refused.stderr);
    folder.write(
        "far.csv",
        "s1_mm,s2_mm,s3_mm,x_mm,y_mm,z_mm\n1000,300,300,4,5,6\n",
    );
    let refused = folder.run("calibrate robot.toml far.csv");
    assert!(
        refused.stderr.contains("limits of the travel"),
        "{}",
        refused.stderr
    );
    folder.write("bare.csv", "s1,s2,s3,x_mm,y_mm,z_mm\n300,300,300,4,5,6\n");
    let refused = folder.run("calibrate robot.toml bare.csv");
    assert!(
        refused.stderr.contains("unit is not stated"),
        "{}",
        refused.stderr
    );
}

#[test]
fn what_holds_rotary_robots_alone_refuses_others() {
    let folder = Folder::new();
    folder.write("robot.toml", TOWERS);
    let mut rng = generator(53, 0);
    let truth = made(&mut rng);
    folder.write("samples.csv", samples(&truth, 20, &mut rng));
    let refused = folder.run("device --port emulate:m4 calibrate robot.toml samples.csv");
    assert_ne!(refused.code, 0);
    assert!(
        refused.stderr.contains("linear drives"),
        "{}",
        refused.stderr
    );
    let campaign = "robot = \"robot.toml\"\nrobots = 2\nseed = 1\nposes = [20]\n\
                    start_errors = [{ length_mm = 0.5, angle_deg = 0.17 }]\n\
                    noise_levels = [{ position_mm = 0.02, joint_deg = 0.01 }]\n";
    folder.write("campaign.toml", campaign);
    let refused = folder.run("simulate campaign.toml --output out");
    assert!(refused.stderr.contains("joint_mm"), "{}", refused.stderr);
}

/// Evenly spread points against where the three carriages would have to be: 4 million points tell the volume to
/// 0.05 litres.
#[test]
fn the_workspace_is_where_all_three_carriages_get() {
    let folder = Folder::new();
    folder.write("robot.toml", TOWERS);
    let json = folder.run("workspace robot.toml --json -").ok().stdout;
    let json: Value = serde_json::from_str(&json).unwrap();
    let stated = json["volume"]["litres"].as_f64().unwrap();
    let mut rng = generator(54, 0);
    let mut within = 0_u32;
    let draws = 1_000_000;
    let towers: Vec<(f64, f64)> = [210.0_f64, 330.0, 90.0]
        .iter()
        .map(|azimuth| azimuth.to_radians())
        .map(|azimuth| (140.0 * azimuth.cos(), 140.0 * azimuth.sin()))
        .collect();
    for _ in 0..draws {
        let mut draw = |low: f64, high: f64| {
            low + (high - low) * f64::midpoint(delta_cal_tests::uniform(&mut rng), 1.0)
        };
        let (x, y, z) = (
            draw(-220.0, 220.0),
            draw(-200.0, 240.0),
            draw(-230.0, 400.0),
        );
        let gets = towers.iter().all(|(tower_x, tower_y)| {
            let beside = (x - tower_x).powi(2) + (y - tower_y).powi(2);
            let rise = 330.0 * 330.0 - beside;
            rise > 0.0 && (100.0..600.0).contains(&(z + rise.sqrt()))
        });
        within += u32::from(gets);
    }
    let all = 440.0 * 440.0 * 630.0 * 1e-6;
    let part = f64::from(within) / f64::from(draws);
    let counted = all * part;
    // Five σ of the count.
    let limit = 5.0 * all * (part * (1.0 - part) / f64::from(draws)).sqrt();
    assert!(
        (stated - counted).abs() < limit,
        "{stated} {counted} ± {limit}"
    );
}

/// All end stops 8 mm lower than stated, with a tolerance of 5 mm: nothing is mounted on the platform.
#[test]
fn end_stops_within_their_tolerance_are_no_reflector() {
    let folder = Folder::new();
    folder.write("robot.toml", TOWERS);
    let nominal = file(TOWERS).robot;
    let parameters = nominal.parameters().map(|mut arm| {
        arm[Parameter::Zero.index()] -= 8.0;
        arm
    });
    let truth = nominal.with_parameters(parameters).unwrap();
    folder.write("samples.csv", samples(&truth, 20, &mut generator(9310, 0)));
    let run = folder.run("calibrate robot.toml samples.csv").ok();
    assert!(!run.stdout.contains("[target]"), "{}", run.stdout);
    assert!(!run.stderr.contains("[target]"), "{}", run.stderr);
}
