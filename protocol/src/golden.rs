//! Frames of every message, bit by bit. `golden.txt` is what `tests/goldens/generate_frames.py` makes of them from the page
//! docs/protocol.md, without this crate.

#![allow(clippy::panic, clippy::unwrap_used)]

use crate::{
    Direction, Geometry, LARGEST_FRAME, Reader, Receiver, Request, Response, Wire, Writer, encode,
};
use delta_cal::robot::GeometryError;
use delta_cal::stream::{Alarm, StreamRefusal};
use delta_cal::{ArmIndex, Parameter, Real, Refusal};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::format;
use std::vec::Vec;

const SEQUENCE: u16 = 0x1234;

/// The frames by their names; of a message with numbers of the controller's type one for each of them.
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

/// What the requests are, as `Debug` prints them. 16909060 is session 0x01020304, 2712847316 fingerprint 0xa1b2c3d4.
const REQUESTS: [(&str, &str); 11] = [
    ("identify", "Identify"),
    ("parameters", "Parameters(Nominal)"),
    (
        "begin",
        "Begin(Begin { session: 16909060, tolerance: Some((0.5, 0.0078125)), joint_zero: Some(0.125), \
         noise: Some(([0.0625, 0.0625, 0.125], 0.0)), estimator: Joint, gate: false, forgetting: Some(20.0) })",
    ),
    (
        "sample",
        "Sample(SampleMessage { session: 16909060, index: 7, joints: [0.5, 0.25, -0.125], \
         position: [1.5, -2.5, -450.0] })",
    ),
    ("solve", "Solve { session: 16909060, samples: 40 }"),
    ("status", "Status"),
    ("outcome", "Outcome { session: 16909060, arm: Third }"),
    (
        "apply",
        "Apply { session: 16909060, fingerprint: 2712847316, from: 3 }",
    ),
    ("revert", "Revert { from: 3, to: Nominal }"),
    ("counters", "Counters"),
    (
        "adopt",
        "Adopt(Adopt { from: 3, geometry: Geometry { arms: ARMS, transmissions: Some(GEARS) } })",
    ),
];

/// The same of the responses.
const RESPONSES: [(&str, &str); 10] = [
    ("fault_out_of_order", "Fault(OutOfOrder { next: 5 })"),
    ("fault_sample", "Fault(Sample(JointNonFinite(Second)))"),
    ("fault_geometry", "Fault(Geometry(NotPositive(Lb)))"),
    (
        "identity",
        "Identity(Identity { firmware: [0, 1, 2], scalar: Single, processor: 1091551809, nominal: 2712847316 })",
    ),
    (
        "parameters",
        "Parameters(Parameters { origin: Calibration, generation: 3, \
         geometry: Geometry { arms: ARMS, transmissions: None } })",
    ),
    ("taken", "Taken { session: 16909060, next: 8 }"),
    (
        "solved",
        "Status(Status { session: 16909060, phase: Solved { samples: 40, fingerprint: 2712847316 }, gate: None, \
         control: CONTROL })",
    ),
    (
        "refused",
        "Status(Status { session: 16909060, phase: CalibrationRefused { samples: 40, refusal: \
         Calibration(Undetermined { arm: First, parameter: Lb, condition: 2048.0 }) }, gate: Some(GateStatus \
         { taken: 38, untested: 8, rejected: 2, alarm: Some(RobotChanged { first: 50 }) }), control: CONTROL })",
    ),
    (
        "outcome",
        "Outcome(ArmReport { arm: Third, parameters: ARM, transmission: None, sigma: Some([0.015625, 0.015625, \
         0.015625, 0.015625, 0.015625, 0.015625, 0.015625, 0.015625]), residual_rms: 0.03125, estimated_noise: None, \
         degrees_of_freedom: 96.0, samples: 40, iterations: 5, termination: GradientVanished, start: Nominal, \
         condition: 9.0, prior_share: [0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25] })",
    ),
    (
        "counted",
        "Counters(Counters { received: 1, damaged: 2, unknown_version: 3, unknown_request: 4, repeated: 5, lost: 6, \
         refused: 7, overrun: 8 })",
    ),
];

