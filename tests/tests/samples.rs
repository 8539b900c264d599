//! The factor holds the same information, however it came
//! in: one by one, many at once, in any order, merged, in any unit.

use delta_cal::calibration::{Calibrator, Estimator, Ikm, Joint};
use delta_cal::samples::{MergeError, SampleError};
use delta_cal::stream::Forgetting;
use delta_cal::{
    ArmIndex, IkmCalibrator, JointCalibrator, Noise, Parameter, Real, Refusal, Robot, Sample,
    SettingError, Settings, Tolerance,
};
use delta_cal_tests::{
    DEGREE, Spread, generator, in_unit, largest_difference, measurements, paper_robot, perturbed,
    robot_and_samples,
};
use nalgebra::Vector3;
use proptest::prelude::*;
use rand_core::Rng;

fn noise() -> Noise<f64> {
    Noise::new(0.02, 0.005 * DEGREE).unwrap()
}

fn noisy(seed: u64, count: usize) -> (Robot<f64>, Vec<Sample<f64>>) {
    let off = (1.0, 0.3 * DEGREE, Spread::Uniform);
    robot_and_samples((71, seed), off, count, Some(&noise()))
}

fn weighted() -> Settings<f64> {
    Settings::default().with_noise(noise())
}

fn filled(samples: &[Sample<f64>], settings: &Settings<f64>) -> IkmCalibrator<f64> {
    let mut calibrator = IkmCalibrator::new(&paper_robot(), settings);
    calibrator.add_many(samples).unwrap();
    calibrator
}

fn config() -> ProptestConfig {
    ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(100)
    }
}

proptest! {
    #![proptest_config(config())]

    /// Σ (f/σf)² of any parameters, against the sum over the samples of the constraint itself.
    #[test]
    fn the_factor_evaluates_any_parameters(seed: u64, count in 1usize..40) {
        let (_, samples) = noisy(seed, count);
        let mut rng = generator(72, seed);
        let other = perturbed(&paper_robot(), 20.0, 0.2, Spread::Uniform, &mut rng);
        let calibrator = filled(&samples, &weighted());
        let nominal = paper_robot::<f64>();
        for index in ArmIndex::ALL {
            let mut expected = 0.0;
            for sample in &samples {
                let q = sample.joints[index.index()];
                let arm = nominal.arm(index);
                let sigma = (2.0 * arm.lb() * 0.02)
                    .hypot(arm.constraint_by_joint(&sample.position, q) * 0.005 * DEGREE);
                expected += (other.arm(index).constraint(&sample.position, q) / sigma).powi(2);
            }
            let found = calibrator.sums_of_squares(&other)[index.index()];
            // Terms of 1e5 σ that partly cancel, against 1e3 σ that remain.
            prop_assert!((found - expected).abs() < 1e-8 * expected, "{found} for {expected}");
        }
    }

    /// The same robot in metres, micrometres or leagues.
    #[test]
    fn the_unit_of_length_scales_the_result(seed: u64, exponent in -6i32..6) {
        let unit = 10f64.powi(exponent);
        let (_, samples) = noisy(seed, 30);
        let settings = |unit: f64| Settings::default().with_noise(Noise::new(0.02 * unit, 0.005 * DEGREE).unwrap()).with_tolerance(Tolerance::new(unit, 0.3 * DEGREE).unwrap());
        let mut small = IkmCalibrator::new(&paper_robot(), &settings(1.0));
        small.add_many(&samples).unwrap();
        let mut large = IkmCalibrator::new(&in_unit(&paper_robot(), unit), &settings(unit));
        for sample in &samples {
            large
                .add(&Sample { position: sample.position * unit, ..*sample })
                .unwrap();
        }
        let expected = in_unit(&small.calibrate().unwrap().robot, unit);
        let found = large.calibrate().unwrap().robot;
        // Decimal units round each number: ε · 500 mm, times the condition.
        prop_assert!(largest_difference(&found, &expected) < 1e-7 * unit);
    }

    #[test]
    fn a_bad_number_is_refused_and_nothing_is_taken_in(
        seed: u64,
        place in 0usize..6,
        kind in 0usize..4,
    ) {
        let (_, samples) = noisy(seed, 20);
        let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200][kind];
        let mut spoilt = samples[7];
        let expected = if place < 3 {
            spoilt.joints[place] = bad;
            let arm = ArmIndex::ALL[place];
            if bad.is_finite() { SampleError::JointTooLarge(arm) } else { SampleError::JointNonFinite(arm) }
        } else {
            spoilt.position[place - 3] = bad;
            SampleError::PositionNonFinite
        };
        let mut calibrator = filled(&samples, &weighted());
        let before = calibrator.clone();
        prop_assert_eq!(calibrator.add(&spoilt), Err(expected));
        prop_assert!(calibrator == before);

        let mut many = samples.clone();
        many[7] = spoilt;
        prop_assert_eq!(calibrator.add_many(&many), Err((7, expected)));
        prop_assert!(calibrator == before);
    }
}

