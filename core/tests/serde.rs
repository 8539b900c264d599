//! What is written reads back the same, and what no constructor would take is refused.

#![cfg(feature = "serde")]
#![allow(clippy::unwrap_used)]

use delta_cal::calibration::{Solver, Start};
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Arm;
#[cfg(feature = "transmission")]
use delta_cal::robot::Transmission;
use delta_cal::stream::Forgetting;
use delta_cal::{
    IkmCalibrator, Noise, Refusal, Robot, RobotOutcome, Sample, Settings, SymmetricRobot, Tolerance,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Debug;

const DRAWN: SymmetricRobot<f64> = SymmetricRobot {
    base_radius: 194.0,
    platform_radius: 30.0,
    upper_arm: 260.0,
    forearm: 480.0,
};

/// As text and as bytes.
fn round_trip<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
    let text = serde_json::to_string(value).unwrap();
    assert_eq!(&serde_json::from_str::<T>(&text).unwrap(), value, "{text}");
    let mut buffer = [0; 4096];
    let bytes = postcard::to_slice(value, &mut buffer).unwrap();
    assert_eq!(&postcard::from_bytes::<T>(bytes).unwrap(), value);
}

fn sample(robot: &Robot<f64>, k: u32) -> Sample<f64> {
    let t = f64::from(k);
    let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
    let position = robot.forward(&joints).unwrap();
    Sample { joints, position }
}

fn settings() -> Settings<f64> {
    Settings::default()
        .with_noise(Noise::new(0.02, 1e-5).unwrap())
        .with_tolerance(Tolerance::new(0.5, 0.003).unwrap())
        .with_solver(Solver::GaussNewton)
        .with_start(Start::Free)
        .with_iteration_limit(7)
}

fn outcome() -> RobotOutcome<f64> {
    let truth = SymmetricRobot {
        upper_arm: 260.7,
        ..DRAWN
    }
    .robot()
    .unwrap();
    let mut calibrator = IkmCalibrator::new(&DRAWN.robot().unwrap(), &Settings::default());
    for k in 0..20 {
        calibrator.add(&sample(&truth, k)).unwrap();
    }
    calibrator.calibrate().unwrap()
}

#[test]
fn robots_samples_settings_and_outcomes_read_back_the_same() {
    let robot = DRAWN.robot_from_azimuth(0.1).unwrap();
    round_trip(&DRAWN);
    round_trip(&robot);
    round_trip(robot.arm(delta_cal::ArmIndex::Second));
    round_trip(&DRAWN.robot().unwrap().cast::<f32>().unwrap());
    round_trip(&sample(&robot, 3));
    round_trip(&settings());
    round_trip(&Settings::<f32>::default());
    round_trip(&JointLimits::new(-1.0, 1.5).unwrap());
    let tolerance = Tolerance::new(0.5, 0.003).unwrap();
    round_trip(&tolerance.with_joint_zero(0.1).unwrap());
    #[cfg(feature = "linear")]
    {
        // As far as a tower is high, which as an angle would be too wide.
        round_trip(&JointLimits::travel(-350.0, 20.0).unwrap());
        let towers = tolerance.with_linear(1.0, 2e-4).unwrap();
        round_trip(&towers.with_radius(0.7).unwrap().with_forearm(0.9).unwrap());
    }
    round_trip(&Forgetting::new(49.0).unwrap());
    let outcome = outcome();
    assert!(outcome.arms[0].covariance.is_some());
    round_trip(&outcome);
    round_trip(&Refusal::WrongSide);
}

/// The table that a data sheet would give.
#[test]
fn a_robot_is_written_as_its_parameters() {
    let robot = DRAWN.robot().unwrap().cast::<f32>().unwrap();
    let text = serde_json::to_string(&robot.arms()[0]).unwrap();
    assert_eq!(text, "[164.0,0.0,0.0,0.0,0.0,260.0,0.0,480.0]");
    let arms: [[f32; 8]; 3] =
        serde_json::from_str(&serde_json::to_string(&robot).unwrap()).unwrap();
    assert_eq!(arms, robot.parameters());
}

/// Eight numbers an arm would lose what makes it another one.
#[cfg(feature = "transmission")]
#[test]
fn a_robot_with_transmissions_is_not_written() {
    let own = Transmission::new([1e-3, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let robot: Robot<f64> = DRAWN.robot().unwrap();
    let robot = robot.with_transmissions([Transmission::EXACT, own, Transmission::EXACT]);
    let error = serde_json::to_string(&robot.unwrap()).unwrap_err();
    assert!(error.to_string().contains("transmissions"), "{error}");
}

fn refused<T: DeserializeOwned + Debug>(text: &str, cause: &str) {
    let error = serde_json::from_str::<T>(text).unwrap_err().to_string();
    assert!(error.contains(cause), "{error}");
}

#[test]
fn what_no_constructor_takes_is_refused_with_its_cause() {
    let arm = |lb: &str| format!("[164.0,0.0,0.0,0.0,0.0,260.0,0.0,{lb}]");
    refused::<Arm<f64>>(&arm("-480.0"), "Lb must be greater than 0");
    refused::<Arm<f64>>(&arm("null"), "null");
    // Three arms of which each is valid, and whose up directions cancel.
    let tilted = |theta: f64| format!("[164.0,0.0,0.0,{theta},1.57,260.0,0.0,480.0]");
    let third = core::f64::consts::TAU / 3.0;
    let robot = [0.0, third, 2.0 * third].map(tilted).join(",");
    refused::<Robot<f64>>(&format!("[{robot}]"), "up directions cancel");
    refused::<Robot<f64>>(&format!("[{},{}]", arm("480.0"), arm("480.0")), "length");
    // Its square is beyond the range of single precision.
    refused::<Robot<f32>>(&format!("[{}]", vec![arm("1e30"); 3].join(",")), "Lb");
    refused::<Noise<f64>>(
        r#"{"position":[0.0,0.1,0.1],"joint":0.0}"#,
        "position noise",
    );
    refused::<Tolerance<f64>>(r#"{"length":0.5,"angle":-1.0}"#, "angles");
    refused::<Tolerance<f64>>(r#"{"length":0.5,"angle":0.1,"joint_zero":0.0}"#, "joints");
    refused::<JointLimits<f64>>(r#"{"minimum":1.0,"maximum":-1.0}"#, "below the largest");
    refused::<Forgetting<f32>>("1e6", "too large");
    refused::<Settings<f64>>(
        r#"{"noise":{"position":[0.1,-1.0,0.1],"joint":0.0}}"#,
        "position noise",
    );
    refused::<Settings<f64>>(r#"{"tolerence":null}"#, "tolerence");
}

/// What a later version adds to the settings is not in the files of today.
#[test]
fn settings_that_are_left_out_are_the_default() {
    let read: Settings<f64> = serde_json::from_str(r#"{"iteration_limit":7}"#).unwrap();
    assert_eq!(read, Settings::default().with_iteration_limit(7));
}
