use crate::controller::driver::{Driver, Flash, begin, on_the_host, samples, taken};
use delta_cal::calibration::ArmOutcome;
use delta_cal::samples::SampleError;
use delta_cal::stream::StreamRefusal;
use delta_cal::{ArmIndex, Parameter, Real, Refusal};
use delta_cal_firmware_example::Number;
use delta_cal_protocol::{Begin, Fault, Geometry, Phase, Request, Response};
use delta_cal_tests::paper_robot;

/// Sessions of 5 to 200 samples: the controller's result has the bits of the core's.
fn same_bits_as_the_core<T: Number>(robots: u64) {
    let mut driver = Driver::<T, _>::start(Flash::new());
    let (mut solved, mut refused) = (0, 0);
    for robot in 1..=robots {
        let session = u32::try_from(robot).unwrap();
        let count = [5, 8, 12, 13, 16, 20, 60, 200][usize::try_from(robot).unwrap() % 8];
        let mut samples = samples::<T>(robot, count);
        if robot % 7 == 0 {
            // The third joint counts the other way: no robot of this tolerance.
            for sample in &mut samples {
                sample.joints[2] = -sample.joints[2];
            }
        }
        let phase = driver.calibrate(session, &samples);
        let expected = on_the_host(&samples).solve();
        match (phase, expected) {
            (Phase::CalibrationRefused { refusal, .. }, Err(expected)) => {
                assert_eq!(refusal, StreamRefusal::Calibration(expected));
                refused += 1;
            }
            (Phase::Solved { fingerprint, .. }, Ok(expected)) => {
                assert_eq!(fingerprint, Geometry::of(&expected.robot).fingerprint());
                for (arm, expected) in ArmIndex::ALL.into_iter().zip(&expected.arms) {
                    let Response::Outcome(report) = driver.ask(&Request::Outcome { session, arm })
                    else {
                        panic!("no outcome")
                    };
                    assert_eq!(report.arm, arm);
                    assert_eq!(report.parameters, expected.arm.parameters());
                    assert_eq!(report.sigma, sigmas(expected));
                    assert_eq!(report.residual_rms, expected.residual_rms);
                    assert_eq!(report.estimated_noise, expected.estimated_noise);
                    assert_eq!(report.degrees_of_freedom, expected.degrees_of_freedom);
                    assert_eq!(report.samples, expected.samples);
                    assert_eq!(report.iterations, expected.iterations);
                    assert_eq!(report.termination, expected.termination);
                    assert_eq!(report.start, expected.start);
                    assert_eq!(report.condition, expected.condition);
                    assert_eq!(report.prior_share, expected.prior_share.data.0[0]);
                }
                solved += 1;
            }
            (phase, expected) => panic!("robot {robot}: {phase:?}, {expected:?}"),
        }
    }
    println!("{solved} solved, {refused} refused, all as by the core");
    assert!(solved > robots / 2 && refused >= robots / 7);
}

/// As the core has them, one after the other.
fn sigmas<T: Number>(outcome: &ArmOutcome<T>) -> Option<[T; 8]> {
    let mut sigmas = [T::ZERO; 8];
    for (sigma, parameter) in sigmas.iter_mut().zip(Parameter::ROTARY) {
        *sigma = outcome.standard_deviation(parameter)?;
    }
    Some(sigmas)
}

#[test]
fn results_have_the_bits_of_the_core() {
    same_bits_as_the_core::<f32>(500);
}

#[test]
fn results_have_the_bits_of_the_core_in_double_precision() {
    same_bits_as_the_core::<f64>(100);
}

#[test]
fn without_a_session_there_is_nothing_to_do() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let sample = samples::<f32>(1, 1)[0];
    let arm = ArmIndex::Second;
    assert_eq!(driver.status().phase, Phase::Idle);
    assert_eq!(driver.status().session, 0);
    for session in [0, 7] {
        assert_eq!(
            driver.fault(&crate::controller::driver::message(session, 0, &sample)),
            Fault::NoSession
        );
        for request in [
            Request::Solve {
                session,
                samples: 0,
            },
            Request::Outcome { session, arm },
            Request::Apply {
                session,
                fingerprint: 0,
                from: 0,
            },
        ] {
            assert_eq!(driver.fault(&request), Fault::NoSession);
        }
    }
    assert!(!driver.controller.idle());
}

#[test]
fn a_begin_that_comes_again_does_not_start_again() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let samples = samples::<f32>(2, 20);
    assert_eq!(driver.begin(3), 0);
    for (index, sample) in (0..).zip(&samples) {
        driver.sample(3, index, sample);
        assert_eq!(driver.begin(3), index + 1);
    }
    // One with other settings is another one, though its number is the same.
    let other = Begin {
        tolerance: None,
        ..begin(3)
    };
    assert_eq!(driver.begin_with(other), 0);
    driver.sample(3, 0, &samples[0]);
    assert_eq!(driver.begin_with(other), 1);
    // So is one with another number.
    assert_eq!(driver.begin(4), 0);
    assert_eq!(driver.begin(3), 0);
    assert_eq!(driver.status().phase, Phase::Collecting { samples: 0 });
}

#[test]
fn settings_that_are_none_leave_the_open_session() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let samples = samples::<f32>(2, 3);
    driver.begin(3);
    driver.sample(3, 0, &samples[0]);
    let valid = begin::<f32>(4);
    for wrong in [
        Begin {
            session: 0,
            ..valid
        },
        Begin {
            tolerance: Some((0.0, 0.1)),
            ..valid
        },
        Begin {
            tolerance: Some((f32::NAN, 0.1)),
            ..valid
        },
        Begin {
            noise: Some(([0.1, -1.0, 0.1], 0.1)),
            ..valid
        },
        Begin {
            noise: Some(([0.1; 3], f32::INFINITY)),
            ..valid
        },
        Begin {
            forgetting: Some(0.5),
            ..valid
        },
        Begin {
            forgetting: Some(f32::NAN),
            ..valid
        },
    ] {
        assert_eq!(driver.fault(&Request::Begin(wrong)), Fault::Settings);
        assert_eq!(driver.begin(3), 1);
    }
}

