//! Robots whose joint zeros are wrong by degrees while their lengths are as drawn: what is said where nobody stated that, and
//! what is found where somebody did.

use delta_cal::Robot;
use delta_cal::robot::Arm;
use delta_cal::simulate::standard_normal;
use delta_cal_host::{InputText, Options, Readings, RobotFile, calibrate};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::fmt::Write;

const SIGMA: f64 = 0.02;

/// Base less platform radius, upper arm, forearm, and the joints' range in degrees.
const GEOMETRIES: [[f64; 5]; 3] = [
    [164.0, 260.0, 480.0, -40.0, 60.0],
    [-50.0, 250.0, 520.0, -40.0, 60.0],
    [20.0, 70.0, 160.0, -30.0, 60.0],
];

fn robot_file([radius, upper, forearm, low, high]: [f64; 5], tolerance: &str) -> RobotFile {
    let text = format!(
        "[nominal]\nbase_radius_mm = {}\nplatform_radius_mm = 100\nupper_arm_mm = {upper}\nforearm_mm = {forearm}\n\
         [joints]\nmin_deg = {low}\nmax_deg = {high}\n[tolerance]\nlength_mm = 0.3\nangle_deg = 0.1\n{tolerance}\
         [noise]\nposition_mm = {SIGMA}\nheight_mm = {SIGMA}\njoint_deg = 0.001\n",
        radius + 100.0
    );
    RobotFile::read(&InputText::new("robot.toml", &text)).unwrap()
}

/// The robot with its arms turned up by these degrees where the joints read 0, and its lengths as made.
fn made([radius, upper, forearm, ..]: [f64; 5], zeros: [f64; 3], rng: &mut Pcg32) -> Robot<f64> {
    let mut near = |value: f64, sigma: f64| value + sigma * standard_normal::<f64, _>(rng);
    let arms = [0, 1, 2].map(|index: u8| {
        let azimuth = 120.0 * f64::from(index);
        let (sine, cosine) = azimuth.to_radians().sin_cos();
        let (up, along) = near(zeros[usize::from(index)], 0.0).to_radians().sin_cos();
        let upper = near(upper, 0.3);
        Arm::new([
            near(radius * cosine, 0.3),
            near(radius * sine, 0.3),
            near(0.0, 0.3),
            near(azimuth, 0.1).to_radians(),
            near(0.0, 0.1).to_radians(),
            upper * along,
            upper * up,
            near(forearm, 0.3),
        ])
        .unwrap()
    });
    Robot::new(arms).unwrap()
}

/// Positions, or heights above a plate at −z where the robot's file has its middle.
fn readings(
    file: &RobotFile,
    truth: &Robot<f64>,
    rows: usize,
    heights: bool,
    rng: &mut Pcg32,
) -> Readings {
    let mut text = if heights {
        "q1_rad,q2_rad,q3_rad,height_mm\n".to_owned()
    } else {
        "q1_rad,q2_rad,q3_rad,x_mm,y_mm,z_mm\n".to_owned()
    };
    let (low, high) = (file.limits.minimum(), file.limits.maximum());
    let middle = file.robot.forward(&[f64::midpoint(low, high); 3]).unwrap();
    let mut found = 0;
    while found < rows {
        let uniform = |rng: &mut Pcg32| f64::from(rng.next_u32()) / f64::from(u32::MAX);
        let q = if heights {
            // Where the file's robot touches a plate.
            let span = 0.6 * file.robot.arm(delta_cal::ArmIndex::First).lb();
            let at =
                middle + nalgebra::Vector3::new(uniform(rng) - 0.5, uniform(rng) - 0.5, 0.0) * span;
            let Ok(q) = file.robot.inverse(&at) else {
                continue;
            };
            q
        } else {
            [0; 3].map(|_| low + (high - low) * uniform(rng))
        };
        if q.iter().any(|q| *q < low || *q > high)
            || file.reach().clear_position(&file.robot, &q).is_err()
        {
            continue;
        }
        let Ok(x) = truth.forward(&q) else { continue };
        let mut near = |value: f64| value + SIGMA * standard_normal::<f64, _>(rng);
        let _ = if heights {
            writeln!(text, "{},{},{},{}", q[0], q[1], q[2], near(x.z - middle.z))
        } else {
            writeln!(
                text,
                "{},{},{},{},{},{}",
                q[0],
                q[1],
                q[2],
                near(x.x),
                near(x.y),
                near(x.z)
            )
        };
        found += 1;
    }
    Readings::read(&InputText::new("samples.csv", &text), file).unwrap()
}

/// The number behind a word.
fn number(text: &str, before: &str) -> f64 {
    let (_, rest) = text
        .split_once(before)
        .unwrap_or_else(|| panic!("{before}: {text}"));
    rest.chars()
        .take_while(|c| "+-.0123456789".contains(*c))
        .collect::<String>()
        .parse()
        .unwrap()
}

#[test]
fn joint_zeros_that_nobody_stated_are_named_with_their_size() {
    for (index, geometry) in GEOMETRIES.into_iter().enumerate() {
        let mut rng = Pcg32::seed_from_u64(40 + index as u64);
        let zeros = [-10.0, -9.4, -6.3];
        let file = robot_file(geometry, "");
        let truth = made(geometry, zeros, &mut rng);
        let positions = readings(&file, &truth, 20, false, &mut rng);
        let error = calibrate(&file, &positions, &Options::default()).unwrap_err();
        let remedy = error.remedy().unwrap_or_default();
        for (arm, zero) in (1..).zip(zeros) {
            let found = number(&remedy, &format!("arm {arm} "));
            assert!(
                (found - zero).abs() < 0.5,
                "{index}: {found} {zero}: {remedy}"
            );
        }
        assert!(
            remedy.contains("lower") && remedy.contains("zero_deg"),
            "{remedy}"
        );

        // Stated, they are found.
        let file = robot_file(geometry, "zero_deg = 6\n");
        let report = calibrate(&file, &positions, &Options::default()).unwrap();
        for (arm, zero) in report.after.robot.arms().iter().zip(zeros) {
            let [.., x, y, _] = arm.parameters();
            let found = y.atan2(x).to_degrees();
            assert!((found - zero).abs() < 0.2, "{index}: {found} {zero}");
        }
    }
}

/// Eight touches of one plate show one number, the bowl: which it is they cannot tell, and no row is to blame.
#[test]
fn a_bowl_of_eight_touches_is_blamed_on_no_row() {
    let mut named = 0;
    for (seed, geometry) in (0..6).zip(GEOMETRIES.into_iter().cycle()) {
        let mut rng = Pcg32::seed_from_u64(70 + seed);
        let file = robot_file(geometry, "");
        let truth = made(geometry, [-8.0; 3], &mut rng);
        let touches = readings(&file, &truth, 8, true, &mut rng);
        let Err(error) = calibrate(&file, &touches, &Options::default()) else {
            continue;
        };
        let all = format!("{error} {}", error.remedy().unwrap_or_default());
        assert!(
            !all.contains("disagrees with all others") && !all.contains("does not."),
            "{all}"
        );
        named += u32::from(all.contains("joint zero"));
    }
    assert!(named >= 4, "{named} of 6");
}
