//! One simulated robot calibrated one way, and what came of it.

use super::plan::{CampaignMethod, Plan, Scenario, Variant};
use super::planned::EXACT;
use super::readings::Readings;
use super::simulation::{Read, SimulatedRobot};
use super::status::Status;
use crate::accuracy::evaluation::{CramerRaoBound, Evaluation, HeldOutError};
use crate::accuracy::information::units;
use crate::files::robot_file::{InstrumentFacts, RobotFile};
use crate::fit::fkm;
use crate::fit::observations::{self, ObservedError};
use crate::fit::options::CalibrationMethod;
use crate::planning::covariance_after;
use delta_cal::calibration::{ArmOutcome, JointCalibrator, StartUsed};
use delta_cal::{
    Calibrator, Noise, Parameter, Real, Refusal, Robot, RobotOutcome, Sample, Settings, Tolerance,
};
use std::time::{Duration, Instant};

/// What a calibration returned, and how long it took.
#[derive(Debug)]
pub(super) struct Trial {
    pub(super) status: Status,
    pub(super) calibrated: Option<Calibrated>,
    pub(super) time: Duration,
}

/// The result of a calibration that was not refused.
#[derive(Debug)]
pub(super) struct Calibrated {
    pub(super) robot: Robot<f64>,
    /// Of the arm that took the most.
    pub(super) iterations: u16,
    /// Of the worst arm.
    pub(super) condition: f64,
    /// Whether every arm's iteration began at the nominal robot, and no other start was needed.
    pub(super) from_nominal: bool,
}

/// What is stated of a calibrated robot whose true parameters are known.
#[derive(Debug)]
pub(super) struct AchievedAccuracy {
    pub(super) gain: f64,
    pub(super) position_error: HeldOutError,
    pub(super) parameter_error: f64,
    /// Of each arm's parameters in turn, percent.
    pub(super) parameter_gains: [f64; 24],
}

pub(super) fn calibrate(plan: &Plan, scenario: &Scenario, variant: Variant, read: &Read) -> Trial {
    let begin = Instant::now();
    let result = match read {
        Read::Readings(readings) => of_readings(plan, scenario, variant, readings),
        Read::Positions(samples, _) => of_positions(plan, scenario, variant, samples),
    };
    let time = begin.elapsed();
    match result {
        Ok(calibrated) => Trial {
            status: Status::ACCEPTED,
            calibrated: Some(calibrated),
            time,
        },
        Err(status) => Trial {
            status,
            calibrated: None,
            time,
        },
    }
}

/// The robot as the calibration of an instrument's readings knows it.
fn known(plan: &Plan, scenario: &Scenario, variant: Variant) -> RobotFile {
    let sigma = scenario.noise.map_or(EXACT, |noise| noise.position());
    let joint = scenario.noise.map_or(0.0, |noise| noise.joint());
    let mut robot = RobotFile {
        noise: Noise::new(sigma, joint).ok(),
        tolerance: scenario.tolerance.filter(|_| variant.prior),
        ..plan.robot.clone()
    };
    robot.instruments = InstrumentFacts {
        height_noise: Some(sigma),
        distance_noise: Some(sigma),
        joint_noise: Some(joint),
        ..InstrumentFacts::default()
    };
    robot
}

fn of_readings(
    plan: &Plan,
    scenario: &Scenario,
    variant: Variant,
    readings: &Readings,
) -> Result<Calibrated, Status> {
    let robot = known(plan, scenario, variant);
    let solver = variant.solver.calibration_solver();
    let fit = observations::calibrate(&robot, &readings.file, readings.frame, solver);
    let fit = fit.map_err(|error| match error {
        ObservedError::Refused(refusal) => Status::of(&refusal),
        ObservedError::Row(..) | ObservedError::TooManyInstruments | ObservedError::Robust(_) => {
            Status::FAULTY_SAMPLE
        }
    })?;
    Ok(calibrated(&fit.outcome.fit, &fit.outcome.fit.robot))
}

fn of_positions(
    plan: &Plan,
    scenario: &Scenario,
    variant: Variant,
    samples: &[Sample<f64>],
) -> Result<Calibrated, Status> {
    let settings = Settings::default()
        .with_noise(scenario.noise.filter(|_| variant.weights))
        .with_tolerance(scenario.tolerance.filter(|_| variant.prior))
        .with_solver(variant.solver.calibration_solver())
        .with_start(variant.method.start());
    let nominal = &plan.robot.robot;
    match variant.method {
        CampaignMethod::Joint
        | CampaignMethod::JointNoGuess
        | CampaignMethod::Ikm
        | CampaignMethod::IkmNoGuess => solve(variant.method, nominal, samples, &settings)
            .map(|outcome| calibrated(&outcome, &outcome.robot)),
        CampaignMethod::JointSingle | CampaignMethod::IkmSingle => {
            single(plan, scenario, variant, samples)
        }
        CampaignMethod::Fkm | CampaignMethod::FkmNoGuess => {
            fkm::calibrate(nominal, samples, &settings)
                .map(|outcome| calibrated(&outcome.fit, &outcome.fit.robot))
                .map_err(|refusal| Status::of(&refusal))
        }
    }
}

