//! Calibration step by step.

use crate::numbers::{Bits, Source, finite_outcome};
use delta_cal::calibration::{Calibrator, Estimator};
use delta_cal::{IkmCalibrator, JointCalibrator, Progress, RobotOutcome, Sample, Settings};

const MOST_SAMPLES: usize = 40;
/// Most starts per arm, and most rounds of balancing the tolerance, as in the core's tests.
const STARTS: u32 = 40;
/// Steps per iteration of an arm: a linearisation, the damping of eight rows in two to four pieces, and a trial. The seed
/// `many_rounds_f64` takes 14,323 in all.
const ARM_PIECES: u32 = 6;
/// The same with 24 rows; a covariance takes fewer.
pub(crate) const JOINT_PIECES: u32 = 16;
/// Steps of a start or round besides its iterations: it is settled, its covariance cleared, computed and compared.
const JUDGED: u32 = 4;

in_either_precision!(solver, calibration);

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
    take_in(&mut calibrator, &taken, order, forget);
    if let Some(outcome) = solved(&mut calibrator, ARM_PIECES) {
        finite_outcome(&outcome);
        not_worse(&mut calibrator, &outcome);
    }
    let mut calibrator = JointCalibrator::new(&robot, &settings);
    take_in(&mut calibrator, &taken, order, forget);
    if let Some(outcome) = solved(&mut calibrator, JOINT_PIECES) {
        finite_outcome(&RobotOutcome::from(&outcome));
        let mut all = outcome.estimate.covariance.iter().flatten();
        assert!(all.all(|entry| entry.finite()), "{outcome:?}");
    }
}

/// Adds samples one by one, many at once, or through another calibrator.
fn take_in<T: Bits, E: Estimator>(
    calibrator: &mut Calibrator<T, E>,
    samples: &[Sample<T>],
    order: u8,
    forget: T,
) {
    let (first, rest) = samples.split_at(samples.len() * usize::from(order & 0xf) / 15);
    for sample in first {
        assert_eq!(calibrator.add(sample), Ok(()));
    }
    let many = |calibrator: &mut Calibrator<T, E>| {
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
        let mut other = Calibrator::new(&calibrator.robot(), calibrator.settings());
        many(&mut other);
        assert_eq!(calibrator.merge(&other), Ok(()));
    }
    assert_eq!(calibrator.samples(), samples.len() as u64);
    if order & 0x40 != 0 {
        assert_eq!(calibrator.forget(forget), Ok(()));
    }
}

/// The result, if accepted, after at most so many steps an iteration.
fn solved<T: Bits, E: Estimator>(
    calibrator: &mut Calibrator<T, E>,
    pieces: u32,
) -> Option<E::Outcome<T>> {
    let settings = *calibrator.settings();
    calibrator.solve().ok()?;
    let mut left = pieces * steps(&settings);
    while calibrator.step() == Progress::Working {
        left -= 1;
        assert!(left > 0, "no end: {settings:?}");
    }
    let outcome = calibrator.outcome().cloned();
    if let Err(refusal) = &outcome {
        assert!(!refusal.to_string().is_empty());
        let again = calibrator.calibrate().err();
        assert_eq!(
            again.map(|again| again.to_string()),
            Some(refusal.to_string())
        );
    }
    outcome.ok()
}

/// An upper limit of the iterations, of all starts and rounds, that a calibration with these settings takes.
pub(crate) fn steps<T: Bits>(settings: &Settings<T>) -> u32 {
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
