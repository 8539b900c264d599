//! Robots whose joint zeros are known only to degrees although their lengths are as drawn: `[tolerance] zero_deg`, and
//! the message if it is not stated.

use crate::support::simulated::{Instrument, file_of, readings};
use crate::support::{Arm, Folder, NOISE, NOMINAL, arms_of, csv, noisy, true_arms};
use delta_cal::Robot;
use delta_cal::robot::Arm as RobotArm;
use delta_cal::simulate::made_robot;
use delta_cal_host::{Options, calibrate};
use delta_cal_tests::generator;
use delta_cal_tests::geometries::geometries;

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
    let mut made: [Arm; 3] = true_arms();
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
    let plan = folder.run("plan robot.toml --count 12").ok();
    assert!(plan.stdout.contains("joint zeros 8°"), "{}", plan.stdout);
    let strict = folder.run("calibrate strict.toml samples.csv");
    assert!(strict.stderr.contains("joint zero"), "{}", strict.stderr);
}

#[test]
fn joint_zeros_that_nobody_stated_are_named_with_their_size() {
    let zeros = [-10.0, -9.4, -6.3];
    // The paper's robot, one with a platform larger than the base, and a tiny one.
    for index in [0, 3, 5] {
        let (name, nominal) = geometries().swap_remove(index);
        let mut file = file_of(&nominal, [-40.0, 60.0].map(f64::to_radians), true);
        let mut rng = generator(40, index as u64);
        let made = made_robot(&nominal, &file.tolerance.unwrap(), &mut rng).unwrap();
        let mut arms = *made.arms();
        for (arm, by) in arms.iter_mut().zip(zeros) {
            let mut parameters = arm.parameters();
            [parameters[5], parameters[6]] = turned([parameters[5], 0.0], by);
            *arm = RobotArm::new(parameters).unwrap();
        }
        let truth = Robot::new(arms).unwrap();
        let positions = readings(&file, &truth, Instrument::Positions, 20, &mut rng);
        let error = calibrate(&file, &positions, &Options::default()).unwrap_err();
        let remedy = error.remedy().unwrap_or_default();
        for (arm, zero) in (1..).zip(zeros) {
            let (_, found) = remedy.split_once(&format!("arm {arm} ")).unwrap();
            let (found, _) = found.split_once('°').unwrap();
            let found: f64 = found.parse().unwrap();
            let off = (found - zero).abs();
            assert!(off < 0.5, "{name}: {off}: {remedy}");
        }
        for word in ["lower", "zero_deg"] {
            assert!(remedy.contains(word), "{remedy}");
        }

        // If stated, they are found.
        let stated = file.tolerance.unwrap().with_joint_zero(6_f64.to_radians());
        file.tolerance = Some(stated.unwrap());
        let report = calibrate(&file, &positions, &Options::default()).unwrap();
        for (arm, expected) in report.after.robot.arms().iter().zip(zeros) {
            let [.., la_x, la_y, _] = arm.parameters();
            let found = zero(la_x, la_y);
            assert!((found - expected).abs() < 0.2, "{name}: {found} {expected}");
        }
    }
}