#[test]
fn each_sample_is_taken_in_once_and_in_order() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let samples = samples::<f32>(5, 20);
    driver.begin(9);
    for (index, sample) in (0..).zip(&samples) {
        let next = index + 1;
        let ahead = crate::controller::driver::message(9, next, sample);
        assert_eq!(driver.fault(&ahead), Fault::OutOfOrder { next: index });
        let other = crate::controller::driver::message(8, index, sample);
        assert_eq!(driver.fault(&other), Fault::NoSession);
        for _ in 0..3 {
            assert_eq!(driver.sample(9, index, sample), taken(9, next));
        }
        // An old one neither.
        assert_eq!(driver.sample(9, index / 2, &samples[0]), taken(9, next));
    }
    driver.solve(9, 20);
    driver.rest();
    let expected = on_the_host(&samples).solve().expect("a calibration");
    assert_eq!(
        driver.status().phase,
        Phase::Solved {
            samples: 20,
            fingerprint: Geometry::of(&expected.robot).fingerprint()
        }
    );
}

#[test]
fn an_impossible_sample_is_refused_and_its_place_stays_open() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let samples = samples::<f32>(5, 20);
    driver.begin(9);
    let mut wrong = samples[0];
    wrong.joints[1] = f32::NAN;
    let request = crate::controller::driver::message(9, 0, &wrong);
    assert_eq!(
        driver.fault(&request),
        Fault::Sample(SampleError::JointNonFinite(ArmIndex::Second))
    );
    assert!(matches!(
        driver.calibrate_on(9, &samples),
        Phase::Solved { .. }
    ));
}

#[test]
fn solving_starts_once_with_every_sample() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let samples = samples::<f32>(6, 20);
    driver.begin(9);
    for (index, sample) in (0..).zip(&samples) {
        driver.sample(9, index, sample);
    }
    for samples in [0, 19, 21] {
        let request = Request::Solve {
            session: 9,
            samples,
        };
        assert_eq!(driver.fault(&request), Fault::OutOfOrder { next: 20 });
    }
    assert_eq!(driver.status().phase, Phase::Collecting { samples: 20 });

    let outcome = Request::Outcome {
        session: 9,
        arm: ArmIndex::First,
    };
    let mut seen = vec![driver.solve(9, 20)];
    while driver.controller.idle() {
        // Asked again and again it does not start again; samples wait.
        seen.push(driver.solve(9, 20));
        let next = crate::controller::driver::message(9, 20, &samples[0]);
        assert_eq!(driver.fault(&next), Fault::Busy);
        assert_eq!(driver.sample(9, 19, &samples[19]), taken(9, 20));
        assert_eq!(driver.fault(&outcome), Fault::NoOutcome);
    }
    assert!(seen.contains(&Phase::Solving), "{seen:?}");
    assert!(seen.len() < 40, "{} steps", seen.len());
    let solved = driver.status().phase;
    assert!(matches!(solved, Phase::Solved { samples: 20, .. }));
    assert_eq!(driver.solve(9, 20), solved);
    assert!(!driver.controller.idle(), "solved twice");
}

#[test]
fn more_samples_may_follow_a_result_and_a_refusal() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let samples = samples::<f32>(7, 60);
    let plain = Begin {
        tolerance: None,
        ..begin(9)
    };
    driver.begin_with(plain);
    let mut next = 0;
    for (count, solved) in [(4, false), (30, true), (60, true)] {
        while next < count {
            let answer = driver.sample(9, next, &samples[next as usize]);
            next += 1;
            assert_eq!(answer, taken(9, next));
            assert_eq!(driver.status().phase, Phase::Collecting { samples: next });
        }
        driver.solve(9, next);
        driver.rest();
        let phase = driver.status().phase;
        if solved {
            assert!(matches!(phase, Phase::Solved { samples, .. } if samples == next));
        } else {
            assert_eq!(
                phase,
                Phase::CalibrationRefused {
                    samples: 4,
                    refusal: StreamRefusal::Calibration(Refusal::TooFewSamples {
                        arm: ArmIndex::First,
                        samples: 4,
                        needed: 8
                    })
                }
            );
            assert_eq!(driver.solve(9, next), phase);
            let outcome = Request::Outcome {
                session: 9,
                arm: ArmIndex::First,
            };
            assert_eq!(driver.fault(&outcome), Fault::NoOutcome);
        }
    }
}

#[test]
fn identity_names_scalar_and_nominal() {
    fn identity<T: Number + Real>() -> delta_cal_protocol::Identity {
        match Driver::<T, _>::start(Flash::new()).ask(&Request::Identify) {
            Response::Identity(identity) => identity,
            response => panic!("{response:?}"),
        }
    }
    let single = identity::<f32>();
    assert_eq!(single.scalar, delta_cal_protocol::Scalar::Single);
    assert_eq!(
        single.nominal,
        Geometry::of(&paper_robot::<f32>()).fingerprint()
    );
    let double = identity::<f64>();
    assert_eq!(double.scalar, delta_cal_protocol::Scalar::Double);
    assert_eq!(
        double.nominal,
        Geometry::of(&paper_robot::<f64>()).fingerprint()
    );
}
