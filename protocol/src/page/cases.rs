//! The messages of which the page shows the bytes.

use super::described::Message;
use super::pieces::Bits;
use crate::{
    Adopt, ArmReport, Begin, BeginObservations, ControlLoop, Counters, CovarianceBlock, Fault,
    GateStatus, Geometry, Identity, ObservationMessage, Origin, ParameterSet, Parameters, Phase,
    Places, PlaneMessage, PointMessage, Request, Response, RevertTo, SampleMessage, Scalar, Status,
    UNKNOWN_SEQUENCE,
};
use delta_cal::calibration::{StartUsed, Termination};
use delta_cal::observations::{DistanceFrom, ObservationError};
use delta_cal::robot::GeometryError;
use delta_cal::samples::SampleError;
use delta_cal::stream::{
    Added, Alarm, Estimator, GateCounts, Innovation, StreamRefusal, Validation, Verdict,
};
use delta_cal::{ArmIndex, Parameter, Refusal};
use postcard::{from_bytes, to_slice};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::vec;
use std::vec::Vec;

/// Of every frame but one.
pub(super) const SEQUENCE: u16 = 0x1234;
const SESSION: u32 = 300;
pub(super) const SAMPLES: u32 = 20;
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

fn transmissions<T: Bits>() -> [[T; 5]; 3] {
    [
        [0.0; 5],
        [0.001, 0.0005, -0.0005, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.00025, -0.0001],
    ]
    .map(numbers)
}

pub(super) fn geometry<T: Bits>(with_transmissions: bool) -> Geometry<T> {
    Geometry {
        arms: arms(),
        transmissions: with_transmissions.then(transmissions),
    }
}

fn numbers<T: Bits, const N: usize>(numbers: [f64; N]) -> [T; N] {
    numbers.map(T::from_f64)
}

/// Of a type that only its own crate constructs: its fields in their order are its bytes.
fn of_fields<F: Serialize, V: DeserializeOwned>(fields: F) -> V {
    let mut buffer = [0; 64];
    from_bytes(to_slice(&fields, &mut buffer).unwrap()).unwrap()
}

pub(super) fn innovation<T: Bits + Serialize + DeserializeOwned>() -> Innovation<T> {
    let [distance, normalized] = numbers::<T, 2>([-3.5, -123.5]);
    of_fields((ArmIndex::Second, distance, normalized))
}

fn gate(alarm: Option<Alarm>) -> GateStatus {
    let mut counts = GateCounts::default();
    (counts.taken, counts.untested, counts.rejected) = (300, 12, 9);
    counts.rejected_by_arm = [9, 2, 0];
    (counts.run, counts.longest_run) = (8, 8);
    GateStatus { counts, alarm }
}

fn status<T: Bits>(phase: Phase, gate: Option<GateStatus>) -> Response<T> {
    Response::Status(Status {
        session: SESSION,
        phase,
        gate,
        control: ControlLoop {
            turns: 123_456,
            longest_ticks: 1400,
            longest_ticks_calibrating: 1500,
            ticks_a_second: 25_000_000,
            late: 0,
            unreachable: 0,
            switches: 1,
            fingerprint: geometry::<T>(false).fingerprint(),
            point: numbers([100.0, -50.0, -500.0]),
            joints: numbers([0.5, 0.25, -0.125]),
        },
    })
}

fn columns<T: Bits>() -> [[T; 8]; 8] {
    let mut columns = [[T::ZERO; 8]; 8];
    for (index, column) in columns.iter_mut().enumerate() {
        for (row, entry) in column.iter_mut().enumerate() {
            // Without a zero byte, so that the frame has blocks of 254.
            let distance = u32::try_from(row.abs_diff(index)).unwrap();
            *entry = T::from_f64(1.0 / f64::from(3 + 3 * distance));
        }
    }
    columns
}

fn report<T: Bits + Serialize + DeserializeOwned>(covariance: bool) -> Response<T> {
    let [parameters, ..] = arms();
    let validation = numbers::<T, 5>([10.0, 0.75, 0.875, 8.5, 24.0]);
    Response::Outcome(ArmReport {
        arm: ArmIndex::First,
        parameters,
        transmission: (!covariance).then(|| transmissions()[0]),
        covariance: covariance.then(columns),
        residual_rms: T::from_f64(0.75),
        estimated_noise: covariance.then_some(T::from_f64(0.03125)),
        degrees_of_freedom: T::from_f64(12.0),
        samples: SAMPLES.into(),
        iterations: 5,
        termination: Termination::GradientVanished,
        start: StartUsed::Nominal,
        condition: T::from_f64(40.0),
        prior_share: numbers([0.5, 0.25, 0.125, 0.0, 0.0, 0.25, 0.5, 1.0]),
        held_out: covariance.then(|| of_fields::<_, Validation<T>>(validation)),
    })
}