/// Samples added one by one wait for each other, and absorbing a pair jointly takes two calls: whatever happens in
/// between, every sample is absorbed once.
fn every_order<E: Estimator>() {
    for seed in 0..40 {
        let (_, mut measured) = noisy(seed, 40);
        let mut rng = generator(73, seed);
        let new = || Calibrator::<f64, E>::new(&paper_robot(), &weighted());
        let (mut calibrator, mut taken) = (new(), 0);
        let count = 20 + (rng.next_u32() % 20) as usize;
        while taken < count {
            let next = (taken + (rng.next_u32() % 6) as usize).min(count);
            let part = &measured[taken..next];
            match rng.next_u32() % 8 {
                0 => calibrator.flush(),
                1 => drop(calibrator.calibrate()),
                2 => {
                    calibrator.add_many(part).unwrap();
                    taken = next;
                }
                3 => {
                    let mut other = new();
                    for sample in part {
                        other.add(sample).unwrap();
                    }
                    calibrator.merge(&other).unwrap();
                    taken = next;
                }
                4 => calibrator.forget(1.0).unwrap(),
                _ => {
                    calibrator.add(&measured[taken]).unwrap();
                    taken += 1;
                }
            }
            assert_eq!(calibrator.samples(), taken as u64);
        }
        let mut expected = new();
        measured.truncate(count);
        measured.reverse();
        expected.add_many(&measured).unwrap();
        let [found, expected] =
            [calibrator, expected].map(|mut own| E::robot(&own.calibrate().unwrap()).parameters());
        for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
            // Known to some hundredths of a millimetre, or 1e-4.
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }
}

#[test]
fn every_order_of_adding_merging_and_solving_gives_the_same() {
    every_order::<Ikm>();
    every_order::<Joint>();
}

/// Forgetting by λ multiplies every earlier row by √λ: the factor equals one made from rows whose
/// stated noise was larger by 1/√λ. Merged factors are worth the sum of what they remember.
#[test]
fn forgetting_weighs_old_samples_down() {
    let (_, samples) = noisy(3, 60);
    let (old, new) = samples.split_at(30);
    let mut forgetful = filled(old, &weighted());
    forgetful.forget(0.25).unwrap();
    forgetful.add_many(new).unwrap();
    assert_eq!(forgetful.samples(), 60);
    let sums = |of: &IkmCalibrator<f64>| Vector3::from(of.sums_of_squares(&paper_robot()));
    let [old, new] = [old, new].map(|samples| sums(&filled(samples, &weighted())));
    let expected = old * 0.25 + new;
    assert!((sums(&forgetful) - expected).amax() < 1e-10 * expected.min());
    let mut other = filled(&samples, &weighted());
    other.forget(0.5).unwrap();
    other.merge(&forgetful).unwrap();
    for (own, remembered, samples) in [(&mut forgetful, 37.5, 60), (&mut other, 67.5, 120)] {
        // λ of 1 and more forgets nothing.
        for lambda in [1.0, 1.5, f64::NAN] {
            own.forget(lambda).unwrap();
        }
        for arm in &own.calibrate().unwrap().arms {
            assert!((arm.degrees_of_freedom + 8.0 - remembered).abs() < 1e-12);
            assert_eq!(arm.samples, samples);
        }
    }
}

