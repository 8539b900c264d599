//! What the fixture in C leaves out, against the core: the same calls give the same bits. Also run under Miri, which
//! sees every access to memory: `cargo verify miri`.

use crate::place::{
    Place, bits, in_c, input, no_error, noise_alone, noise_and_tolerance, ok, output, robot, row,
};
use delta_cal::calibration::{JointCalibrator, Solver, Start};
use delta_cal::robot::Transmission;
use delta_cal::{ArmIndex, IkmCalibrator, Parameter};
use delta_cal_c::double::robot::*;
use delta_cal_c::double::sample::Settings;
use delta_cal_c::error::Error;
use delta_cal_c::plain::{GAUSS_NEWTON, START_FREE};
use delta_cal_c::status;
use delta_cal_target_tests::{noise, nominal, samples as measured};

#[test]
fn a_robot_of_24_parameters_is_the_cores() {
    let mut robot = robot();
    let mut parameters = [[0.0; 8]; 3];
    ok(robot_parameters(robot.held(), output(&mut parameters)));
    assert_eq!(parameters, nominal::<f64>().parameters());

    let mut tilted = parameters;
    tilted[1][4] = 1.6;
    let mut error = Error::from(status::OK);
    let (new, size) = (robot.new_object(), robot.size());
    let made = robot_from_parameters(new, size, input(&tilted), output(&mut error));
    assert_eq!((made, error.parameter), (status::GEOMETRY_TILT, 4));
    // The robot that was there is as it was.
    let mut now = [[0.0; 8]; 3];
    ok(robot_parameters(robot.held(), output(&mut now)));
    assert_eq!(now, parameters);
}

#[test]
fn a_robot_with_transmissions_is_the_cores() {
    let mut robot = robot();
    let numbers = [
        [1e-3, 5e-4, -2e-4, 1e-4, 3e-4],
        [0.0; 5],
        [-8e-4, 0.0, 6e-4, 0.0, -1e-4],
    ];
    let set = robot_set_transmissions(robot.held_mut(), input(&numbers), no_error());
    ok(set);
    let transmissions = numbers.map(|own| Transmission::new(own).unwrap());
    let expected = nominal::<f64>().with_transmissions(transmissions).unwrap();

    let joints = [0.3, -0.2, 0.5];
    let (mut position, mut back, mut found) = ([0.0; 3], [0.0; 3], [[0.0; 5]; 3]);
    let there = output(&mut position);
    ok(robot_forward(
        robot.held(),
        input(&joints),
        there,
        no_error(),
    ));
    let there = expected.forward(&joints).unwrap();
    assert_eq!(bits(&position), bits(there.as_slice()));
    let angles = output(&mut back);
    ok(robot_inverse(
        robot.held(),
        input(&position),
        angles,
        no_error(),
    ));
    assert_eq!(bits(&back), bits(&expected.inverse(&there).unwrap()));

    let mut far = numbers;
    far[2][0] = 0.2;
    let refused = robot_set_transmissions(robot.held_mut(), input(&far), no_error());
    assert_eq!(refused, status::GEOMETRY_TRANSMISSION);
    ok(robot_transmissions(robot.held(), output(&mut found)));
    assert_eq!(found, numbers);
}

/// Settings in C and in the core, samples, and whether they lead to a result.
fn assumed() -> Vec<(Settings, delta_cal::Settings<f64>, usize, bool)> {
    let (in_c, of_core) = (
        noise_alone(),
        delta_cal::Settings::new().with_noise(noise()),
    );
    let with = |change: &dyn Fn(&mut Settings)| {
        let mut settings = in_c;
        change(&mut settings);
        settings
    };
    let free = with(&|settings| settings.start = START_FREE);
    let of_core_free = of_core.with_start(Start::Free);
    let newton = with(&|settings| settings.solver = GAUSS_NEWTON);
    let of_core_newton = of_core.with_solver(Solver::GaussNewton);
    let one = with(&|settings| settings.iteration_limit = 1);
    vec![
        (in_c, of_core, 40, true),
        (newton, of_core_newton, 40, true),
        (free, of_core_free, 40, true),
        (free, of_core_free, 7, false),
        (one, of_core.with_iteration_limit(1), 40, false),
        (in_c, of_core, 9, true),
    ]
}

