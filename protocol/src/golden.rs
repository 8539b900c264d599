//! Frames of every message, bit by bit. `golden.txt` is what `tests/goldens/generate_frames.py` makes of them from the page
//! docs/protocol.md, without this crate.

#![allow(clippy::unwrap_used)]

use crate::{
    Adopt, ArmReport, Begin, ControlLoop, Counters, Direction, Fault, GateStatus, Geometry,
    Identity, LARGEST_FRAME, Origin, ParameterSet, Parameters, Phase, Reader, Receiver, Request,
    Response, RevertTo, SampleMessage, Scalar, Status, Wire, Writer, encode,
};
use delta_cal::calibration::{StartUsed, Termination};
use delta_cal::robot::GeometryError;
use delta_cal::samples::SampleError;
use delta_cal::stream::{Alarm, Estimator, StreamRefusal};
use delta_cal::{ArmIndex, Parameter, Real, Refusal};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::format;
use std::string::String;
use std::vec::Vec;

const SEQUENCE: u16 = 0x1234;
const SESSION: u32 = 0x0102_0304;
const GENERATION: u32 = 3;
const FINGERPRINT: u32 = 0xa1b2_c3d4;
const ARM: [f64; 8] = [164.0, 0.5, -0.25, 0.0, 0.125, 260.75, 0.5, 480.5];
const GEAR: [f64; 5] = [0.007_812_5, 0.0, -0.5, 0.25, 0.0];

/// The frames by their names.
fn golden() -> BTreeMap<&'static str, Vec<u8>> {
    let lines = include_str!("golden.txt").lines();
    lines
        .map(|line| {
            let (name, hex) = line.split_once(": ").unwrap();
            let bytes = (0..hex.len() / 2).map(|at| &hex[2 * at..2 * at + 2]);
            let bytes = bytes.map(|byte| u8::from_str_radix(byte, 16).unwrap());
            (name, bytes.collect())
        })
        .collect()
}

fn numbers<T: Real, const N: usize>(values: [f64; N]) -> [T; N] {
    values.map(T::from_f64)
}

fn requests<T: Real>(scalar: &str) -> Vec<(String, Request<T>)> {
    let session = SESSION;
    let number = T::from_f64;
    let plain = |name: &str, request| (String::from(name), request);
    let scaled = |name: &str, request| (format!("{name}_{scalar}"), request);
    std::vec![
        plain("identify", Request::Identify),
        plain("parameters", Request::Parameters(ParameterSet::Nominal)),
        scaled(
            "begin",
            Request::Begin(Begin {
                session,
                tolerance: Some((number(0.5), number(0.007_812_5))),
                noise: Some((numbers([0.0625, 0.0625, 0.125]), number(0.0))),
                estimator: Estimator::Joint,
                gate: false,
                forgetting: Some(number(20.0)),
            })
        ),
        scaled(
            "sample",
            Request::Sample(SampleMessage {
                session,
                index: 7,
                joints: numbers([0.5, 0.25, -0.125]),
                position: numbers([1.5, -2.5, -450.0]),
            })
        ),
        plain(
            "solve",
            Request::Solve {
                session,
                samples: 40
            }
        ),
        plain("status", Request::Status),
        plain(
            "outcome",
            Request::Outcome {
                session,
                arm: ArmIndex::Third
            }
        ),
        plain(
            "apply",
            Request::Apply {
                session,
                fingerprint: FINGERPRINT,
                from: GENERATION
            }
        ),
        plain(
            "revert",
            Request::Revert {
                from: GENERATION,
                to: RevertTo::Nominal
            }
        ),
        plain("counters", Request::Counters),
        scaled(
            "adopt",
            Request::Adopt(Adopt {
                from: GENERATION,
                geometry: geometry(true)
            })
        ),
    ]
}

fn geometry<T: Real>(gears: bool) -> Geometry<T> {
    Geometry {
        arms: [numbers(ARM); 3],
        transmissions: gears.then(|| [numbers(GEAR); 3]),
    }
}

fn status<T: Real>(phase: Phase, gate: Option<GateStatus>) -> Response<T> {
    Response::Status(Status {
        session: SESSION,
        phase,
        gate,
        control: ControlLoop {
            turns: 1000,
            longest_ticks: 850,
            longest_ticks_calibrating: 851,
            ticks_a_second: 25_000_000,
            late: 0,
            unreachable: 0,
            switches: 1,
            fingerprint: FINGERPRINT,
            point: numbers([1.5, -2.5, -450.0]),
            joints: numbers([0.5, 0.25, -0.125]),
        },
    })
}

