//! The messages of which the page shows the bytes.

use super::described::Message;
use super::pieces::{Bits, Pieces};
use crate::{
    ArmReport, Begin, ControlLoop, Counters, Fault, Identity, Origin, ParameterSet, Parameters,
    Phase, Request, Response, RevertTo, SampleMessage, Scalar, Status, UNKNOWN_SEQUENCE,
    fingerprint,
};
use delta_cal::calibration::{Instrument, StartUsed, Termination};
use delta_cal::robot::GeometryError;
use delta_cal::samples::SampleError;
use delta_cal::{ArmIndex, Parameter, Refusal};
use postcard::to_slice;
use serde::Serialize;
use std::vec;
use std::vec::Vec;

/// Of every frame but one.
pub(super) const SEQUENCE: u16 = 0x1234;
const SESSION: u32 = 300;
const SAMPLES: u32 = 20;
const GENERATION: u32 = 3;

#[derive(Debug)]
pub(super) struct Case<T> {
    pub(super) name: &'static str,
    pub(super) message: Message<T>,
}

impl<T> Case<T> {
    pub(super) fn sequence(&self) -> u16 {
        match &self.message {
            Message::Response(Response::Fault(Fault::Damaged)) => UNKNOWN_SEQUENCE,
            _ => SEQUENCE,
        }
    }
}

pub(super) fn arms<T: Bits>() -> [[T; 8]; 3] {
    let arm = |dx: f64, dy, theta| [dx, dy, 0.25, theta, 0.0, 260.75, -0.5, 480.0].map(T::from_f64);
    [
        arm(164.0, 0.0, 0.0),
        arm(-82.0, 142.0, 2.1),
        arm(-82.0, -142.0, -2.1),
    ]
}

fn numbers<T: Bits, const N: usize>(numbers: [f64; N]) -> [T; N] {
    numbers.map(T::from_f64)
}

fn status<T: Bits>(phase: Phase) -> Response<T> {
    Response::Status(Status {
        session: SESSION,
        phase,
        control: ControlLoop {
            turns: 123_456,
            longest_ticks: 1400,
            longest_ticks_calibrating: 1500,
            ticks_a_second: 25_000_000,
            late: 0,
            unreachable: 0,
            switches: 1,
            fingerprint: fingerprint(&arms::<T>()),
            point: numbers([100.0, -50.0, -500.0]),
            joints: numbers([0.5, 0.25, -0.125]),
        },
    })
}

fn report<T: Bits>(covariance: bool) -> Response<T> {
    let [parameters, ..] = arms();
    let mut columns = [[T::ZERO; 8]; 8];
    for (index, column) in columns.iter_mut().enumerate() {
        for (row, entry) in column.iter_mut().enumerate() {
            // Without a zero byte, so that the frame has blocks of 254.
            let distance = u32::try_from(row.abs_diff(index)).unwrap();
            *entry = T::from_f64(1.0 / f64::from(3 + 3 * distance));
        }
    }
    Response::Outcome(ArmReport {
        arm: ArmIndex::First,
        parameters,
        covariance: covariance.then_some(columns),
        residual_rms: T::from_f64(0.75),
        estimated_noise: covariance.then_some(T::from_f64(0.03125)),
        degrees_of_freedom: T::from_f64(12.0),
        samples: SAMPLES.into(),
        iterations: 5,
        termination: Termination::GradientVanished,
        start: StartUsed::Nominal,
        condition: T::from_f64(40.0),
        prior_share: numbers([0.5, 0.25, 0.125, 0.0, 0.0, 0.25, 0.5, 1.0]),
    })
}

