//! The answers of which the page shows the bytes, faults among them.

use super::pieces::Bits;
use super::values::{GENERATION, SAMPLES, SESSION, arms, geometry, numbers, transmissions};
use crate::{
    ArmReport, ControlLoop, Counters, CovarianceBlock, Fault, GateStatus, Identity, Origin,
    Parameters, Phase, Places, Response, Scalar, Status,
};
use delta_cal::calibration::{StartUsed, Termination};
use delta_cal::observations::ObservationError;
use delta_cal::robot::GeometryError;
use delta_cal::samples::SampleError;
use delta_cal::stream::{Added, Alarm, GateCounts, Innovation, StreamRefusal, Validation, Verdict};
use delta_cal::{ArmIndex, Parameter, Refusal};
use postcard::{from_bytes, to_slice};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::vec;
use std::vec::Vec;

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

pub(super) fn faults() -> Vec<(&'static str, Fault)> {
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
pub(super) fn responses<T: Bits + Serialize + DeserializeOwned>() -> Vec<(&'static str, Response<T>)>
{
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