fn responses<T: Real>(scalar: &str) -> Vec<(String, Response<T>)> {
    let plain = |name: &str, response| (String::from(name), response);
    let scaled = |name: &str, response| (format!("{name}_{scalar}"), response);
    let number = T::from_f64;
    let late = Fault::OutOfOrder { next: 5 };
    let joint = Fault::Sample(SampleError::JointNonFinite(ArmIndex::Second));
    let forearm = Fault::Geometry(GeometryError::NotPositive(Parameter::Lb));
    std::vec![
        plain("fault_out_of_order", Response::Fault(late)),
        plain("fault_sample", Response::Fault(joint)),
        plain("fault_geometry", Response::Fault(forearm)),
        plain(
            "identity",
            Response::Identity(Identity {
                firmware: [0, 1, 2],
                scalar: Scalar::Single,
                processor: 0x410f_c241,
                nominal: FINGERPRINT,
            })
        ),
        scaled(
            "parameters",
            Response::Parameters(Parameters {
                origin: Origin::Calibration,
                generation: GENERATION,
                geometry: geometry(false),
            })
        ),
        plain(
            "taken",
            Response::Taken {
                session: SESSION,
                next: 8
            }
        ),
        scaled(
            "solved",
            status(
                Phase::Solved {
                    samples: 40,
                    fingerprint: FINGERPRINT
                },
                None
            )
        ),
        scaled(
            "refused",
            status(
                Phase::CalibrationRefused {
                    samples: 40,
                    refusal: StreamRefusal::Calibration(Refusal::Undetermined {
                        arm: ArmIndex::First,
                        parameter: Parameter::Lb,
                        condition: 2048.0,
                    }),
                },
                Some(GateStatus {
                    taken: 38,
                    untested: 8,
                    rejected: 2,
                    alarm: Some(Alarm::RobotChanged { first: 50 }),
                })
            )
        ),
        scaled(
            "outcome",
            Response::Outcome(ArmReport {
                arm: ArmIndex::Third,
                parameters: numbers(ARM),
                transmission: None,
                sigma: Some(numbers([0.015_625; 8])),
                residual_rms: number(0.031_25),
                estimated_noise: None,
                degrees_of_freedom: number(96.0),
                samples: 40,
                iterations: 5,
                termination: Termination::GradientVanished,
                start: StartUsed::Nominal,
                condition: number(9.0),
                prior_share: numbers([0.25; 8]),
            })
        ),
        plain(
            "counted",
            Response::Counters(Counters {
                received: 1,
                damaged: 2,
                unknown_version: 3,
                unknown_request: 4,
                repeated: 5,
                lost: 6,
                refused: 7,
                overrun: 8,
            })
        ),
    ]
}

/// As a receiver reads a frame: its one message.
fn read<M: Wire>(direction: Direction, bytes: &[u8]) -> Option<M> {
    let mut receiver = Receiver::<LARGEST_FRAME>::new(direction);
    let mut message = None;
    for byte in bytes {
        if let Some(frame) = receiver.push(*byte) {
            let frame = frame.unwrap();
            assert_eq!(frame.sequence, SEQUENCE);
            assert!(message.is_none());
            message = frame.message();
        }
    }
    message
}

fn compare<M: Wire + PartialEq + Debug>(
    golden: &mut BTreeMap<&str, Vec<u8>>,
    direction: Direction,
    messages: Vec<(String, M)>,
    seen: &mut Vec<String>,
) {
    for (name, message) in messages {
        if seen.contains(&name) {
            continue;
        }
        let bytes = golden.remove(&*name).unwrap();
        let sent = encode(direction, SEQUENCE, &message).unwrap();
        assert_eq!(sent[..], bytes, "{name}");
        assert_eq!(read(direction, &bytes), Some(message), "{name}");
        // Neither a byte less nor one more is a message.
        let mut content = [0; LARGEST_FRAME];
        let written = |message: &M, content: &mut [u8]| {
            let mut writer = Writer::new(content);
            message.put(&mut writer);
            writer.finish()
        };
        let message = read::<M>(direction, &bytes).unwrap();
        let length = written(&message, &mut content).unwrap();
        assert!(M::get(&mut Reader::new(&content[..length - 1])).is_none());
        assert_eq!(written(&message, &mut content[..length - 1]), None);
        seen.push(name);
    }
}

#[test]
fn every_frame_is_what_the_page_describes() {
    let (mut golden, mut seen) = (golden(), Vec::new());
    compare(
        &mut golden,
        Direction::Request,
        requests::<f32>("f32"),
        &mut seen,
    );
    compare(
        &mut golden,
        Direction::Request,
        requests::<f64>("f64"),
        &mut seen,
    );
    compare(
        &mut golden,
        Direction::Response,
        responses::<f32>("f32"),
        &mut seen,
    );
    compare(
        &mut golden,
        Direction::Response,
        responses::<f64>("f64"),
        &mut seen,
    );
    assert!(golden.is_empty(), "{golden:?}");
}

