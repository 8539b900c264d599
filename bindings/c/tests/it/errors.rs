//! Every refusal of the core keeps its number and all that it says.

use delta_cal::calibration::Instrument;
use delta_cal::robot::GeometryError;
use delta_cal::{ArmIndex, Parameter, Refusal};
use delta_cal_c::error::Error;
use delta_cal_c::status;

/// Status, arm, parameter, cause, instrument, index, count, needed; figure.
fn details(refusal: Refusal) -> ([i64; 8], f32) {
    let error = Error::from(refusal);
    let [count, needed] = [error.count, error.needed].map(|count| i64::try_from(count).unwrap());
    let [status, arm, parameter] = [error.status, error.arm, error.parameter].map(i64::from);
    let (cause, instrument) = (error.cause.into(), error.instrument.into());
    let index = error.index.into();
    let all = [
        status, arm, parameter, cause, instrument, index, count, needed,
    ];
    (all, error.figure)
}

#[test]
fn every_refusal_says_all_in_c() {
    use Refusal::{
        EarlySamplesWrong, FarFromNominal, ImpossibleGeometry, ImpossibleRobot, NonFinite,
        NotConverged, ResidualContradictsNoise, RobotChanged, TooFewObservations, TooFewSamples,
        TooManyRejected, TooManyUnknowns, Uncertain, Undetermined, UndeterminedInstrument,
        Unfinished, UnusableInstrument, WrongSide,
    };
    let [first, second, third] = ArmIndex::ALL;
    let (dx, theta, lb) = (Parameter::Dx, Parameter::Theta, Parameter::Lb);
    let (plane, point) = (Instrument::Plane(2), Instrument::Point(1));
    let short = GeometryError::NotPositive(Parameter::Lb);
    #[rustfmt::skip]
    let all = [
        (UnusableInstrument(plane), [28, -1, -1, 0, 2, 2, 0, 0], 0.0),
        (TooManyUnknowns { parameters: 39 }, [66, -1, -1, 0, 0, 0, 0, 0], 0.0),
        (TooFewSamples { arm: second, samples: 3, needed: 8 }, [70, 1, -1, 0, 0, 0, 3, 8], 0.0),
        (Undetermined { arm: first, parameter: dx, condition: 1e9 }, [71, 0, 0, 0, 0, 0, 0, 0], 1e9),
        (Uncertain { arm: third, parameter: lb, sigma: 40.5 }, [72, 2, 7, 0, 0, 0, 0, 0], 40.5),
        (NotConverged { arm: first, iterations: 50 }, [73, 0, -1, 0, 0, 0, 50, 0], 0.0),
        (ResidualContradictsNoise { arm: Some(second), ratio: 3.5 }, [74, 1, -1, 0, 0, 0, 0, 0], 3.5),
        (ResidualContradictsNoise { arm: None, ratio: 2.5 }, [74, -1, -1, 0, 0, 0, 0, 0], 2.5),
        (FarFromNominal { arm: third, parameter: theta, tolerances: 9.0 }, [75, 2, 3, 0, 0, 0, 0, 0], 9.0),
        (ImpossibleGeometry { arm: first, error: short }, [76, 0, 7, 31, 0, 0, 0, 0], 0.0),
        (ImpossibleGeometry { arm: third, error: GeometryError::TiltTooLarge }, [76, 2, 4, 32, 0, 0, 0, 0], 0.0),
        (ImpossibleGeometry { arm: third, error: GeometryError::AzimuthTooLarge }, [76, 2, 3, 33, 0, 0, 0, 0], 0.0),
        (ImpossibleRobot(GeometryError::NoCommonUp), [77, -1, -1, 35, 0, 0, 0, 0], 0.0),
        (WrongSide, [78, -1, -1, 0, 0, 0, 0, 0], 0.0),
        (TooFewObservations { instrument: plane, observations: 1, needed: 3 }, [79, -1, -1, 0, 2, 2, 1, 3], 0.0),
        (UndeterminedInstrument(Instrument::Frame), [80, -1, -1, 0, 1, 0, 0, 0], 0.0),
        (UndeterminedInstrument(point), [80, -1, -1, 0, 3, 1, 0, 0], 0.0),
        (NonFinite { arm: second }, [81, 1, -1, 0, 0, 0, 0, 0], 0.0),
        (Unfinished, [82, -1, -1, 0, 0, 0, 0, 0], 0.0),
        (RobotChanged { first: 40 }, [92, -1, -1, 0, 0, 0, 40, 0], 0.0),
        (EarlySamplesWrong { first: 5 }, [93, -1, -1, 0, 0, 0, 5, 0], 0.0),
        (TooManyRejected { rejected: 9, samples: 12 }, [94, -1, -1, 0, 0, 0, 9, 0], 0.0),
    ];
    for (refusal, expected, figure) in all {
        assert_eq!(details(refusal), (expected, figure), "{refusal:?}");
    }
}

/// Also a number that is no status.
#[test]
fn every_status_has_a_sentence() {
    let numbers = status::ALL.iter().map(|(_, number)| *number);
    for number in numbers.chain([-1, 9999]) {
        let text = delta_cal_c::library::status_text(number);
        let text = unsafe { core::ffi::CStr::from_ptr(text) }.to_str().unwrap();
        assert!(text.ends_with('.') && text.len() > 10, "{number}: {text}");
        assert!(!text.starts_with(' '), "{number}: {text}");
    }
}