/// However long ago the tolerance was stated, it counts: with a memory of two samples it decides part
/// of every result, and without it there is none.
#[test]
fn the_prior_is_not_forgotten() {
    let rough = Noise::new(0.2, 0.02 * DEGREE).unwrap();
    let tolerance = Tolerance::new(0.5, 0.2 * DEGREE).unwrap();
    let with = Settings::default()
        .with_noise(rough)
        .with_tolerance(tolerance);
    let mut share = 0.0_f64;
    for number in 0..100 {
        let mut rng = generator(965, number);
        let truth = perturbed(&paper_robot(), 0.5, 0.2 * DEGREE, Spread::Normal, &mut rng);
        let memory = Forgetting::new(2.0).unwrap();
        let mut calibrator = IkmCalibrator::new(&paper_robot(), &with);
        for sample in measurements(&truth, 300, Some(&rough), &mut rng) {
            calibrator.add_forgetting(&sample, &memory).unwrap();
        }
        for arm in &calibrator.calibrate().unwrap().arms {
            for parameter in Parameter::ROTARY {
                let sigma = arm.standard_deviation(parameter).unwrap();
                assert!(sigma <= tolerance.of(parameter) * 1.000_001);
            }
            share += arm.prior_share.mean() / 300.0;
        }
    }
    println!(
        "memory of two samples: the tolerance decides {:.0} % of a parameter",
        100.0 * share
    );
    assert!(share > 0.3);
}

/// A calibrator of another noise, a λ that is none.
#[test]
fn calls_that_fail_leave_the_outcome() {
    fn check<E: Estimator>() {
        let (_, samples) = noisy(9, 20);
        let mut calibrator = Calibrator::<f64, E>::new(&paper_robot(), &weighted());
        calibrator.add_many(&samples).unwrap();
        let expected = calibrator.calibrate().unwrap();
        let before = calibrator.clone();
        let stranger = Calibrator::new(&paper_robot(), &Settings::default());
        let merged = calibrator.merge(&stranger);
        assert_eq!(merged, Err(MergeError::DifferentNominal));
        assert_eq!(calibrator.outcome(), Ok(&expected));
        assert!(calibrator == before);
        for lambda in [1.0, 1.5, -0.5, f64::NAN] {
            calibrator.forget(lambda).unwrap();
            assert_eq!(calibrator.outcome(), Ok(&expected), "{lambda}");
        }
        calibrator.forget(0.5).unwrap();
        assert_eq!(calibrator.outcome(), Err(Refusal::Unfinished));
    }
    check::<Ikm>();
    check::<Joint>();
}

/// What is stated is refused where its square leaves the arithmetic; lengths of any size that make a robot are not.
#[test]
fn a_number_that_is_extreme_is_named() {
    let length = Err(SettingError::LengthTolerance);
    for (sigma, single, double) in [
        (1e-150, length, length),
        (1e-30, length, Ok(())),
        (1e-9, Ok(()), Ok(())),
        (1e9, Ok(()), Ok(())),
        (1e18, length, Ok(())),
        (1e150, length, length),
    ] {
        let [one, other] = [
            Tolerance::new(f32::from_f64(sigma), 0.003).map(|_| ()),
            Tolerance::new(sigma, 0.003).map(|_| ()),
        ];
        assert_eq!((one, other), (single, double), "{sigma:e}");
        // Rounding is added to a noise, so none is too small but 0.
        let [one, other] = [
            Noise::new(f32::from_f64(sigma), 0.0).map(|_| ()),
            Noise::new(sigma, 0.0).map(|_| ()),
        ];
        let refused = |tolerance: Result<(), _>| sigma > 1.0 && tolerance.is_err();
        assert_eq!(one.is_err(), refused(single) || sigma < 1e-100, "{sigma:e}");
        assert_eq!(other.is_err(), refused(double), "{sigma:e}");
    }
    let (truth, samples) = noisy(54, 20);
    for unit in [1e-16, 1e15] {
        let robot = in_unit(&paper_robot(), unit).cast().unwrap();
        let mut calibrator = JointCalibrator::new(&robot, &Settings::default());
        for sample in &samples {
            let joints = sample.joints.map(f32::from_f64);
            let position = sample.position.map(|own| f32::from_f64(own * unit));
            calibrator.add(&Sample { joints, position }).unwrap();
        }
        let found = calibrator.calibrate().unwrap().robot.arms()[0].lb();
        let expected = truth.arms()[0].lb();
        // A few times the noise.
        assert!((f64::from(found) / unit - expected).abs() < 0.2, "{found}");
    }
}
