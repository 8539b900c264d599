//! What the fixture in C leaves out, against the core: the same calls give the same bits.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(unsafe_code)] // in the place of C

mod errors;
mod observations;
mod place;

use delta_cal::calibration::{JointCalibrator, Solver, Start};
use delta_cal::robot::Transmission;
use delta_cal::{ArmIndex, Calibrator, Parameter, Robot, RobotOutcome, RobotSolver};
use delta_cal_c::double::sample::{Sample, Settings};
use delta_cal_c::double::{calibrator::*, joint::*, outcome::*, robot::*};
use delta_cal_c::error::Error;
use delta_cal_c::status;
use delta_cal_target_tests::{noise, nominal, samples};
use place::{Place, input, no_error, output};

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_bits()).collect()
}

fn in_c(sample: &delta_cal::Sample<f64>) -> Sample {
    Sample {
        joints: sample.joints,
        position: sample.position.into(),
    }
}

/// The nominal robot, from its 24 parameters.
fn nominal_place() -> Place<Robot<f64>> {
    let mut robot = Place::new();
    let parameters = nominal::<f64>().parameters();
    let made = robot_from_parameters(
        robot.new_object(),
        robot.size(),
        input(&parameters),
        no_error(),
    );
    assert_eq!(made, status::OK);
    robot
}

fn noise_alone() -> Settings {
    let noise = noise::<f64>();
    Settings {
        position_noise: noise.position_by_axis(),
        joint_noise: noise.joint(),
        ..Settings::default()
    }
}

#[test]
fn a_robot_of_24_parameters_is_the_cores() {
    let mut robot = nominal_place();
    let mut parameters = [[0.0; 8]; 3];
    let found = robot_parameters(robot.held(), output(&mut parameters));
    assert_eq!(found, status::OK);
    assert_eq!(parameters, nominal::<f64>().parameters());

    let mut tilted = parameters;
    tilted[1][4] = 1.6;
    let mut error = Error::from(status::OK);
    let made = robot_from_parameters(
        robot.new_object(),
        robot.size(),
        input(&tilted),
        output(&mut error),
    );
    assert_eq!((made, error.parameter), (status::GEOMETRY_TILT, 4));
    // The robot that was there is as it was.
    let mut now = [[0.0; 8]; 3];
    assert_eq!(robot_parameters(robot.held(), output(&mut now)), status::OK);
    assert_eq!(now, parameters);
}

#[test]
fn a_robot_with_transmissions_is_the_cores() {
    let mut robot = nominal_place();
    let numbers = [
        [1e-3, 5e-4, -2e-4, 1e-4, 3e-4],
        [0.0; 5],
        [-8e-4, 0.0, 6e-4, 0.0, -1e-4],
    ];
    let set = robot_set_transmissions(robot.held_mut(), input(&numbers), no_error());
    assert_eq!(set, status::OK);
    let transmissions = numbers.map(|own| Transmission::new(own).unwrap());
    let expected = nominal::<f64>().with_transmissions(transmissions).unwrap();

    let joints = [0.3, -0.2, 0.5];
    let (mut position, mut back, mut found) = ([0.0; 3], [0.0; 3], [[0.0; 5]; 3]);
    let moved = robot_forward(
        robot.held(),
        input(&joints),
        output(&mut position),
        no_error(),
    );
    assert_eq!(moved, status::OK);
    let there = expected.forward(&joints).unwrap();
    assert_eq!(bits(&position), bits(there.as_slice()));
    let moved = robot_inverse(
        robot.held(),
        input(&position),
        output(&mut back),
        no_error(),
    );
    assert_eq!(moved, status::OK);
    assert_eq!(bits(&back), bits(&expected.inverse(&there).unwrap()));

    let mut far = numbers;
    far[2][0] = 0.2;
    let refused = robot_set_transmissions(robot.held_mut(), input(&far), no_error());
    assert_eq!(refused, status::GEOMETRY_TRANSMISSION);
    let read = robot_transmissions(robot.held(), output(&mut found));
    assert_eq!((read, found), (status::OK, numbers));
}

