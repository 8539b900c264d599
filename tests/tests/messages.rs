//! What an error says: every message names what is at fault, with its figures.

use delta_cal::calibration::{Instrument, ToleranceError};
use delta_cal::classical::StoredError;
use delta_cal::frame::AlignmentError;
use delta_cal::kinematics::{JointLimitsError, KinematicsError, Singularity};
use delta_cal::observations::{ObservationError, PrepareError, RobustObservationError};
use delta_cal::robot::GeometryError;
use delta_cal::robust::RobustRefusal;
use delta_cal::samples::{MergeError, NoiseError, SampleError};
use delta_cal::simulate::PoseError;
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::{
    AddError, Alarm, ForgettingError, GateError, HeldOutRefusal, StreamRefusal,
};
use delta_cal::{ArmIndex, Parameter, Refusal};

/// An error's message, and words that its reader cannot do without.
fn says(error: &dyn core::error::Error, words: &[&str]) {
    let message = error.to_string();
    for word in words {
        assert!(message.contains(word), "{message:?} without {word:?}");
    }
}

#[test]
fn kinematics_errors_name_arm_and_kind() {
    let (first, second, third) = (ArmIndex::First, ArmIndex::Second, ArmIndex::Third);
    let unreachable = KinematicsError::Unreachable(third);
    says(&unreachable, &["unreachable", "arm 3"]);
    assert_eq!(unreachable.arm(), third);
    let serial = KinematicsError::Singular(second, Singularity::Serial);
    says(&serial, &["type 1", "arm 2"]);
    assert_eq!(serial.arm(), second);
    let parallel = KinematicsError::Singular(third, Singularity::Parallel);
    says(&parallel, &["type 2", "arm 3"]);
    assert_eq!(parallel.arm(), third);
    let not_finite = KinematicsError::NonFinite(first);
    says(&not_finite, &["not finite", "arm 1"]);
    assert_eq!(not_finite.arm(), first);
}

#[test]
fn snapshot_errors_say_what_the_bytes_are() {
    says(&SnapshotError::BufferTooShort, &["buffer", "shorter"]);
    says(&SnapshotError::Damaged, &["not a whole snapshot"]);
    let version = SnapshotError::OtherVersion { version: 7 };
    says(&version, &["unknown version 7"]);
    says(&SnapshotError::OtherKind, &["another kind"]);
    says(&SnapshotError::OtherCalibration, &["another robot"]);
    says(&SnapshotError::Busy, &["while solving"]);
}

#[test]
fn geometry_errors_name_the_parameter() {
    for (parameter, symbol) in Parameter::ROTARY
        .into_iter()
        .zip(["Dx", "Dy", "Dz", "theta", "alpha", "La_x", "La_y", "Lb"])
    {
        assert_eq!(parameter.to_string(), symbol);
        says(&GeometryError::NonFinite(parameter), &[symbol, "finite"]);
        says(
            &GeometryError::NotPositive(parameter),
            &[symbol, "greater than 0"],
        );
    }
    says(&GeometryError::TiltTooLarge, &["alpha", "90°"]);
    says(&GeometryError::AzimuthTooLarge, &["theta", "360°"]);
    says(&GeometryError::RadiusInvalid, &["radii", "negative"]);
    says(&GeometryError::NoCommonUp, &["up", "cancel"]);
    says(&GeometryError::LeanTooLarge, &["tower", "90°"]);
    says(&GeometryError::MixedDrives, &["rotary", "linear"]);
    let symbols = ["Dx", "Dy", "Dz", "lean_x", "lean_y", "scale", "Lb"];
    for (parameter, symbol) in Parameter::LINEAR.into_iter().zip(symbols) {
        assert_eq!(parameter.to_string(), symbol);
    }
}

#[test]
fn sample_errors_name_the_arm() {
    let arm = ArmIndex::Second;
    says(&SampleError::PositionNonFinite, &["position", "finite"]);
    says(&SampleError::PositionTooFar(arm), &["position", "arm 2"]);
    says(
        &SampleError::JointNonFinite(arm),
        &["joint", "arm 2", "finite"],
    );
    says(
        &SampleError::JointTooLarge(arm),
        &["joint", "arm 2", "two turns"],
    );
    says(&StoredError::Full, &["full"]);
    let stored = StoredError::Sample(SampleError::JointTooLarge(arm));
    assert_eq!(
        stored.to_string(),
        SampleError::JointTooLarge(arm).to_string()
    );
}

#[test]
fn errors_of_numbers_name_the_number() {
    says(&NoiseError::Position, &["position noise", "greater than 0"]);
    says(&NoiseError::Joint, &["joint noise", "0 or greater"]);
    says(&ToleranceError::Length, &["tolerance", "lengths"]);
    says(&ToleranceError::Angle, &["tolerance", "angles"]);
    says(&ToleranceError::Zero, &["tolerance", "zero"]);
    says(&ToleranceError::Scale, &["tolerance", "scales"]);
    says(&ToleranceError::Radius, &["tolerance", "common radius"]);
    says(&JointLimitsError::NonFinite, &["limit", "finite"]);
    says(&JointLimitsError::Empty, &["smallest", "largest"]);
    says(&JointLimitsError::TooWide, &["more than one turn"]);
    says(&PoseError, &["pose", "10,000"]);
    says(&AlignmentError::TooFewPoints, &["three points"]);
    says(&AlignmentError::Collinear, &["line"]);
    says(&AlignmentError::NonFinite, &["finite"]);
    says(&MergeError::DifferentNominal, &["nominal arm", "noise"]);
}