/// The frames on the page are among them.
#[test]
fn the_page_shows_these_frames() {
    let golden = golden();
    let page = include_str!("../../docs/protocol.md");
    let frames = page.lines().filter_map(|line| {
        let bytes: Option<Vec<u8>> = line
            .split(' ')
            .map(|byte| {
                u8::from_str_radix(byte, 16)
                    .ok()
                    .filter(|_| byte.len() == 2)
            })
            .collect();
        bytes.filter(|bytes| bytes.len() > 4)
    });
    let mut shown = 0;
    for frame in frames {
        assert!(golden.values().any(|bytes| *bytes == frame), "{frame:02x?}");
        shown += 1;
    }
    assert_eq!(shown, 10);
}

/// The numbers of refusals, faults and the like: all that the core can say of samples comes back as it was.
#[test]
fn every_reason_has_a_number_of_its_own() {
    let (arm, parameter) = (ArmIndex::Second, Parameter::Theta);
    let error = GeometryError::NonFinite(Parameter::Dx);
    let refusals = [
        Refusal::TooFewSamples {
            arm,
            samples: 4,
            needed: 8,
        },
        Refusal::Undetermined {
            arm,
            parameter,
            condition: 1e6,
        },
        Refusal::Uncertain {
            arm,
            parameter,
            sigma: 0.5,
        },
        Refusal::NotConverged {
            arm,
            iterations: 50,
        },
        Refusal::ResidualContradictsNoise {
            arm: None,
            ratio: 3.0,
        },
        Refusal::FarFromNominal {
            arm,
            parameter,
            tolerances: 9.0,
        },
        Refusal::ImpossibleGeometry { arm, error },
        Refusal::ImpossibleRobot(GeometryError::NoCommonUp),
        Refusal::WrongSide,
        Refusal::NonFinite { arm },
        Refusal::Unfinished,
    ];
    let stream = [
        StreamRefusal::Alarm(Alarm::RobotChanged { first: 7 }),
        StreamRefusal::Alarm(Alarm::EarlySamplesWrong { first: 1 << 40 }),
        StreamRefusal::TooManyRejected {
            rejected: 3,
            samples: 9,
        },
    ];
    let refusals = refusals.map(StreamRefusal::Calibration);
    let mut numbers = Vec::new();
    for refusal in refusals.iter().chain(&stream) {
        let mut bytes = [0; 32];
        let mut writer = Writer::new(&mut bytes);
        refusal.put(&mut writer);
        let length = writer.finish().unwrap();
        let mut reader = Reader::new(&bytes[..length]);
        assert_eq!(StreamRefusal::get(&mut reader), Some(*refusal));
        assert!(reader.rest().is_empty());
        assert!(!numbers.contains(&bytes[0]), "{refusal:?}");
        numbers.push(bytes[0]);
    }
    // As the C library numbers them.
    assert_eq!(numbers[..11], [70, 71, 72, 73, 74, 75, 76, 77, 78, 81, 82]);
}

/// Contents of every length about one block and a second, with a zero anywhere or nowhere: a block of 254 bytes at
/// the very end is among them.
#[test]
fn frames_of_every_length_are_received() {
    struct Raw<'a>(&'a [u8]);
    impl Wire for Raw<'_> {
        fn put(&self, to: &mut Writer<'_>) {
            to.bytes(self.0);
        }
        fn get(_: &mut Reader<'_>) -> Option<Self> {
            None
        }
    }
    for length in 230..350 {
        for round in 0..40_u8 {
            let place = |place: usize| u8::try_from(place % 251 + 1).unwrap();
            let mut content: Vec<u8> = (0..length).map(place).collect();
            content[0] = round + 1;
            if round >= 20 {
                content[usize::from(round) * 5] = 0;
            }
            let frame = encode(Direction::Request, SEQUENCE, &Raw(&content)).unwrap();
            assert!(frame[1..frame.len() - 1].iter().all(|byte| *byte != 0));
            let mut receiver = Receiver::<LARGEST_FRAME>::new(Direction::Request);
            let mut whole = 0;
            for byte in frame {
                if let Some(frame) = receiver.push(byte) {
                    assert_eq!(frame.unwrap().body(), content);
                    whole += 1;
                }
            }
            assert_eq!(whole, 1, "{length} bytes");
        }
    }
}

#[test]
fn the_fingerprint_is_the_crc_of_all_numbers_as_f64() {
    // CRC-32 by Python's zlib, of ARM three times, and of these and GEAR three times.
    assert_eq!(geometry::<f64>(false).fingerprint(), 0x625e_7790);
    assert_eq!(geometry::<f32>(true).fingerprint(), 0x0d17_c36e);
}
