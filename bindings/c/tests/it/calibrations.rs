//! Robots, and the two calibrators from complete positions: the same bits as the core, in every way of using them.

use crate::place::*;
use delta_cal::calibration::{Ikm, Joint};
use delta_cal::robot::Transmission;
use delta_cal_c::double::robot::*;
use delta_cal_c::double::sample::Settings;
use delta_cal_c::error::Error;
use delta_cal_c::plain::{GAUSS_NEWTON, START_FREE};
use delta_cal_c::status;
use delta_cal_target_tests::{noise, nominal, samples as measured};

#[test]
fn a_robot_with_transmissions_is_the_cores() {
    let mut robot = robot();
    let numbers = [
        [1e-3, 5e-4, -2e-4, 1e-4, 3e-4],
        [0.0; 5],
        [-8e-4, 0.0, 6e-4, 0.0, -1e-4],
    ];
    let set = robot_set_transmissions(robot.held_mut(), input(&numbers), null());
    ok(set);
    let transmissions = numbers.map(|own| Transmission::new(own).unwrap());
    let expected = nominal::<f64>().with_transmissions(transmissions).unwrap();

    let joints = [0.3, -0.2, 0.5];
    let (mut position, mut back, mut found) = ([0.0; 3], [0.0; 3], [[0.0; 5]; 3]);
    let there = output(&mut position);
    ok(robot_forward(robot.held(), input(&joints), there, null()));
    let there = expected.forward(&joints).unwrap();
    assert_eq!(bits(&position), bits(there.as_slice()));
    let angles = output(&mut back);
    ok(robot_inverse(
        robot.held(),
        input(&position),
        angles,
        null(),
    ));
    assert_eq!(bits(&back), bits(&expected.inverse(&there).unwrap()));

    let mut far = numbers;
    far[2][0] = 0.2;
    let refused = robot_set_transmissions(robot.held_mut(), input(&far), null());
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
    let of_core_free = of_core.with_free_start(true);
    let newton = with(&|settings| settings.solver = GAUSS_NEWTON);
    let of_core_newton = of_core.with_damping(false);
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
    ($family:ident, $estimator:ident) => {
        mod $family {
            use super::*;

            use delta_cal_c::double::$family::*;

            /// A snapshot into more room than it needs: what lies behind it is the caller's.
            fn stored(calibrator: &mut Place<Own>) -> Vec<u8> {
                let (mut bytes, mut length) = (vec![0xa5; Own::SNAPSHOT_BYTES + 3], 7);
                let (place, room) = (at(bytes.as_mut_ptr()), bytes.len());
                let held = calibrator.held();
                ok(snapshot(held, place, room, output(&mut length)));
                assert_eq!(length, Own::SNAPSHOT_BYTES);
                assert_eq!(bytes.split_off(length), [0xa5; 3]);
                bytes
            }

            /// The parameters of the calibrated robot, their standard uncertainties, and their covariance.
            fn solved(calibrator: &mut Place<Own>) -> Result<Vec<u64>, Error> {
                let mut error = Error::from(status::OK);
                if solve(calibrator.held_mut(), output(&mut error)) != status::OK {
                    return Err(error);
                }
                stepped(calibrator)
            }

            fn stepped(calibrator: &mut Place<Own>) -> Result<Vec<u64>, Error> {
                while step(calibrator.held_mut()) == status::WORKING {}
                let (mut error, mut robot) = (Error::from(status::OK), Place::new());
                let (new, size) = (robot.new_object(), robot.size());
                let found = finish(calibrator.held(), new, size, output(&mut error));
                if found != status::OK {
                    assert_eq!(found, error.status);
                    return Err(error);
                }
                let (mut sigma, mut all) = ([[0.0; 8]; 3], [[0.0; 24]; 24]);
                ok(deviations(calibrator.held(), output(&mut sigma)));
                ok(covariance(calibrator.held(), output(&mut all)));
                Ok([
                    parameters(&mut robot),
                    bits(sigma.as_flattened()),
                    bits(all.as_flattened()),
                ]
                .concat())
            }

            fn count(calibrator: &mut Place<Own>) -> u64 {
                let mut count = 7;
                ok(samples(calibrator.held(), output(&mut count)));
                count
            }

            fn filled(settings: &Settings, taken: &[delta_cal::Sample<f64>]) -> Place<Own> {
                let (mut robot, mut calibrator) = (robot(), Place::filled_with(0xa5));
                let (new, size) = (calibrator.new_object(), calibrator.size());
                ok(init(new, size, robot.held(), input(settings), null()));
                for sample in taken {
                    added(&mut calibrator, sample);
                }
                calibrator
            }

            fn added(calibrator: &mut Place<Own>, sample: &delta_cal::Sample<f64>) {
                let sample = in_c(sample);
                ok(add(calibrator.held_mut(), input(&sample), null()));
            }

            /// The core's calibrator.
            fn core(settings: &delta_cal::Settings<f64>, taken: &[delta_cal::Sample<f64>]) -> Own {
                let mut calibrator = Own::new(&nominal(), settings);
                for sample in taken {
                    calibrator.add(sample).unwrap();
                }
                calibrator
            }

            fn solved_by_core(calibrator: &mut Own) -> Result<Vec<u64>, Error> {
                let outcome = calibrator.calibrate()?;
                Ok(bits(&found::<_, $estimator>(&outcome).concat()))
            }

            #[test]
            fn results_and_refusals_are_the_cores() {
                let all = measured::<f64>();
                for (settings, assumed, count, has_result) in assumed() {
                    let expected = solved_by_core(&mut core(&assumed, &all[..count]));
                    let found = solved(&mut filled(&settings, &all[..count]));
                    assert_eq!(found, expected);
                    assert_eq!(found.is_ok(), has_result);
                }
            }

            #[test]
            fn merging_and_forgetting_are_the_cores() {
                let all = measured::<f64>();
                let (left, right) = all.split_at(17);
                let settings = delta_cal::Settings::new().with_noise(noise());
                let mut expected = core(&settings, left);
                expected.merge(&core(&settings, right)).unwrap();
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
                assert_eq!(solved(&mut calibrator), solved_by_core(&mut expected));

                // Of another noise.
                let mut stranger = filled(&Settings::default(), right);
                let found = merge(calibrator.held_mut(), stranger.held());
                assert_eq!(found, status::DIFFERENT_NOMINAL);
                assert_eq!(stepped(&mut calibrator), solved_by_core(&mut expected));
            }

            /// What is solved is the samples of `solve`, whatever is called in between.
            #[test]
            fn samples_do_not_change_while_it_solves() {
                let all = measured::<f64>();
                let settings = noise_alone();
                let expected = solved(&mut filled(&settings, &all));
                let (mut calibrator, mut other) =
                    (filled(&settings, &all), filled(&settings, &all));
                let early = |calibrator: &mut Place<Own>| {
                    let mut early = Place::filled_with(0x5a);
                    let (new, size) = (early.new_object(), early.size());
                    let found = finish(calibrator.held(), new, size, null());
                    assert!(early.is_filled_with(0x5a));
                    let sigma = deviations(calibrator.held(), output(&mut [[0.0; 8]; 3]));
                    assert_eq!((found, sigma), (status::UNFINISHED, status::UNFINISHED));
                };
                ok(step(calibrator.held_mut()));
                early(&mut calibrator);
                let bytes = stored(&mut calibrator);

                ok(solve(calibrator.held_mut(), null()));
                assert_eq!(step(calibrator.held_mut()), status::WORKING);
                let sample = in_c(&all[0]);
                for found in [
                    add(calibrator.held_mut(), input(&sample), null()),
                    merge(calibrator.held_mut(), other.held()),
                    forget(calibrator.held_mut(), 0.5),
                    restore(calibrator.held_mut(), row(&bytes), bytes.len()),
                ] {
                    assert_eq!(found, status::BUSY);
                }
                // Nothing waits, and it is begun.
                ok(flush(calibrator.held_mut()));
                ok(solve(calibrator.held_mut(), null()));
                early(&mut calibrator);
                assert_eq!(stepped(&mut calibrator), expected);

                // Another sample, and the result is out of date.
                ok(add(calibrator.held_mut(), input(&sample), null()));
                early(&mut calibrator);
                ok(solve(calibrator.held_mut(), null()));
                ok(stop(calibrator.held_mut()));
                ok(add(calibrator.held_mut(), input(&sample), null()));
            }

            #[test]
            fn a_snapshot_is_restored_or_refused() {
                let all = measured::<f64>();
                let settings = noise_and_tolerance();
                let (mut whole, mut other) =
                    (filled(&settings, &all[..10]), filled(&settings, &all[..1]));
                let bytes = stored(&mut whole);
                let size = bytes.len();
                ok(restore(other.held_mut(), row(&bytes), size));
                assert_eq!(stored(&mut other), bytes);

                // Too little room: nothing is written, and the length neither.
                let (mut short, mut length) = (vec![0x5a; size - 1], 7);
                let place = at(short.as_mut_ptr());
                let found = snapshot(whole.held(), place, size - 1, output(&mut length));
                assert_eq!((found, length), (status::SNAPSHOT_BUFFER, 7));
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
                let within = snapshot(whole.held(), at(inside), size, output(&mut 0));
                assert_eq!(within, status::OVERLAP);
                let within = restore(whole.held_mut(), at(inside), size);
                assert_eq!(within, status::OVERLAP);
            }
        }
    };
}

family!(ikm, Ikm);
family!(joint, Joint);
