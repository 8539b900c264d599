//! Every refusal of the core keeps its number and all that it says.

use delta_cal::calibration::Instrument;
use delta_cal::robot::GeometryError;
use delta_cal::{ArmIndex, Parameter, Refusal};
use delta_cal_c::error::Error;

/// Status, arm, parameter, cause, instrument, index, count, needed, figure.
type Details = (i32, i32, i32, i32, i32, u32, u64, u64, f32);

fn details(refusal: Refusal) -> Details {
    let error = Error::from(refusal);
    (
        error.status,
        error.arm,
        error.parameter,
        error.cause,
        error.instrument,
        error.index,
        error.count,
        error.needed,
        error.figure,
    )
}

#[test]
fn every_refusal_says_all_in_c() {
    let [first, second, third] = ArmIndex::ALL;
    for (refusal, expected) in [
        (
            Refusal::TooFewSamples {
                arm: second,
                samples: 3,
                needed: 8,
            },
            (70, 1, -1, 0, 0, 0, 3, 8, 0.0),
        ),
        (
            Refusal::Undetermined {
                arm: first,
                parameter: Parameter::Dx,
                condition: 1e9,
            },
            (71, 0, 0, 0, 0, 0, 0, 0, 1e9),
        ),
        (
            Refusal::Uncertain {
                arm: third,
                parameter: Parameter::Lb,
                sigma: 40.5,
            },
            (72, 2, 7, 0, 0, 0, 0, 0, 40.5),
        ),
        (
            Refusal::NotConverged {
                arm: first,
                iterations: 50,
            },
            (73, 0, -1, 0, 0, 0, 50, 0, 0.0),
        ),
        (
            Refusal::ResidualContradictsNoise {
                arm: Some(second),
                ratio: 3.5,
            },
            (74, 1, -1, 0, 0, 0, 0, 0, 3.5),
        ),
        (
            Refusal::ResidualContradictsNoise {
                arm: None,
                ratio: 2.5,
            },
            (74, -1, -1, 0, 0, 0, 0, 0, 2.5),
        ),
        (
            Refusal::FarFromNominal {
                arm: third,
                parameter: Parameter::Theta,
                tolerances: 9.0,
            },
            (75, 2, 3, 0, 0, 0, 0, 0, 9.0),
        ),
        (
            Refusal::ImpossibleGeometry {
                arm: first,
                error: GeometryError::NotPositive(Parameter::Lb),
            },
            (76, 0, 7, 31, 0, 0, 0, 0, 0.0),
        ),
        (
            Refusal::ImpossibleRobot(GeometryError::NoCommonUp),
            (77, -1, -1, 35, 0, 0, 0, 0, 0.0),
        ),
        (Refusal::WrongSide, (78, -1, -1, 0, 0, 0, 0, 0, 0.0)),
        (
            Refusal::TooFewObservations {
                instrument: Instrument::Plane(2),
                observations: 1,
                needed: 3,
            },
            (79, -1, -1, 0, 2, 2, 1, 3, 0.0),
        ),
        (
            Refusal::UndeterminedInstrument(Instrument::Frame),
            (80, -1, -1, 0, 1, 0, 0, 0, 0.0),
        ),
        (
            Refusal::UndeterminedInstrument(Instrument::Point(1)),
            (80, -1, -1, 0, 3, 1, 0, 0, 0.0),
        ),
        (
            Refusal::NonFinite { arm: second },
            (81, 1, -1, 0, 0, 0, 0, 0, 0.0),
        ),
        (Refusal::Unfinished, (82, -1, -1, 0, 0, 0, 0, 0, 0.0)),
    ] {
        assert_eq!(details(refusal), expected, "{refusal:?}");
    }
}
