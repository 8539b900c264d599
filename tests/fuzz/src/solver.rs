//! Calibration step by step.

use crate::numbers::{Bits, Source, finite_outcome};
use delta_cal::{
    IkmCalibrator, JointCalibrator, Progress, Real, Robot, RobotOutcome, Sample, Settings,
};

const MOST_SAMPLES: usize = 40;
/// Most starts per arm, and most rounds of balancing the tolerance, as in the core's tests.
const STARTS: u32 = 40;
/// Steps per iteration of an arm: a linearisation, the damping of eight rows in two to four pieces, and a trial. The seed
/// `many_rounds_f64` takes 14,323 in all.
const ARM_PIECES: u32 = 6;
/// The same with 24 rows; a covariance takes fewer.
const JOINT_PIECES: u32 = 16;
/// Steps of a start or round besides its iterations: it is settled, its covariance cleared, computed and compared.
const JUDGED: u32 = 4;

/// The first byte selects `f32` or `f64`.
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

/// Calibrates all 24 parameters together from the same samples.
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
            finite_outcome(&RobotOutcome::from(outcome));
            let all = outcome.estimate.covariance.iter().flatten();
            assert!(all.copied().all(Real::finite), "{outcome:?}");
        }
    }
}

/// Adds samples one by one, many at once, or through another calibrator.
fn take_in<T: Bits>(calibrator: &mut IkmCalibrator<T>, samples: &[Sample<T>], order: u8) {
    let (first, rest) = samples.split_at(samples.len() * usize::from(order & 0xf) / 15);
    for sample in first {
        assert_eq!(calibrator.add(sample), Ok(()));
    }
    let many = |calibrator: &mut IkmCalibrator<T>| {
        // In two parts, the second after a refused batch that must change nothing.
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

/// The result, if accepted, after a bounded number of steps.
fn solved<T: Bits>(calibrator: &mut IkmCalibrator<T>) -> Option<RobotOutcome<T>> {
    let settings = *calibrator.settings();
    calibrator.solve().ok()?;
    let mut left = ARM_PIECES * steps(&settings);
    while calibrator.step() == Progress::Working {
        left -= 1;
        assert!(left > 0, "no end: {settings:?}");
    }
    let outcome = match calibrator.outcome() {
        Ok(outcome) => outcome,
        Err(refusal) => {
            assert!(!refusal.to_string().is_empty());
            let again = calibrator.calibrate();
            assert_eq!(
                again.map_err(|again| again.to_string()),
                Err(refusal.to_string())
            );
            return None;
        }
    };
    finite_outcome(outcome);
    Some(outcome.clone())
}

/// An upper limit of the iterations, of all starts and rounds, that a calibration with these settings takes.
fn steps<T: Bits>(settings: &Settings<T>) -> u32 {
    3 * STARTS * (u32::from(settings.iteration_limit) + 1 + JUDGED)
}

/// Up to rounding, an iteration ends with residuals no larger than those of the nominal robot at which it started.
fn not_worse<T: Bits>(calibrator: &mut IkmCalibrator<T>, outcome: &RobotOutcome<T>) {
    if calibrator.settings().free_start {
        return;
    }
    calibrator.flush();
    let before = calibrator.robot();
    let (sums, after) = (
        calibrator.sums_of_squares(&before),
        calibrator.sums_of_squares(&outcome.robot),
    );
    for (arm, (most, least)) in before.arms().iter().zip(sums.into_iter().zip(after)) {
        // Σ (f/σf)² as rounded in the factor's rows: each is a sum of terms as large as the unit of length, times a
        // weight.
        let weight = match calibrator.settings().noise {
            None => T::ONE,
            Some(noise) => arm.lb().power_of_two_below() / noise.position(),
        };
        let rounding = T::from_f64(1e3) * T::EPSILON * weight;
        let samples = T::from_count(calibrator.samples());
        let margin = rounding * (most * samples).square_root() + rounding.squared() * samples;
        assert!(
            least <= most * T::from_f64(1.001) + margin,
            "{least:?} after {most:?}, margin {margin:?}"
        );
    }
}