fn requests<T: Bits>() -> Vec<(&'static str, Request<T>)> {
    let pair = |length, angle| Some((T::from_f64(length), T::from_f64(angle)));
    vec![
        ("identify", Request::Identify),
        ("get-current", Request::Parameters(ParameterSet::Current)),
        ("get-nominal", Request::Parameters(ParameterSet::Nominal)),
        (
            "begin",
            Request::Begin(Begin {
                session: SESSION,
                tolerance: pair(0.5, 0.007_812_5),
                noise: pair(0.0625, 0.0),
                without_guess: false,
            }),
        ),
        (
            "begin-without",
            Request::Begin(Begin {
                session: u32::MAX,
                tolerance: None,
                noise: None,
                without_guess: true,
            }),
        ),
        (
            "sample",
            Request::Sample(SampleMessage {
                session: SESSION,
                index: 0,
                joints: numbers([0.5, 0.25, -0.125]),
                position: numbers([100.0, -50.0, -500.1]),
            }),
        ),
        (
            "solve",
            Request::Solve {
                session: SESSION,
                samples: SAMPLES,
            },
        ),
        ("get-status", Request::Status),
        (
            "get-outcome",
            Request::Outcome {
                session: SESSION,
                arm: ArmIndex::Second,
            },
        ),
        (
            "apply",
            Request::Apply {
                session: SESSION,
                fingerprint: 0xdead_beef,
                from: GENERATION,
            },
        ),
        (
            "revert-previous",
            Request::Revert {
                from: GENERATION,
                to: RevertTo::Previous,
            },
        ),
        (
            "revert-nominal",
            Request::Revert {
                from: GENERATION,
                to: RevertTo::Nominal,
            },
        ),
        ("get-counters", Request::Counters),
    ]
}

fn faults() -> Vec<(&'static str, Fault)> {
    vec![
        ("fault-damaged", Fault::Damaged),
        ("fault-unknown-version", Fault::UnknownVersion { spoken: 2 }),
        ("fault-unknown-request", Fault::UnknownRequest),
        ("fault-no-session", Fault::NoSession),
        ("fault-out-of-order", Fault::OutOfOrder { next: SAMPLES }),
        (
            "fault-sample",
            Fault::Sample(SampleError::JointTooLarge(ArmIndex::Third)),
        ),
        ("fault-settings", Fault::Settings),
        ("fault-busy", Fault::Busy),
        ("fault-no-outcome", Fault::NoOutcome),
        (
            "fault-other-parameters",
            Fault::OtherParameters { there: 0xdead_beef },
        ),
        ("fault-store", Fault::Store),
    ]
}

fn responses<T: Bits>() -> Vec<(&'static str, Response<T>)> {
    let identity = |scalar| {
        Response::Identity(Identity {
            firmware: [0, 1, 300],
            scalar,
            processor: 0x410f_c240,
            nominal: 0xdead_beef,
        })
    };
    vec![
        ("identity-single", identity(Scalar::Single)),
        ("identity-double", identity(Scalar::Double)),
        (
            "parameters",
            Response::Parameters(Parameters {
                origin: Origin::Calibration,
                generation: GENERATION,
                arms: arms(),
            }),
        ),
        (
            "taken",
            Response::Taken {
                session: SESSION,
                next: 1,
            },
        ),
        (
            "status",
            status(Phase::Solved {
                samples: SAMPLES,
                fingerprint: 0xdead_beef,
            }),
        ),
        (
            "status-refused",
            status(Phase::CalibrationRefused {
                samples: SAMPLES,
                refusal: Refusal::Undetermined {
                    arm: ArmIndex::Second,
                    parameter: Parameter::LaY,
                    condition: 1e6,
                },
            }),
        ),
        ("outcome", report(true)),
        ("outcome-without", report(false)),
        (
            "counters",
            Response::Counters(Counters {
                received: 1000,
                damaged: 1,
                unknown_version: 0,
                unknown_request: 0,
                repeated: 2,
                lost: 3,
                refused: 4,
                overrun: 128,
            }),
        ),
    ]
}

/// Messages in whole frames.
pub(super) fn cases<T: Bits>() -> Vec<Case<T>> {
    let requests = requests().into_iter().map(|(name, request)| Case {
        name,
        message: Message::Request(request),
    });
    let faults = faults()
        .into_iter()
        .map(|(name, fault)| (name, Response::Fault(fault)));
    let responses = faults.chain(responses()).map(|(name, response)| Case {
        name,
        message: Message::Response(response),
    });
    requests.chain(responses).collect()
}