macro_rules! family {
    ($family:ident, $core:ty, $sigma:expr) => {
        mod $family {
            use super::*;
            use delta_cal_c::double::$family::*;

            fn filled(settings: &Settings, taken: &[delta_cal::Sample<f64>]) -> Place<Own> {
                let (mut robot, mut calibrator) = (robot(), Place::filled_with(0xa5));
                let (new, size) = (calibrator.new_object(), calibrator.size());
                ok(init(new, size, robot.held(), input(settings), no_error()));
                for sample in taken {
                    let sample = in_c(sample);
                    ok(add(calibrator.held_mut(), input(&sample), no_error()));
                }
                calibrator
            }

            fn stepped(calibrator: &mut Place<Own>) -> Result<Place<Outcome>, Error> {
                while step(calibrator.held_mut()) == status::WORKING {}
                let (mut error, mut outcome) = (Error::from(status::OK), Place::new());
                let (new, size) = (outcome.new_object(), outcome.size());
                let found = finish(calibrator.held(), new, size, output(&mut error));
                if found == status::OK {
                    Ok(outcome)
                } else {
                    assert_eq!(found, error.status);
                    Err(error)
                }
            }

            fn solved(calibrator: &mut Place<Own>) -> Result<Place<Outcome>, Error> {
                let mut error = Error::from(status::OK);
                if solve(calibrator.held_mut(), output(&mut error)) != status::OK {
                    return Err(error);
                }
                stepped(calibrator)
            }

            fn deviations(outcome: &mut Place<Outcome>) -> Vec<u64> {
                let mut sigma = [[0.0; 8]; 3];
                ok(outcome_deviations(outcome.held(), output(&mut sigma)));
                bits(sigma.as_flattened())
            }

            fn of_core(outcome: &Outcome) -> Vec<u64> {
                let sigma =
                    |arm: ArmIndex| Parameter::ROTARY.map(|of| $sigma(outcome, arm, of).unwrap());
                bits(ArmIndex::ALL.map(sigma).as_flattened())
            }

            fn count(calibrator: &mut Place<Own>) -> u64 {
                let mut count = 0;
                ok(samples(calibrator.held(), output(&mut count)));
                count
            }

            #[test]
            fn results_and_refusals_are_the_cores() {
                let all = measured::<f64>();
                for (settings, assumed, count, has_result) in assumed() {
                    let mut expected = <$core>::new(&nominal(), &assumed);
                    for sample in &all[..count] {
                        expected.add(sample).unwrap();
                    }
                    let mut calibrator = filled(&settings, &all[..count]);
                    match (expected.calibrate(), solved(&mut calibrator)) {
                        (Ok(expected), Ok(mut outcome)) => {
                            assert_eq!(deviations(&mut outcome), of_core(&expected));
                            assert!(has_result);
                        }
                        (Err(refusal), Err(error)) => {
                            assert_eq!(error, Error::from(refusal));
                            assert!(!has_result, "{refusal:?}");
                        }
                        (expected, found) => panic!("{expected:?}, but {:?}", found.err()),
                    }
                }
            }

            #[test]
            fn merging_and_forgetting_are_the_cores() {
                let all = measured::<f64>();
                let (left, right) = all.split_at(17);
                let core = |taken: &[delta_cal::Sample<f64>]| {
                    let settings = delta_cal::Settings::new().with_noise(noise());
                    let mut calibrator = <$core>::new(&nominal(), &settings);
                    for sample in taken {
                        calibrator.add(sample).unwrap();
                    }
                    calibrator
                };
                let mut expected = core(left);
                expected.merge(&core(right)).unwrap();
                expected.forget(0.75).unwrap();

                let mut calibrator = filled(&noise_alone(), left);
                let mut other = filled(&noise_alone(), right);
                ok(merge(calibrator.held_mut(), other.held()));
                for wrong in [1.5, -0.1, f64::NAN] {
                    let refused = forget(calibrator.held_mut(), wrong);
                    assert_eq!(refused, status::FORGETTING);
                }
                ok(forget(calibrator.held_mut(), 0.75));
                assert_eq!(count(&mut calibrator), expected.samples());
                ok(flush(calibrator.held_mut()));
                let mut outcome = solved(&mut calibrator).unwrap();
                let expected = expected.calibrate().unwrap();
                assert_eq!(deviations(&mut outcome), of_core(&expected));

                // Of another noise.
                let mut stranger = filled(&Settings::default(), right);
                let found = merge(calibrator.held_mut(), stranger.held());
                assert_eq!(found, status::DIFFERENT_NOMINAL);
            }

            /// What is solved is the samples of `solve`, whatever is called in between.
            #[test]
            fn samples_do_not_change_while_it_solves() {
                let all = measured::<f64>();
                let settings = noise_alone();
                let mut expected = solved(&mut filled(&settings, &all)).unwrap();
                let (mut calibrator, mut other) =
                    (filled(&settings, &all), filled(&settings, &all));
                let mut early = Place::<Outcome>::filled_with(0x5a);
                let mut early = |calibrator: &mut Place<Own>| {
                    let (new, size) = (early.new_object(), early.size());
                    let found = finish(calibrator.held(), new, size, no_error());
                    assert!(early.is_filled_with(0x5a));
                    found
                };
                ok(step(calibrator.held_mut()));
                assert_eq!(early(&mut calibrator), status::UNFINISHED);
                let mut bytes = vec![0; <$core>::SNAPSHOT_BYTES];
                let (place, mut length) = (crate::place::at(bytes.as_mut_ptr()), 0);
                let size = bytes.len();
                ok(snapshot(
                    calibrator.held(),
                    place,
                    size,
                    output(&mut length),
                ));
                assert_eq!(length, size);

                ok(solve(calibrator.held_mut(), no_error()));
                assert_eq!(step(calibrator.held_mut()), status::WORKING);
                let sample = in_c(&all[0]);
                for found in [
                    add(calibrator.held_mut(), input(&sample), no_error()),
                    merge(calibrator.held_mut(), other.held()),
                    forget(calibrator.held_mut(), 0.5),
                    restore(calibrator.held_mut(), row(&bytes), size),
                ] {
                    assert_eq!(found, status::BUSY);
                }
                // Nothing waits, and it is begun.
                ok(flush(calibrator.held_mut()));
                ok(solve(calibrator.held_mut(), no_error()));
                assert_eq!(early(&mut calibrator), status::UNFINISHED);
                let mut outcome = stepped(&mut calibrator).unwrap();
                assert_eq!(deviations(&mut outcome), deviations(&mut expected));

                // Another sample, and the result is out of date.
                ok(add(calibrator.held_mut(), input(&sample), no_error()));
                assert_eq!(early(&mut calibrator), status::UNFINISHED);
                ok(solve(calibrator.held_mut(), no_error()));
                ok(stop(calibrator.held_mut()));
                ok(add(calibrator.held_mut(), input(&sample), no_error()));
                ok(reset(calibrator.held_mut()));
                assert_eq!(count(&mut calibrator), 0);
            }

            #[test]
            fn a_snapshot_goes_on_to_the_same_bits() {
                let all = measured::<f64>();
                let settings = noise_and_tolerance();
                let size = <$core>::SNAPSHOT_BYTES;
                let taken = |calibrator: &mut Place<Own>, bytes: &mut [u8]| {
                    let mut length = 7;
                    let place = crate::place::at(bytes.as_mut_ptr());
                    let found =
                        snapshot(calibrator.held(), place, bytes.len(), output(&mut length));
                    (found, length)
                };
                let mut whole = filled(&settings, &[]);
                let mut broken = filled(&settings, &[]);
                let (mut bytes, mut other) = (vec![0xa5; size], vec![0xa5; size + 3]);
                for sample in &all[..10] {
                    let sample = in_c(sample);
                    ok(add(whole.held_mut(), input(&sample), no_error()));
                    ok(add(broken.held_mut(), input(&sample), no_error()));
                    assert_eq!(taken(&mut broken, &mut bytes), (status::OK, size));
                    broken = filled(&settings, &[]);
                    ok(restore(broken.held_mut(), row(&bytes), size));
                }
                assert_eq!(taken(&mut whole, &mut other), (status::OK, size));
                assert_eq!(bytes, other[..size]);
                // What lies behind a snapshot is the caller's.
                assert_eq!(other[size..], [0xa5; 3]);

                // Too little room: nothing is written, and the length neither.
                let mut short = vec![0x5a; size - 1];
                let refused = (status::SNAPSHOT_BUFFER, 7);
                assert_eq!(taken(&mut whole, &mut short), refused);
                assert!(short.iter().all(|byte| *byte == 0x5a));

                let mut empty = filled(&settings, &[]);
                let mut wrong = bytes.clone();
                wrong[size / 2] ^= 1;
                for damaged in [&wrong[..], &bytes[..size - 1], &[], &vec![0xff; size]] {
                    let found = restore(empty.held_mut(), row(damaged), damaged.len());
                    assert_eq!(found, status::SNAPSHOT_DAMAGED);
                }
                assert_eq!(count(&mut empty), 0, "a refused restore changed it");
                let stranger = Settings {
                    position_noise: [0.5; 3],
                    ..settings
                };
                let found = restore(filled(&stranger, &[]).held_mut(), row(&bytes), size);
                assert_eq!(found, status::SNAPSHOT_OTHER_CALIBRATION);

                // Bytes within the object.
                let inside = whole.start().wrapping_add(64);
                let (place, length) = (crate::place::at(inside), &mut 0);
                let within = snapshot(whole.held(), place, size, output(length));
                assert_eq!(within, status::OVERLAP);
                let within = restore(whole.held_mut(), crate::place::at(inside), size);
                assert_eq!(within, status::OVERLAP);
            }
        }
    };
}

family!(
    ikm,
    IkmCalibrator<f64>,
    |outcome: &Outcome, arm: ArmIndex, of| { outcome.arms[arm.index()].standard_deviation(of) }
);
family!(joint, JointCalibrator<f64>, Outcome::standard_deviation);