#[allow(clippy::too_many_lines)] // a table
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
                noise: Some((numbers([0.0625, 0.0625, 0.125]), T::ZERO)),
                without_guess: false,
                estimator: Estimator::Joint,
                gate: true,
                held_out: None,
                forgetting: Some(T::from_f64(50.0)),
            }),
        ),
        (
            "begin-without",
            Request::Begin(Begin {
                session: u32::MAX,
                tolerance: None,
                noise: None,
                without_guess: true,
                estimator: Estimator::Arms,
                gate: false,
                held_out: Some(4),
                forgetting: None,
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
        (
            "get-covariance",
            Request::Covariance {
                session: SESSION,
                rows: ArmIndex::First,
                columns: ArmIndex::Third,
            },
        ),
        (
            "begin-observations",
            Request::BeginObservations(begin_observations()),
        ),
        (
            "observation",
            Request::Observation(ObservationMessage {
                height: Some((1, T::from_f64(60.0))),
                distance: Some((DistanceFrom::Point(0), T::from_f64(250.5))),
                ..nothing_measured()
            }),
        ),
        (
            "observation-largest",
            Request::Observation(ObservationMessage {
                position: [100.0, -50.0, -500.1].map(|x| Some(T::from_f64(x))),
                height: Some((0, T::from_f64(60.0))),
                distance: Some((
                    DistanceFrom::Pose(numbers([0.25, 0.5, -0.125])),
                    T::from_f64(100.25),
                )),
                ..nothing_measured()
            }),
        ),
        ("get-places", Request::Places { session: SESSION }),
        (
            "adopt",
            Request::Adopt(Adopt {
                from: GENERATION,
                geometry: geometry(false),
            }),
        ),
        (
            "adopt-transmissions",
            Request::Adopt(Adopt {
                from: GENERATION,
                geometry: geometry(true),
            }),
        ),
    ]
}

/// A plane that is known, and two points, of which one is known and the other has an offset.
pub(super) fn begin_observations<T: Bits>() -> BeginObservations<T> {
    let mut planes = [PlaneMessage::default(); 4];
    planes[0].known = Some((T::from_f64(-560.0), T::from_f64(3.0)));
    planes[0].level = Some(T::from_f64(0.007_812_5));
    let mut points = [PointMessage::default(); 4];
    points[0].known = Some((numbers([0.0, 0.0, -600.0]), T::from_f64(2.0)));
    points[1].offset = true;
    BeginObservations {
        session: SESSION,
        tolerance: Some((T::from_f64(0.5), T::from_f64(0.007_812_5))),
        noise: (numbers([0.0625, 0.0625, 0.125]), T::ZERO),
        height_noise: T::from_f64(0.031_25),
        distance_noise: T::from_f64(0.015_625),
        plane_count: 1,
        planes,
        point_count: 2,
        points,
    }
}

fn nothing_measured<T: Bits>() -> ObservationMessage<T> {
    ObservationMessage {
        session: SESSION,
        index: 0,
        joints: numbers([0.5, 0.25, -0.125]),
        position: [None; 3],
        height: None,
        distance: None,
    }
}

fn faults() -> Vec<(&'static str, Fault)> {
    vec![
        ("fault-damaged", Fault::Damaged),
        ("fault-unknown-version", Fault::UnknownVersion { spoken: 4 }),
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
        (
            "fault-observation",
            Fault::Observation(ObservationError::NoSuchPlane(1)),
        ),
        (
            "fault-too-many-observations",
            Fault::TooManyObservations { capacity: 100 },
        ),
        (
            "fault-too-many-unknowns",
            Fault::TooManyUnknowns { capacity: 12 },
        ),
        ("fault-other-kind", Fault::OtherKind),
        (
            "fault-geometry",
            Fault::Geometry(GeometryError::TransmissionTooLarge),
        ),
    ]
}

#[allow(clippy::too_many_lines)] // a table
fn responses<T: Bits + Serialize + DeserializeOwned>() -> Vec<(&'static str, Response<T>)> {
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
                geometry: geometry(false),
            }),
        ),
        (
            "parameters-transmissions",
            Response::Parameters(Parameters {
                origin: Origin::Calibration,
                generation: GENERATION,
                geometry: geometry(true),
            }),
        ),
        (
            "taken",
            Response::Taken {
                session: SESSION,
                next: 1,
                last: Some(Added::Taken),
            },
        ),
        (
            "taken-none",
            Response::Taken {
                session: SESSION,
                next: 0,
                last: None,
            },
        ),
        (
            "taken-rejected",
            Response::Taken {
                session: SESSION,
                next: 1,
                last: Some(Added::Tested(Verdict::Rejected(innovation()))),
            },
        ),
        (
            "status",
            status(
                Phase::Solved {
                    samples: SAMPLES,
                    fingerprint: 0xdead_beef,
                },
                None,
            ),
        ),
        (
            "status-refused",
            status(
                Phase::CalibrationRefused {
                    samples: SAMPLES,
                    refusal: StreamRefusal::Calibration(Refusal::Undetermined {
                        arm: ArmIndex::Second,
                        parameter: Parameter::LaY,
                        condition: 1e6,
                    }),
                },
                None,
            ),
        ),
        (
            "status-gate",
            status(
                Phase::Collecting { samples: 309 },
                Some(gate(Some(Alarm::RobotChanged { first: 301 }))),
            ),
        ),
        (
            "covariance",
            Response::Covariance(CovarianceBlock {
                rows: ArmIndex::First,
                columns: ArmIndex::Third,
                covariance: Some(columns()),
            }),
        ),
        (
            "places",
            Response::Places(Places {
                planes: [
                    numbers([-559.5, 0.25, -0.125]),
                    [T::ZERO; 3],
                    [T::ZERO; 3],
                    [T::ZERO; 3],
                ],
                points: [
                    numbers([0.5, -0.25, -600.5, 0.0]),
                    numbers([700.0, -150.0, -400.0, 1.5]),
                    [T::ZERO; 4],
                    [T::ZERO; 4],
                ],
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
pub(super) fn cases<T: Bits + Serialize + DeserializeOwned>() -> Vec<Case<T>> {
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