fn filled(settings: &Settings, samples: &[delta_cal::Sample<f64>]) -> Place<Calibrator<f64>> {
    let (mut robot, mut calibrator) = (nominal_place(), Place::new());
    let (new, size) = (calibrator.new_object(), calibrator.size());
    let made = calibrator_init(new, size, robot.held(), input(settings), no_error());
    assert_eq!(made, status::OK);
    for sample in samples {
        let taken = calibrator_add(calibrator.held_mut(), input(&in_c(sample)), no_error());
        assert_eq!(taken, status::OK);
    }
    calibrator
}

/// The outcome, or the error.
fn solved(calibrator: &mut Place<Calibrator<f64>>) -> Result<Place<RobotOutcome<f64>>, Error> {
    let mut error = Error::from(status::OK);
    let mut solver = Place::<RobotSolver<f64>>::new();
    let (new, size) = (solver.new_object(), solver.size());
    let mut found = solver_init(new, size, calibrator.held_mut(), output(&mut error));
    if found == status::OK {
        found = status::WORKING;
        while found == status::WORKING {
            found = solver_step(solver.held_mut(), calibrator.held(), output(&mut error));
        }
    }
    if found != status::OK {
        assert_eq!(found, error.status);
        return Err(error);
    }
    let mut outcome = Place::new();
    let (new, size) = (outcome.new_object(), outcome.size());
    assert_eq!(
        solver_outcome(solver.held(), new, size, no_error()),
        status::OK
    );
    Ok(outcome)
}

fn deviations(outcome: &mut Place<RobotOutcome<f64>>) -> Vec<u64> {
    let mut sigma = [[0.0; 8]; 3];
    let found = outcome_deviations(outcome.held(), output(&mut sigma));
    assert_eq!(found, status::OK);
    bits(sigma.as_flattened())
}

#[test]
fn merging_and_forgetting_are_the_cores() {
    let all = samples::<f64>();
    let (left, right) = all.split_at(17);
    let core = || Calibrator::new(&nominal(), &delta_cal::Settings::new().with_noise(noise()));
    let (mut one, mut other) = (core(), core());
    for sample in left {
        one.add(sample).unwrap();
    }
    for sample in right {
        other.add(sample).unwrap();
    }
    one.merge(&other).unwrap();
    one.forget(0.75);
    let expected = one.solve().unwrap();
    let expected: Vec<f64> = expected
        .arms
        .iter()
        .flat_map(|arm| Parameter::ROTARY.map(|of| arm.standard_deviation(of).unwrap()))
        .collect();

    let mut calibrator = filled(&noise_alone(), left);
    let mut other = filled(&noise_alone(), right);
    let found = calibrator_merge(calibrator.held_mut(), other.held());
    assert_eq!(found, status::OK);
    assert_eq!(
        calibrator_forget(calibrator.held_mut(), 1.5),
        status::FORGETTING
    );
    assert_eq!(
        calibrator_forget(calibrator.held_mut(), f64::NAN),
        status::FORGETTING
    );
    assert_eq!(calibrator_forget(calibrator.held_mut(), 0.75), status::OK);
    let mut outcome = solved(&mut calibrator).unwrap();
    assert_eq!(deviations(&mut outcome), bits(&expected));

    // Of another noise.
    let mut stranger = filled(&Settings::default(), right);
    let found = calibrator_merge(calibrator.held_mut(), stranger.held());
    assert_eq!(found, status::DIFFERENT_NOMINAL);
}