/// Evaluates a calibrated robot against the true one.
pub(super) fn achieved(
    plan: &Plan,
    robot: &SimulatedRobot,
    after: &Robot<f64>,
) -> AchievedAccuracy {
    let evaluation = Evaluation {
        truth: &robot.truth,
        before: &plan.robot.robot,
        after,
    };
    let gains = evaluation.parameter_gains();
    AchievedAccuracy {
        gain: evaluation.gain(),
        position_error: evaluation.position_error_after(&robot.held_out),
        parameter_error: evaluation.error_after(),
        parameter_gains: std::array::from_fn(|index| gains[index / 8][index % 8]),
    }
}

/// Over the held-out points with the nominal parameters.
pub(super) fn error_before(plan: &Plan, robot: &SimulatedRobot) -> HeldOutError {
    let nominal = &plan.robot.robot;
    let evaluation = Evaluation {
        truth: &robot.truth,
        before: nominal,
        after: nominal,
    };
    evaluation.position_error_before(&robot.held_out)
}

/// The least rms of the parameter error that the method can have, mm.
pub(super) fn bound(
    plan: &Plan,
    scenario: &Scenario,
    robot: &SimulatedRobot,
    variant: Variant,
) -> Option<f64> {
    match &robot.read {
        Read::Positions(_, joints) => {
            let method = variant.method.calibration_method();
            let tolerance = scenario.tolerance.as_ref().filter(|_| variant.prior);
            let noise = scenario.noise.as_ref()?;
            CramerRaoBound::new(method, &robot.truth, joints, noise, tolerance)
                .map(|bound| bound.error())
        }
        Read::Readings(readings) => {
            let known = RobotFile {
                robot: robot.truth,
                ..known(plan, scenario, variant)
            };
            known.tolerance?;
            let covariance = covariance_after(&known, &readings.exact, readings.frame)?;
            let units = units(&robot.truth);
            let variance: f64 = (0..24)
                .map(|index| covariance[(index, index)] * units[index].powi(2))
                .sum();
            Some(variance.sqrt())
        }
    }
}

/// Everything rounded to single precision first, as a controller would have it.
fn single(
    plan: &Plan,
    scenario: &Scenario,
    variant: Variant,
    samples: &[Sample<f64>],
) -> Result<Calibrated, Status> {
    let nominal = plan.robot.robot.cast::<f32>();
    let samples: Vec<_> = samples
        .iter()
        .map(|sample| Sample {
            joints: sample.joints.map(f32::from_f64),
            position: sample.position.map(f32::from_f64),
        })
        .collect();
    let noise = scenario
        .noise
        .filter(|_| variant.weights)
        .and_then(|noise| {
            Noise::by_axis(
                noise.position_by_axis().map(f32::from_f64),
                f32::from_f64(noise.joint()),
            )
            .ok()
        });
    let tolerance = scenario.tolerance.filter(|_| variant.prior).and_then(|of| {
        let [length, angle] =
            [Parameter::Lb, Parameter::Theta].map(|parameter| f32::from_f64(of.of(parameter)));
        Tolerance::new(length, angle)
            .and_then(|own| own.with_radius(f32::from_f64(of.radius())))
            .ok()
    });
    let settings = Settings::default()
        .with_noise(noise)
        .with_tolerance(tolerance)
        .with_solver(variant.solver.calibration_solver());
    let nominal = nominal.map_err(|error| Status::of(&Refusal::ImpossibleRobot(error)))?;
    let outcome = solve(variant.method, &nominal, &samples, &settings)?;
    let robot = outcome.robot.cast::<f64>();
    let robot = robot.map_err(|error| Status::of(&Refusal::ImpossibleRobot(error)))?;
    Ok(calibrated(&outcome, &robot))
}

fn solve<T: Real>(
    method: CampaignMethod,
    nominal: &Robot<T>,
    samples: &[Sample<T>],
    settings: &Settings<T>,
) -> Result<RobotOutcome<T>, Status> {
    if method.calibration_method() == CalibrationMethod::Joint {
        let mut calibrator = JointCalibrator::new(nominal, settings);
        calibrator
            .add_many(samples)
            .map_err(|_| Status::FAULTY_SAMPLE)?;
        let outcome = calibrator.solve().map_err(|refusal| Status::of(&refusal))?;
        return Ok(RobotOutcome::from(&outcome));
    }
    let mut calibrator = Calibrator::new(nominal, settings);
    calibrator
        .add_many(samples)
        .map_err(|_| Status::FAULTY_SAMPLE)?;
    calibrator.solve().map_err(|refusal| Status::of(&refusal))
}

fn calibrated<T: Real>(outcome: &RobotOutcome<T>, robot: &Robot<f64>) -> Calibrated {
    let iterations = |arm: &ArmOutcome<T>| arm.iterations;
    let condition = |arm: &ArmOutcome<T>| arm.condition.to_f64();
    Calibrated {
        robot: *robot,
        iterations: outcome.arms.iter().map(iterations).max().unwrap_or(0),
        condition: outcome.arms.iter().map(condition).fold(0.0, f64::max),
        from_nominal: outcome
            .arms
            .iter()
            .all(|arm| arm.start == StartUsed::Nominal),
    }
}
