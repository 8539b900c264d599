//! What an error says: every message names what is at fault, with its figures.

use delta_cal::calibration::Instrument;
use delta_cal::observations::{ObservationError, PrepareError};
use delta_cal::robot::GeometryError;
use delta_cal::samples::SampleError;
use delta_cal::stream::{Alarm, ForgettingError, GateError};
use delta_cal::{ArmIndex, Parameter, Refusal};

/// An error's message, and words that its reader cannot do without.
fn says(error: &dyn core::error::Error, words: &[&str]) {
    let message = error.to_string();
    for word in words {
        assert!(message.contains(word), "{message:?} without {word:?}");
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
fn messages_name_what_is_at_fault() {
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
}