#[test]
fn refusals_name_the_arm_and_their_figures() {
    let arm = ArmIndex::Third;
    let parameter = Parameter::LaX;
    let of_an_arm: [(Refusal, &[&str]); 8] = [
        (
            Refusal::TooFewSamples {
                arm,
                samples: 7,
                needed: 8,
            },
            &["7", "8"],
        ),
        (
            Refusal::Undetermined {
                arm,
                parameter,
                condition: 3e9,
            },
            &["La_x", "3.0e9"],
        ),
        (
            Refusal::Uncertain {
                arm,
                parameter,
                sigma: 0.25,
            },
            &["La_x", "2.500e-1"],
        ),
        (
            Refusal::NotConverged {
                arm,
                iterations: 50,
            },
            &["50"],
        ),
        (
            Refusal::ResidualContradictsNoise {
                arm: Some(arm),
                ratio: 12.34,
            },
            &["12.3"],
        ),
        (
            Refusal::FarFromNominal {
                arm,
                parameter,
                tolerances: 9.87,
            },
            &["La_x", "9.9"],
        ),
        (
            Refusal::ImpossibleGeometry {
                arm,
                error: GeometryError::TiltTooLarge,
            },
            &["alpha"],
        ),
        (Refusal::NonFinite { arm }, &["overflow"]),
    ];
    for (refusal, words) in of_an_arm {
        says(&refusal, words);
        says(&refusal, &["arm 3"]);
        assert_eq!(refusal.arm(), Some(arm));
    }
    let of_none: [(Refusal, &str); 3] = [
        (Refusal::ImpossibleRobot(GeometryError::NoCommonUp), "up"),
        (Refusal::WrongSide, "upside down"),
        (Refusal::Unfinished, "not finished"),
    ];
    for (refusal, word) in of_none {
        says(&refusal, &[word]);
        assert_eq!(refusal.arm(), None);
    }
}

#[test]
fn robust_refusals_name_their_figures() {
    says(
        &RobustRefusal::TooFewSamples {
            samples: 15,
            needed: 16,
        },
        &["15", "16"],
    );
    says(
        &RobustRefusal::TooManySuspected {
            suspected: 30,
            samples: 60,
        },
        &["30", "60"],
    );
    says(&RobustRefusal::NoRoom { samples: 61 }, &["61"]);
    says(
        &RobustRefusal::Sample(7, SampleError::PositionNonFinite),
        &["7", "position"],
    );
    says(
        &RobustRefusal::from(Refusal::NonFinite {
            arm: ArmIndex::Second,
        }),
        &["arm 2"],
    );
}

#[test]
fn messages_name_what_is_at_fault() {
    let arm = ArmIndex::Second;
    says(&HeldOutRefusal::Every, &["one sample in two"]);
    says(&HeldOutRefusal::NoSamples { arm }, &["arm 2", "held out"]);
    says(&HeldOutRefusal::NoNoise { arm }, &["arm 2", "noise"]);
    let contradicted = HeldOutRefusal::Contradicted { arm, ratio: 2.34 };
    says(&contradicted, &["arm 2", "2.3"]);
    let overfitted = HeldOutRefusal::Overfitted { arm, ratio: 12.4 };
    says(&overfitted, &["arm 2", "12"]);
    for refusal in [contradicted, overfitted, HeldOutRefusal::NoNoise { arm }] {
        assert_eq!(refusal.arm(), Some(arm));
    }
    says(&GateError::Sigmas, &["sigma", "greater than 0"]);
    says(&ForgettingError::TooShort, &["one sample or more"]);
    says(&ForgettingError::TooLong, &["mean age", "too large"]);
    let changed = Alarm::RobotChanged { first: 17 };
    let early = Alarm::EarlySamplesWrong { first: 5 };
    assert!(changed.to_string().contains("17") || changed.to_string().contains("18"));
    assert!(early.to_string().contains('5') || early.to_string().contains('6'));
    assert_eq!((changed.first(), early.first()), (17, 5));
}

#[test]
fn instruments_are_named_with_their_number() {
    let named = [
        (Instrument::Frame, "frame"),
        (Instrument::Plane(2), "plane 2"),
        (Instrument::Point(5), "point 5"),
        (Instrument::Transmission(ArmIndex::Second), "arm 2"),
    ];
    for (instrument, words) in named {
        assert!(instrument.to_string().contains(words), "{instrument}");
        says(&Refusal::UndeterminedInstrument(instrument), &[words]);
    }
}

#[test]
fn errors_of_observations_name_the_row_and_what_is_wrong() {
    let wrong = ObservationError::SamePlace;
    says(&wrong, &["distance"]);
    let row = PrepareError::Row {
        index: 7,
        error: wrong,
    };
    says(&row, &["observation 7", &wrong.to_string()]);
    let no_room = PrepareError::TooManyUnknowns { parameters: 43 };
    says(&no_room, &["room", "43"]);
    let refusal = Refusal::Unfinished;
    says(&PrepareError::Refused(refusal), &[&refusal.to_string()]);
    says(&RobustObservationError::Prepare(row), &[&row.to_string()]);
    let few = RobustRefusal::TooFewSamples {
        samples: 15,
        needed: 16,
    };
    says(&RobustObservationError::Refused(few), &[&few.to_string()]);
}

#[test]
fn errors_of_streams_say_what_they_come_from() {
    says(&AddError::Busy, &["solving", "wait"]);
    let faulty = SampleError::PositionNonFinite;
    says(&AddError::Sample(faulty), &[&faulty.to_string()]);
    let refusal = Refusal::Unfinished;
    says(
        &StreamRefusal::Calibration(refusal),
        &[&refusal.to_string()],
    );
    let alarm = Alarm::RobotChanged { first: 31 };
    says(&StreamRefusal::Alarm(alarm), &[&alarm.to_string()]);
    let rejected = StreamRefusal::TooManyRejected {
        rejected: 9,
        samples: 40,
    };
    says(&rejected, &["9", "40"]);
}
