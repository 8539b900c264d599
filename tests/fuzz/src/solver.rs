//! The calibration step by step.

use crate::numbers::{Bits, Source, finite_outcome};
use delta_cal::calibration::Start;
use delta_cal::{
    IkmCalibrator, JointCalibrator, Progress, Real, Robot, RobotOutcome, Sample, Settings,
};

const MOST_SAMPLES: usize = 40;
/// Starts of one arm and rounds of balancing the tolerance, at most; the core's tests have the same.
const STARTS: u32 = 40;
/// Steps of a linearisation, of a damping and a trial; of a covariance there are fewer.
const JOINT_PIECES: u32 = 16;

/// As in `f32`, so in `f64`, whichever the first byte says.
pub fn solver(data: &[u8]) {
    let mut source = Source::new(data);
    if source.byte() & 1 == 0 {
        calibration::<f32>(&mut source);
    } else {
        calibration::<f64>(&mut source);
    }
}

fn calibration<T: Bits>(source: &mut Source<'_>) {
    let Ok(robot) = source.robot::<T>() else {
        return;
    };
    let settings = source.settings();
    let order = source.byte();
    let forget = source.number(0.9, 0.1);
    let samples = source.samples::<T>(MOST_SAMPLES);

    let mut probe = IkmCalibrator::new(&robot, &settings);
    let mut taken: Vec<Sample<T>> = Vec::new();
    for sample in &samples {
        let before = probe.samples();
        match probe.add(sample) {
            Ok(()) => taken.push(*sample),
            Err(_) => assert_eq!(probe.samples(), before),
        }
    }
    let mut calibrator = IkmCalibrator::new(&robot, &settings);
    take_in(&mut calibrator, &taken, order);
    assert_eq!(calibrator.samples(), probe.samples());
    if order & 0x40 != 0 {
        assert_eq!(calibrator.forget(forget), Ok(()));
    }
    if let Some(outcome) = solved(&mut calibrator) {
        not_worse(&mut calibrator, &outcome);
    }
    joint(&robot, &settings, &taken, order, forget);
}

/// All 24 parameters together, of the same samples.
fn joint<T: Bits>(
    robot: &Robot<T>,
    settings: &Settings<T>,
    samples: &[Sample<T>],
    order: u8,
    forget: T,
) {
    let mut calibrator = JointCalibrator::new(robot, settings);
    let (first, rest) = samples.split_at(samples.len() * usize::from(order & 0xf) / 15);
    for sample in first {
        assert_eq!(calibrator.add(sample), Ok(()));
    }
    if order & 0x10 == 0 {
        assert_eq!(calibrator.add_many(rest), Ok(()));
    } else {
        let mut other = JointCalibrator::new(robot, settings);
        assert_eq!(other.add_many(rest), Ok(()));
        assert_eq!(calibrator.merge(&other), Ok(()));
    }
    assert_eq!(calibrator.samples(), samples.len() as u64);
    if order & 0x40 != 0 {
        assert_eq!(calibrator.forget(forget), Ok(()));
    }
    if calibrator.solve().is_err() {
        return;
    }
    let mut left = JOINT_PIECES * steps(settings);
    while calibrator.step() == Progress::Working {
        left -= 1;
        assert!(left > 0, "no end: {settings:?}");
    }
    match calibrator.outcome() {
        Err(refusal) => assert!(!refusal.to_string().is_empty()),
        Ok(outcome) => {
            finite_outcome(&RobotOutcome::from(&outcome));
            let all = outcome.estimate.covariance.iter().flatten();
            assert!(all.copied().all(Real::finite), "{outcome:?}");
        }
    }
}

/// One by one, many at once, or by way of another calibrator.
fn take_in<T: Bits>(calibrator: &mut IkmCalibrator<T>, samples: &[Sample<T>], order: u8) {
    let (first, rest) = samples.split_at(samples.len() * usize::from(order & 0xf) / 15);
    for sample in first {
        assert_eq!(calibrator.add(sample), Ok(()));
    }
    let many = |calibrator: &mut IkmCalibrator<T>| {
        // In two parts, one behind a sample that is refused and changes nothing.
        let (two, three) = rest.split_at(rest.len() / 2);
        assert_eq!(calibrator.add_many(two), Ok(()));
        let mut wrong = three.to_vec();
        if let Some(last) = wrong.last_mut() {
            last.joints = [T::INFINITY; 3];
            let before = calibrator.samples();
            assert!(calibrator.add_many(&wrong).is_err());
            assert_eq!(calibrator.samples(), before);
        }
        assert_eq!(calibrator.add_many(three), Ok(()));
    };
    if order & 0x10 == 0 {
        many(calibrator);
    } else {
        let mut other = IkmCalibrator::new(&calibrator.robot(), calibrator.settings());
        many(&mut other);
        assert_eq!(calibrator.merge(&other), Ok(()));
    }
}

/// The result, if it is accepted, after a bounded number of steps.
fn solved<T: Bits>(calibrator: &mut IkmCalibrator<T>) -> Option<RobotOutcome<T>> {
    let settings = *calibrator.settings();
    calibrator.solve().ok()?;
    let mut left = steps(&settings);
    while calibrator.step() == Progress::Working {
        left -= 1;
        assert!(left > 0, "no end: {settings:?}");
    }
    let outcome = match calibrator.outcome() {
        Ok(outcome) => outcome,
        Err(refusal) => {
            assert!(!refusal.to_string().is_empty());
            let again = calibrator.solve().and_then(|()| calibrator.outcome());
            assert_eq!(
                again.map_err(|again| again.to_string()),
                Err(refusal.to_string())
            );
            return None;
        }
    };
    finite_outcome(&outcome);
    Some(outcome)
}

/// More than any calibration of these settings takes.
fn steps<T: Bits>(settings: &Settings<T>) -> u32 {
    3 * STARTS * (u32::from(settings.iteration_limit) + 1)
}

/// An iteration from the reference ends no higher than it began, but for rounding: the samples'
/// residuals are no larger than the reference's.
fn not_worse<T: Bits>(calibrator: &mut IkmCalibrator<T>, outcome: &RobotOutcome<T>) {
    if calibrator.settings().start != Start::Nominal {
        return;
    }
    calibrator.flush();
    let before = calibrator.robot();
    let arms = before.arms().iter().zip(outcome.robot.arms());
    for (factor, (before, after)) in calibrator.arms().iter().zip(arms) {
        let (least, most) = (factor.sum_of_squares(after), factor.sum_of_squares(before));
        // Σ (f/σf)² as the factor's rows round it: each is a sum of terms as large as the unit of
        // length, times a weight.
        let reference = factor.nominal();
        let weight = match reference.noise() {
            None => T::ONE,
            Some(noise) => reference.scale() / noise.position(),
        };
        let rounding = T::from_f64(1e3) * T::EPSILON * weight;
        let samples = T::from_count(factor.samples());
        let margin = rounding * (most * samples).square_root() + rounding.squared() * samples;
        assert!(
            least <= most * T::from_f64(1.001) + margin,
            "{least:?} after {most:?}, margin {margin:?}"
        );
    }
}
