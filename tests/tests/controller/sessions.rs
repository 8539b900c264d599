//! Frames that are none: answered, counted, and without any other effect.

use crate::controller::driver::{Driver, Flash, begin, message, on_the_host, samples, taken};
use crc::{CRC_32_ISO_HDLC, Crc};
use delta_cal::samples::SampleError;
use delta_cal::{ArmIndex, Refusal};
use delta_cal_controller::Number;
use delta_cal_protocol::{
    Begin, Counters, Direction, Fault, Geometry, Phase, Request, Response, Scalar,
    UNKNOWN_SEQUENCE, VERSION, encode,
};
use delta_cal_tests::paper_robot;

#[test]
fn without_a_session_there_is_nothing_to_do() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let sample = samples::<f32>(1, 1)[0];
    let arm = ArmIndex::Second;
    assert_eq!(driver.status().phase, Phase::Idle);
    assert_eq!(driver.status().session, 0);
    for session in [0, 7] {
        assert_eq!(
            driver.fault(&message(session, 0, &sample)),
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
    for change in [
        (|begin| begin.session = 0) as fn(&mut Begin<f32>),
        |begin| begin.tolerance = Some((0.0, 0.1)),
        |begin| begin.tolerance = Some((f32::NAN, 0.1)),
        |begin| begin.joint_zero = Some(0.0),
        |begin| (begin.tolerance, begin.joint_zero) = (None, Some(0.1)),
        |begin| begin.noise = Some(([0.1, -1.0, 0.1], 0.1)),
        |begin| begin.noise = Some(([0.1; 3], f32::INFINITY)),
        |begin| begin.forgetting = Some(0.5),
        |begin| begin.forgetting = Some(f32::NAN),
    ] {
        let mut wrong = begin(4);
        change(&mut wrong);
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
        let ahead = message(9, next, sample);
        assert_eq!(driver.fault(&ahead), Fault::OutOfOrder { next: index });
        let other = message(8, index, sample);
        assert_eq!(driver.fault(&other), Fault::NoSession);
        for _ in 0..3 {
            assert_eq!(driver.sample(9, index, sample), taken(9, next));
        }
        // An old one neither.
        assert_eq!(driver.sample(9, index / 2, &samples[0]), taken(9, next));
    }
    driver.solve(9, 20);
    driver.rest();
    let expected = on_the_host(&samples).calibrate().expect("a calibration");
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
    let request = message(9, 0, &wrong);
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
    let samples = samples::<f32>(6, 20);
    let [mut driver, mut alone] = [(); 2].map(|()| {
        let mut driver = Driver::<f32, _>::start(Flash::new());
        driver.begin(9);
        for (index, sample) in (0..).zip(&samples) {
            driver.sample(9, index, sample);
        }
        driver
    });
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
        let next = message(9, 20, &samples[0]);
        assert_eq!(driver.fault(&next), Fault::Busy);
        assert_eq!(driver.sample(9, 19, &samples[19]), taken(9, 20));
        assert_eq!(driver.fault(&outcome), Fault::NoOutcome);
    }
    assert!(seen.contains(&Phase::Solving), "{seen:?}");
    alone.solve(9, 20);
    let steps = std::iter::from_fn(|| alone.controller.idle().then_some(()));
    assert_eq!(seen.len(), 1 + steps.count());
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
                    refusal: Refusal::TooFewSamples {
                        arm: ArmIndex::First,
                        samples: 4,
                        needed: 8
                    }
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
    fn is_named<T: Number>(scalar: Scalar) {
        let response = Driver::<T, _>::start(Flash::new()).ask(&Request::Identify);
        let Response::Identity(identity) = response else {
            panic!("{response:?}")
        };
        let nominal = Geometry::of(&paper_robot::<T>()).fingerprint();
        assert_eq!((identity.scalar, identity.nominal), (scalar, nominal));
    }
    is_named::<f32>(Scalar::Single);
    is_named::<f64>(Scalar::Double);
}

fn identify(sequence: u16) -> Vec<u8> {
    encode(Direction::Request, sequence, &Request::<f32>::Identify)
        .unwrap()
        .to_vec()
}