#[test]
fn merging_and_forgetting_of_the_joint_calibrator_are_the_cores() {
    let all = samples::<f64>();
    let (left, right) = all.split_at(17);
    let core = |samples: &[delta_cal::Sample<f64>]| {
        let settings = delta_cal::Settings::new().with_noise(noise());
        let mut calibrator = JointCalibrator::new(&nominal(), &settings);
        for sample in samples {
            calibrator.add(sample).unwrap();
        }
        calibrator
    };
    let mut expected = core(left);
    expected.merge(&core(right)).unwrap();
    expected.forget(0.75);
    let samples_seen = expected.samples();
    let expected = expected.solve().unwrap();
    let expected: Vec<f64> = ArmIndex::ALL
        .iter()
        .flat_map(|arm| Parameter::ROTARY.map(|of| expected.standard_deviation(*arm, of).unwrap()))
        .collect();

    let filled = |samples: &[delta_cal::Sample<f64>]| {
        let (mut robot, mut calibrator) = (nominal_place(), Place::<JointCalibrator<f64>>::new());
        let (new, size) = (calibrator.new_object(), calibrator.size());
        let settings = noise_alone();
        let made = joint_calibrator_init(new, size, robot.held(), input(&settings), no_error());
        assert_eq!(made, status::OK);
        for sample in samples {
            let sample = in_c(sample);
            let taken = joint_calibrator_add(calibrator.held_mut(), input(&sample), no_error());
            assert_eq!(taken, status::OK);
        }
        calibrator
    };
    let (mut calibrator, mut other) = (filled(left), filled(right));
    let found = joint_calibrator_merge(calibrator.held_mut(), other.held());
    assert_eq!(found, status::OK);
    assert_eq!(
        joint_calibrator_forget(calibrator.held_mut(), -0.1),
        status::FORGETTING
    );
    assert_eq!(
        joint_calibrator_forget(calibrator.held_mut(), 0.75),
        status::OK
    );
    let mut count = 0_u64;
    let found = joint_calibrator_samples(calibrator.held(), output(&mut count));
    assert_eq!((found, count), (status::OK, samples_seen));
    assert_eq!(joint_calibrator_flush(calibrator.held_mut()), status::OK);

    let mut solver = Place::new();
    let (new, size) = (solver.new_object(), solver.size());
    let begun = joint_solver_init(new, size, calibrator.held_mut(), no_error());
    assert_eq!(begun, status::OK);
    while joint_solver_step(solver.held_mut(), calibrator.held(), no_error()) == status::WORKING {}
    let mut outcome = Place::new();
    let (new, size) = (outcome.new_object(), outcome.size());
    let found = joint_solver_outcome(solver.held(), calibrator.held(), new, size, no_error());
    assert_eq!(found, status::OK);
    let mut sigma = [[0.0; 8]; 3];
    let found = joint_outcome_deviations(outcome.held(), output(&mut sigma));
    assert_eq!(found, status::OK);
    assert_eq!(bits(sigma.as_flattened()), bits(&expected));
}

/// Every choice of the settings, whether it leads to a result or to a refusal.
#[test]
fn settings_are_the_cores() {
    let all = samples::<f64>();
    let plain = delta_cal::Settings::new().with_noise(noise());
    for (solver, start, limit, count) in [
        (0, 0, 0, 40),
        (1, 0, 0, 40),
        (0, 1, 0, 40),
        (0, 1, 0, 11),
        (0, 0, 1, 40),
        (0, 0, 50, 9),
    ] {
        let settings = Settings {
            solver,
            start,
            iteration_limit: limit,
            ..noise_alone()
        };
        let mut of_core = plain
            .with_solver(if solver == 0 {
                Solver::LevenbergMarquardt
            } else {
                Solver::GaussNewton
            })
            .with_start(if start == 0 {
                Start::Nominal
            } else {
                Start::Free
            });
        if limit > 0 {
            of_core = of_core.with_iteration_limit(u16::try_from(limit).unwrap());
        }
        let mut expected = Calibrator::new(&nominal(), &of_core);
        for sample in &all[..count] {
            expected.add(sample).unwrap();
        }
        let mut calibrator = filled(&settings, &all[..count]);
        match (expected.solve(), solved(&mut calibrator)) {
            (Ok(expected), Ok(mut outcome)) => {
                let expected: Vec<f64> = expected
                    .arms
                    .iter()
                    .flat_map(|arm| Parameter::ROTARY.map(|of| arm.standard_deviation(of).unwrap()))
                    .collect();
                assert_eq!(deviations(&mut outcome), bits(&expected));
            }
            (Err(refusal), Err(error)) => assert_eq!(error, Error::from(refusal)),
            (expected, found) => panic!("{expected:?}, but {:?}", found.err()),
        }
    }
}