fn part<P: Serialize>(
    name: &'static str,
    part: &P,
    describe: impl FnOnce(&mut Pieces),
) -> (&'static str, Pieces) {
    let mut pieces = Pieces::default();
    describe(&mut pieces);
    let mut buffer = [0; 64];
    let bytes = to_slice(part, &mut buffer).unwrap();
    assert_eq!(pieces.bytes(), bytes, "{name}: not as described");
    (name, pieces)
}

/// Parts of messages, without a frame.
#[allow(clippy::too_many_lines)] // a table
pub(super) fn parts() -> Vec<(&'static str, Pieces)> {
    let (arm, parameter) = (ArmIndex::Second, Parameter::Lb);
    let faults = [
        ("fault-position-non-finite", SampleError::PositionNonFinite),
        ("fault-position-too-far", SampleError::PositionTooFar(arm)),
        ("fault-joint-non-finite", SampleError::JointNonFinite(arm)),
    ];
    let phases = [
        ("phase-idle", Phase::Idle),
        ("phase-collecting", Phase::Collecting { samples: SAMPLES }),
        ("phase-solving", Phase::Solving { arm }),
    ];
    let impossible = |error| Refusal::ImpossibleGeometry { arm, error };
    let refusals = [
        (
            "refusal-too-few-samples",
            Refusal::TooFewSamples {
                arm,
                samples: 5,
                needed: 8,
            },
        ),
        (
            "refusal-uncertain",
            Refusal::Uncertain {
                arm,
                parameter,
                sigma: 50.0,
            },
        ),
        (
            "refusal-not-converged",
            Refusal::NotConverged {
                arm,
                iterations: 200,
            },
        ),
        (
            "refusal-residual",
            Refusal::ResidualContradictsNoise {
                arm: Some(arm),
                ratio: 2.5,
            },
        ),
        (
            "refusal-residual-all",
            Refusal::ResidualContradictsNoise {
                arm: None,
                ratio: 2.5,
            },
        ),
        (
            "refusal-far",
            Refusal::FarFromNominal {
                arm,
                parameter,
                tolerances: 12.5,
            },
        ),
        (
            "refusal-non-finite-parameter",
            impossible(GeometryError::NonFinite(parameter)),
        ),
        (
            "refusal-not-positive",
            impossible(GeometryError::NotPositive(parameter)),
        ),
        ("refusal-tilt", impossible(GeometryError::TiltTooLarge)),
        (
            "refusal-azimuth",
            impossible(GeometryError::AzimuthTooLarge),
        ),
        (
            "refusal-radius",
            Refusal::ImpossibleRobot(GeometryError::RadiusInvalid),
        ),
        (
            "refusal-no-common-up",
            Refusal::ImpossibleRobot(GeometryError::NoCommonUp),
        ),
        ("refusal-lean", impossible(GeometryError::LeanTooLarge)),
        (
            "refusal-mixed-drives",
            Refusal::ImpossibleRobot(GeometryError::MixedDrives),
        ),
        ("refusal-wrong-side", Refusal::WrongSide),
        (
            "refusal-too-few-observations",
            Refusal::TooFewObservations {
                instrument: Instrument::Plane(1),
                observations: 2,
                needed: 3,
            },
        ),
        (
            "refusal-point",
            Refusal::UndeterminedInstrument(Instrument::Point(0)),
        ),
        (
            "refusal-frame",
            Refusal::UndeterminedInstrument(Instrument::Frame),
        ),
        ("refusal-non-finite", Refusal::NonFinite { arm }),
        ("refusal-unfinished", Refusal::Unfinished),
    ];
    let faults = faults.into_iter().map(|(name, error)| {
        let fault = Fault::Sample(error);
        part(name, &fault, |pieces| pieces.fault(fault))
    });
    let phases = phases
        .into_iter()
        .map(|(name, phase)| part(name, &phase, |pieces| pieces.phase(&phase)));
    let refusals = refusals
        .into_iter()
        .map(|(name, refusal)| part(name, &refusal, |pieces| pieces.refusal(&refusal)));
    faults.chain(phases).chain(refusals).collect()
}
