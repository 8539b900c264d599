//! Every refusal of the core keeps its number and all that it says.

use delta_cal::calibration::Instrument;
use delta_cal::robot::GeometryError;
use delta_cal::{ArmIndex, Parameter, Refusal};
use delta_cal_c::error::Error;

/// Status, arm, parameter, cause, instrument, index; count, needed; figure.
type Details = ([i32; 6], [u64; 2], f32);

fn details(refusal: Refusal) -> Details {
    let error = Error::from(refusal);
    let index = i32::try_from(error.index).unwrap();
    (
        [
            error.status,
            error.arm,
            error.parameter,
            error.cause,
            error.instrument,
            index,
        ],
        [error.count, error.needed],
        error.figure,
    )
}

fn details_of_an_arm(status: i32, arm: i32, parameter: i32, figure: f32) -> Details {
    ([status, arm, parameter, 0, 0, 0], [0, 0], figure)
}

#[test]
fn every_refusal_says_all_in_c() {
    let [first, second, third] = ArmIndex::ALL;
    let few = |arm, samples, needed| Refusal::TooFewSamples {
        arm,
        samples,
        needed,
    };
    let few_of = |instrument, observations, needed| Refusal::TooFewObservations {
        instrument,
        observations,
        needed,
    };
    let undetermined = |arm, parameter, condition| Refusal::Undetermined {
        arm,
        parameter,
        condition,
    };
    let uncertain = |arm, parameter, sigma| Refusal::Uncertain {
        arm,
        parameter,
        sigma,
    };
    let far = |arm, parameter, tolerances| Refusal::FarFromNominal {
        arm,
        parameter,
        tolerances,
    };
    let endless = |arm, iterations| Refusal::NotConverged { arm, iterations };
    let contradiction = |arm, ratio| Refusal::ResidualContradictsNoise { arm, ratio };
    let no_arm = |arm, error| Refusal::ImpossibleGeometry { arm, error };
    let (short, no_up) = (
        GeometryError::NotPositive(Parameter::Lb),
        GeometryError::NoCommonUp,
    );
    let unknown = Refusal::UndeterminedInstrument;
    let of_arm = details_of_an_arm;
    for (refusal, expected) in [
        (few(second, 3, 8), ([70, 1, -1, 0, 0, 0], [3, 8], 0.0)),
        (
            undetermined(first, Parameter::Dx, 1e9),
            of_arm(71, 0, 0, 1e9),
        ),
        (
            uncertain(third, Parameter::Lb, 40.5),
            of_arm(72, 2, 7, 40.5),
        ),
        (endless(first, 50), ([73, 0, -1, 0, 0, 0], [50, 0], 0.0)),
        (contradiction(Some(second), 3.5), of_arm(74, 1, -1, 3.5)),
        (contradiction(None, 2.5), of_arm(74, -1, -1, 2.5)),
        (far(third, Parameter::Theta, 9.0), of_arm(75, 2, 3, 9.0)),
        (no_arm(first, short), ([76, 0, 7, 31, 0, 0], [0, 0], 0.0)),
        (
            Refusal::ImpossibleRobot(no_up),
            ([77, -1, -1, 35, 0, 0], [0, 0], 0.0),
        ),
        (Refusal::WrongSide, of_arm(78, -1, -1, 0.0)),
        (
            few_of(Instrument::Plane(2), 1, 3),
            ([79, -1, -1, 0, 2, 2], [1, 3], 0.0),
        ),
        (
            unknown(Instrument::Frame),
            ([80, -1, -1, 0, 1, 0], [0, 0], 0.0),
        ),
        (
            unknown(Instrument::Point(1)),
            ([80, -1, -1, 0, 3, 1], [0, 0], 0.0),
        ),
        (Refusal::NonFinite { arm: second }, of_arm(81, 1, -1, 0.0)),
        (Refusal::Unfinished, of_arm(82, -1, -1, 0.0)),
    ] {
        assert_eq!(details(refusal), expected, "{refusal:?}");
    }
}
