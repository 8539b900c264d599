//! Parts of messages of which the page shows the bytes without a frame.

use super::pieces::Pieces;
use super::responses::innovation;
use super::values::SAMPLES;
use crate::{Fault, Phase};
use delta_cal::calibration::Instrument;
use delta_cal::observations::ObservationError;
use delta_cal::robot::GeometryError;
use delta_cal::samples::SampleError;
use delta_cal::stream::{Added, Alarm, HeldOutRefusal, StreamRefusal, Untested, Verdict};
use delta_cal::{ArmIndex, Parameter, Refusal};
use postcard::to_slice;
use serde::Serialize;
use std::vec::Vec;

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
    let observations = [
        (
            "fault-observation-joints",
            ObservationError::Joints(SampleError::JointNonFinite(arm)),
        ),
        ("fault-observation-nothing", ObservationError::Nothing),
        ("fault-observation-non-finite", ObservationError::NonFinite),
        (
            "fault-observation-distance",
            ObservationError::DistanceNotPositive,
        ),
        ("fault-observation-point", ObservationError::NoSuchPoint(2)),
        ("fault-observation-same-place", ObservationError::SamePlace),
    ];
    let phases = [
        ("phase-idle", Phase::Idle),
        ("phase-collecting", Phase::Collecting { samples: SAMPLES }),
        ("phase-solving", Phase::Solving { arm: Some(arm) }),
        ("phase-solving-all", Phase::Solving { arm: None }),
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
        (
            "refusal-transmission-impossible",
            impossible(GeometryError::TransmissionTooLarge),
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
        (
            "refusal-transmission",
            Refusal::UndeterminedInstrument(Instrument::Transmission(arm)),
        ),
        ("refusal-non-finite", Refusal::NonFinite { arm }),
        ("refusal-unfinished", Refusal::Unfinished),
    ];
    let faults = faults.into_iter().map(|(name, error)| {
        let fault = Fault::Sample(error);
        part(name, &fault, |pieces| pieces.fault(fault))
    });
    let observations = observations.into_iter().map(|(name, error)| {
        let fault = Fault::Observation(error);
        part(name, &fault, |pieces| pieces.fault(fault))
    });
    let faults = faults.chain(observations);
    let phases = phases
        .into_iter()
        .map(|(name, phase)| part(name, &phase, |pieces| pieces.phase(&phase)));
    let refusals = refusals
        .into_iter()
        .map(|(name, refusal)| part(name, &refusal, |pieces| pieces.refusal(&refusal)));
    faults
        .chain(phases)
        .chain(refusals)
        .chain(of_streams())
        .collect()
}

fn of_streams() -> Vec<(&'static str, Pieces)> {
    let arm = ArmIndex::Second;
    let added = [
        ("added-held-out", Added::HeldOut),
        (
            "added-taken",
            Added::Tested(Verdict::Taken(innovation::<f32>())),
        ),
        (
            "added-untested",
            Added::Tested(Verdict::Untested(Untested::NoEstimate)),
        ),
    ];
    let refusals = [
        ("stream-held-out-every", HeldOutRefusal::Every),
        ("stream-held-out-none", HeldOutRefusal::NoSamples { arm }),
        ("stream-held-out-noise", HeldOutRefusal::NoNoise { arm }),
        (
            "stream-held-out-contradicted",
            HeldOutRefusal::Contradicted { arm, ratio: 2.5 },
        ),
        (
            "stream-held-out-overfitted",
            HeldOutRefusal::Overfitted { arm, ratio: 12.5 },
        ),
    ];
    let refusals = refusals
        .into_iter()
        .map(|(name, refusal)| (name, StreamRefusal::HeldOut(refusal)))
        .chain([
            (
                "stream-alarm",
                StreamRefusal::Alarm(Alarm::EarlySamplesWrong { first: 8 }),
            ),
            (
                "stream-too-many-rejected",
                StreamRefusal::TooManyRejected {
                    rejected: 16,
                    samples: 60,
                },
            ),
        ]);
    let added = added
        .into_iter()
        .map(|(name, added)| part(name, &added, |pieces| pieces.added(&added)));
    let refusals = refusals
        .map(|(name, refusal)| part(name, &refusal, |pieces| pieces.stream_refusal(&refusal)));
    added.chain(refusals).collect()
}