#[test]
fn lost_and_repeated_sequence_numbers_are_counted() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    for (sequence, lost, repeated) in [
        // The first number is anybody's.
        (30, 0, 0),
        (31, 0, 0),
        (31, 0, 1),
        (31, 0, 2),
        (34, 2, 2),
        // A new driver begins anywhere.
        (1, 2, 2),
        (2, 2, 2),
        (40_000, 2, 2),
        // 0 is no number: 65535 is followed by 1.
        (65_534, 2, 2),
        (65_535, 2, 2),
        (1, 2, 2),
        (3, 3, 2),
    ] {
        let (answered, _) = driver.answer(&identify(sequence));
        assert_eq!(answered, sequence);
        driver.sequence = sequence;
        let reception = driver.controller_counters();
        assert_eq!(
            (reception.lost, reception.repeated),
            (lost, repeated),
            "{sequence}"
        );
    }
}

impl Driver<f32, Flash> {
    /// The counters without a trace: asked with the sequence number that is not counted.
    fn controller_counters(&mut self) -> Counters {
        let frame = encode(
            Direction::Request,
            UNKNOWN_SEQUENCE,
            &Request::<f32>::Counters,
        )
        .unwrap();
        match self.answer(&frame) {
            (UNKNOWN_SEQUENCE, Response::Counters(counters)) => counters,
            answer => panic!("{answer:?}"),
        }
    }
}

#[test]
fn every_kind_of_wrong_frame_is_answered_and_counted() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let damaged = (UNKNOWN_SEQUENCE, Response::<f32>::Fault(Fault::Damaged));

    let mut broken = identify(1);
    broken[2] ^= 0x40;
    assert_eq!(driver.answer(&broken), damaged);
    assert_eq!(driver.answer(&[0, 5, 0]), damaged);
    let too_long: Vec<u8> = [vec![0], vec![9; 2000], vec![0]].concat();
    assert_eq!(driver.answer(&too_long), damaged);
    // An echo is not answered: the answer would come back, too.
    let echo = encode(Direction::Response, 1, &Response::<f32>::Fault(Fault::Busy)).unwrap();
    assert!(driver.send(&echo).is_empty());
    assert_eq!(
        driver.controller_counters(),
        Counters {
            received: 1,
            damaged: 4,
            ..Counters::default()
        }
    );

    for content in [&[200][..], &[], &[0, 0]] {
        assert_eq!(
            driver.answer(&framed(VERSION, 7, content)),
            (7, Response::Fault(Fault::UnknownRequest))
        );
    }
    // The next protocol version, its checksum as it must be.
    let newer = framed(VERSION + 1, 9, &[0]);
    assert_eq!(
        driver.answer(&newer),
        (
            9,
            Response::Fault(Fault::UnknownVersion { spoken: VERSION })
        )
    );
    let solve = Request::Solve {
        session: 1,
        samples: 0,
    };
    driver.sequence = 9;
    assert_eq!(driver.fault(&solve), Fault::NoSession);
    driver.controller.counters.overrun = 17;
    let counted = driver.controller_counters();
    assert_eq!(
        counted,
        Counters {
            received: 1 + 3 + 1 + 1 + 1,
            damaged: 4,
            unknown_version: 1,
            unknown_request: 3,
            repeated: 2,
            lost: counted.lost,
            refused: 1,
            overrun: 17,
        }
    );
}

/// A frame of any content, its checksum as it must be, then COBS: as the protocol's documentation says.
fn framed(version: u8, sequence: u8, content: &[u8]) -> Vec<u8> {
    let content = [&[version, sequence, 0], content].concat();
    let checksum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&content);
    let content = [content, checksum.to_le_bytes().to_vec()].concat();
    let mut frame = vec![0];
    for run in content.split(|byte| *byte == 0) {
        assert!(run.len() < 254);
        frame.push(u8::try_from(run.len()).unwrap() + 1);
        frame.extend(run);
    }
    frame.push(0);
    frame
}
