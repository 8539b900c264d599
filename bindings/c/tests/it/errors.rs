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
    let noisy = |arm, ratio| Refusal::ResidualContradictsNoise { arm, ratio };
    let no_arm = |arm, error| Refusal::ImpossibleGeometry { arm, error };
    let short = GeometryError::NotPositive(Parameter::Lb);
    let no_up = Refusal::ImpossibleRobot(GeometryError::NoCommonUp);
    let unknown = Refusal::UndeterminedInstrument;
    let unusable = Refusal::UnusableInstrument;
    let many = Refusal::TooManyUnknowns { parameters: 39 };
    let (plane, point) = (Instrument::Plane(2), Instrument::Point(1));
    let infinite = Refusal::NonFinite { arm: second };
    let changed = Refusal::RobotChanged { first: 40 };
    let early = Refusal::EarlySamplesWrong { first: 5 };
    let (rejected, samples) = (9, 12);
    let rejected = Refusal::TooManyRejected { rejected, samples };
    let (dx, theta, lb) = (Parameter::Dx, Parameter::Theta, Parameter::Lb);
    for (refusal, expected, figure) in [
        (unusable(plane), [28, -1, -1, 0, 2, 2, 0, 0], 0.0),
        (many, [66, -1, -1, 0, 0, 0, 0, 0], 0.0),
        (few(second, 3, 8), [70, 1, -1, 0, 0, 0, 3, 8], 0.0),
        (undetermined(first, dx, 1e9), [71, 0, 0, 0, 0, 0, 0, 0], 1e9),
        (uncertain(third, lb, 40.5), [72, 2, 7, 0, 0, 0, 0, 0], 40.5),
        (endless(first, 50), [73, 0, -1, 0, 0, 0, 50, 0], 0.0),
        (noisy(Some(second), 3.5), [74, 1, -1, 0, 0, 0, 0, 0], 3.5),
        (noisy(None, 2.5), [74, -1, -1, 0, 0, 0, 0, 0], 2.5),
        (far(third, theta, 9.0), [75, 2, 3, 0, 0, 0, 0, 0], 9.0),
        (no_arm(first, short), [76, 0, 7, 31, 0, 0, 0, 0], 0.0),
        (no_up, [77, -1, -1, 35, 0, 0, 0, 0], 0.0),
        (Refusal::WrongSide, [78, -1, -1, 0, 0, 0, 0, 0], 0.0),
        (few_of(plane, 1, 3), [79, -1, -1, 0, 2, 2, 1, 3], 0.0),
        (unknown(Instrument::Frame), [80, -1, -1, 0, 1, 0, 0, 0], 0.0),
        (unknown(point), [80, -1, -1, 0, 3, 1, 0, 0], 0.0),
        (infinite, [81, 1, -1, 0, 0, 0, 0, 0], 0.0),
        (Refusal::Unfinished, [82, -1, -1, 0, 0, 0, 0, 0], 0.0),
        (changed, [92, -1, -1, 0, 0, 0, 40, 0], 0.0),
        (early, [93, -1, -1, 0, 0, 0, 5, 0], 0.0),
        (rejected, [94, -1, -1, 0, 0, 0, 9, 0], 0.0),
    ] {
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
