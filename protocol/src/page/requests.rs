//! The requests of which the page shows the bytes.

use super::pieces::Bits;
use super::values::{GENERATION, SAMPLES, SESSION, geometry, numbers};
use crate::{
    Adopt, Begin, BeginObservations, ObservationMessage, ParameterSet, PlaneMessage, PointMessage,
    Request, RevertTo, SampleMessage,
};
use delta_cal::ArmIndex;
use delta_cal::observations::DistanceFrom;
use delta_cal::stream::Estimator;
use std::vec;
use std::vec::Vec;

#[allow(clippy::too_many_lines)] // a table
pub(super) fn requests<T: Bits>() -> Vec<(&'static str, Request<T>)> {
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