const ARM: [f64; 8] = [164.0, 0.5, -0.25, 0.0, 0.125, 260.75, 0.5, 480.5];
const GEAR: [f64; 5] = [0.007_812_5, 0.0, -0.5, 0.25, 0.0];
const CONTROL: &str = "ControlLoop { turns: 1000, longest_ticks: 850, longest_ticks_calibrating: 851, \
                       ticks_a_second: 25000000, late: 0, unreachable: 0, switches: 1, fingerprint: 2712847316, \
                       point: [1.5, -2.5, -450.0], joints: [0.5, 0.25, -0.125] }";

/// As a receiver reads a frame: its one message.
fn read<M: Wire>(direction: Direction, bytes: &[u8]) -> M {
    let mut receiver = Receiver::<LARGEST_FRAME>::new(direction);
    let mut message = None;
    for byte in bytes {
        if let Some(frame) = receiver.push(*byte) {
            let frame = frame.unwrap();
            assert_eq!(frame.sequence, SEQUENCE);
            assert!(message.is_none());
            message = Some(frame.message().unwrap());
        }
    }
    message.unwrap()
}

/// Read from the frame of this name, and written again.
fn compare<M: Wire + Debug>(
    golden: &mut BTreeMap<&str, Vec<u8>>,
    direction: Direction,
    scalar: &str,
    messages: &[(&str, &str)],
) {
    for (name, expected) in messages {
        // `parameters` is a request without numbers, and a response with them.
        let (plain, scaled) = (golden.get(name).cloned(), format!("{name}_{scalar}"));
        let bytes = match direction {
            Direction::Request => plain.or_else(|| golden.remove(&*scaled)),
            Direction::Response => golden.remove(&*scaled).or(plain),
        };
        let bytes = bytes.unwrap_or_else(|| panic!("{name}"));
        let message: M = read(direction, &bytes);
        let expected = expected
            .replace("CONTROL", CONTROL)
            .replace("ARMS", &format!("{:?}", [ARM; 3]))
            .replace("ARM,", &format!("{ARM:?},"))
            .replace("GEARS", &format!("{:?}", [GEAR; 3]));
        assert_eq!(format!("{message:?}"), expected, "{name}");
        assert_eq!(encode(direction, SEQUENCE, &message).unwrap()[..], bytes);
        // A byte less is no message.
        let mut content = [0; LARGEST_FRAME];
        let mut writer = Writer::new(&mut content);
        message.put(&mut writer);
        let length = writer.finish().unwrap();
        assert!(M::get(&mut Reader::new(&content[..length - 1])).is_none());
        let mut short = Writer::new(&mut content[..length - 1]);
        message.put(&mut short);
        assert_eq!(short.finish(), None);
    }
}

#[test]
fn every_frame_is_what_the_page_describes() {
    let mut golden = golden();
    compare::<Request<f32>>(&mut golden, Direction::Request, "f32", &REQUESTS);
    compare::<Request<f64>>(&mut golden, Direction::Request, "f64", &REQUESTS);
    compare::<Response<f32>>(&mut golden, Direction::Response, "f32", &RESPONSES);
    compare::<Response<f64>>(&mut golden, Direction::Response, "f64", &RESPONSES);
    let all = REQUESTS.iter().chain(&RESPONSES);
    golden.retain(|name, _| !all.clone().any(|(known, _)| known == name));
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
    fn numbers<T: Real, const N: usize>(values: [f64; N]) -> [[T; N]; 3] {
        [values.map(T::from_f64); 3]
    }
    let plain = Geometry::<f64> {
        arms: numbers(ARM),
        transmissions: None,
    };
    let geared = Geometry::<f32> {
        arms: numbers(ARM),
        transmissions: Some(numbers(GEAR)),
    };
    assert_eq!(plain.fingerprint(), 0x625e_7790);
    assert_eq!(geared.fingerprint(), 0x0d17_c36e);
}
