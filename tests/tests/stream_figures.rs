//! What the gate and the held-out samples report, against the definitions.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

use delta_cal::calibration::limits::{chi_square_bound, variance_ratio_bound};
use delta_cal::stream::{
    Alarm, Forgetting, ForgettingError, Gate, GateError, HeldOut, HeldOutRefusal, Untested, Verdict,
};
use delta_cal::{ArmIndex, Calibrator, Noise, RobotOutcome, Sample, Settings, Tolerance};
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed};
use nalgebra::{DMatrix, DVector, SMatrix, Vector3};

const SIGMA: f64 = 0.02;

fn noise() -> Noise<f64> {
    Noise::new(SIGMA, 0.0).unwrap()
}

fn samples(seed: u64, count: usize) -> Vec<Sample<f64>> {
    let mut rng = generator(660, seed);
    let truth = perturbed(&paper_robot(), 0.3, 0.002, Spread::Normal, &mut rng);
    measurements(&truth, count, Some(&noise()), &mut rng)
}

/// Distances along the forearm and their derivatives, of an arm of the outcome.
fn rows(
    outcome: &RobotOutcome<f64>,
    index: ArmIndex,
    samples: &[Sample<f64>],
) -> (DVector<f64>, DMatrix<f64>) {
    let unit = 2.0 * paper_robot::<f64>().arm(index).lb();
    let arm = outcome.robot.arm(index);
    let mut residuals = DVector::zeros(samples.len());
    let mut jacobian = DMatrix::zeros(samples.len(), 8);
    for (k, sample) in samples.iter().enumerate() {
        let q = sample.joints[index.index()];
        residuals[k] = arm.constraint(&sample.position, q) / unit;
        let row = arm.constraint_by_parameters(&sample.position, q) / unit;
        jacobian.row_mut(k).copy_from_slice(row.as_slice());
    }
    (residuals, jacobian)
}

/// (JᵀJ + prior)⁻¹ at one σ of the distances.
fn covariance(jacobian: &DMatrix<f64>, sigma: f64, tolerance: bool) -> SMatrix<f64, 8, 8> {
    let information = jacobian.transpose() * jacobian / (sigma * sigma);
    let mut information = SMatrix::<f64, 8, 8>::from_column_slice(information.as_slice());
    if tolerance {
        for k in 0..8 {
            let tolerance: f64 = if k == 3 || k == 4 { 0.002 } else { 0.3 };
            information[(k, k)] += tolerance.powi(-2);
        }
    }
    information.try_inverse().unwrap()
}

fn same(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-5 * expected.abs()
}

#[test]
fn held_out_samples_are_measured_by_noise_and_uncertainty() {
    let tolerance = Some(Tolerance::new(0.3, 0.002).unwrap());
    for (stated, tolerance) in [
        (Some(noise()), None),
        (Some(noise()), tolerance),
        (None, None),
        (None, tolerance),
        // Stated too small: what the fit finds counts as well.
        (Some(Noise::new(SIGMA * 0.8, 0.0).unwrap()), None),
    ] {
        let settings = Settings::default()
            .with_noise(stated)
            .with_tolerance(tolerance);
        let mut calibrator = Calibrator::new(&paper_robot(), &settings);
        let mut held_out = HeldOut::new(&calibrator, 3).unwrap();
        let (mut seen, mut unseen) = (Vec::new(), Vec::new());
        for (k, sample) in samples(1, 45).iter().enumerate() {
            let held = held_out.add(&mut calibrator, sample).unwrap();
            assert_eq!(held, k % 3 == 2);
            if held { &mut unseen } else { &mut seen }.push(*sample);
        }
        assert_eq!(held_out.samples(), 15);
        let outcome = calibrator.solve().unwrap();
        let validations = held_out.validate(&mut calibrator, &outcome).unwrap();
        for ((index, found), arm) in ArmIndex::ALL
            .into_iter()
            .zip(validations)
            .zip(&outcome.arms)
        {
            let (_, fitted) = rows(&outcome, index, &seen);
            let (residuals, jacobian) = rows(&outcome, index, &unseen);
            let sigma = stated.map_or_else(|| arm.estimated_noise.unwrap(), |n| n.position());
            let unit = if stated.is_some() { sigma } else { 1.0 };
            let count = 15.0;
            let covariance = covariance(&fitted, sigma, tolerance.is_some());
            let spread = &jacobian * covariance * jacobian.transpose();
            assert!(same(found.samples, count));
            assert!(same(
                found.residual_rms,
                (residuals.norm_squared() / count).sqrt() / unit
            ));
            let expected = (sigma * sigma + spread.trace() / count).sqrt() / unit;
            assert!(
                same(found.expected_rms, expected),
                "{stated:?} {tolerance:?}: {found:?} {expected}"
            );
            let variance = DMatrix::identity(15, 15) * (sigma * sigma) + spread;
            let statistic = residuals.dot(&(variance.try_inverse().unwrap() * &residuals));
            assert!(same(found.statistic, statistic), "{found:?} {statistic}");
            let ratio = variance_ratio_bound(count, arm.degrees_of_freedom, 3.4).unwrap() * count;
            let limit = if stated.is_some() {
                let fit = arm.residual_rms.powi(2) * 30.0 / arm.degrees_of_freedom;
                chi_square_bound(count, 3.4).max(ratio * fit)
            } else {
                ratio
            };
            assert!(same(found.limit, limit), "{found:?} {limit}");
        }
    }
}

#[test]
fn what_is_not_held_out_cannot_be_judged() {
    let settings = Settings::default().with_noise(noise());
    let mut calibrator = Calibrator::new(&paper_robot(), &settings);
    for every in [0, 1] {
        assert_eq!(HeldOut::new(&calibrator, every), Err(HeldOutRefusal::Every));
    }
    assert!(HeldOut::new(&calibrator, 2).is_ok());
    calibrator.add_many(&samples(2, 20)).unwrap();
    let outcome = calibrator.solve().unwrap();
    let mut none = HeldOut::new(&calibrator, 2).unwrap();
    let refusal = none.validate(&mut calibrator, &outcome).unwrap_err();
    let arm = ArmIndex::First;
    assert_eq!(refusal, HeldOutRefusal::NoSamples { arm });
    assert_eq!(refusal.arm(), Some(arm));
    assert_eq!(HeldOutRefusal::Every.arm(), None);
}

/// Far off by more than noise explains, and the figure is how much: rms over what is expected.
#[test]
fn a_contradiction_is_told_by_how_much() {
    let settings = Settings::default().with_noise(noise());
    let all = samples(3, 60);
    let mut calibrator = Calibrator::new(&paper_robot(), &settings);
    let mut held_out = HeldOut::new(&calibrator, 2).unwrap();
    let (mut seen, mut unseen) = (Vec::new(), Vec::new());
    for (k, sample) in all.iter().enumerate() {
        let mut sample = *sample;
        if k % 2 == 1 {
            sample.position += Vector3::new(0.0, 0.0, 0.12);
        }
        let held = held_out.add(&mut calibrator, &sample).unwrap();
        if held { &mut unseen } else { &mut seen }.push(sample);
    }
    let outcome = calibrator.solve().unwrap();
    let refusal = held_out.validate(&mut calibrator, &outcome).unwrap_err();
    let HeldOutRefusal::Contradicted { arm, ratio } = refusal else {
        panic!("{refusal:?}");
    };
    assert_eq!(arm, ArmIndex::First);
    let (_, fitted) = rows(&outcome, arm, &seen);
    let (residuals, jacobian) = rows(&outcome, arm, &unseen);
    let covariance = covariance(&fitted, SIGMA, false);
    let spread = (&jacobian * covariance * jacobian.transpose()).trace();
    let expected = (residuals.norm_squared() / (30.0 * SIGMA * SIGMA + spread)).sqrt();
    assert!(
        (f64::from(ratio) / expected - 1.0).abs() < 1e-4,
        "{ratio} {expected}"
    );
}

/// Eight samples and a stated noise: what is off by more than ten σ of the noise is refused even where the
/// uncertainty explains it. With no residual to spare the noise has a margin of two.
#[test]
fn eight_fitted_samples_are_judged_by_the_stated_noise_alone() {
    let settings = Settings::default().with_noise(noise());
    let (mut accepted, mut overfitted) = (0, 0);
    for seed in 100..160 {
        let all = samples(seed, 16);
        let mut calibrator = Calibrator::new(&paper_robot(), &settings);
        let mut held_out = HeldOut::new(&calibrator, 2).unwrap();
        for sample in &all {
            held_out.add(&mut calibrator, sample).unwrap();
        }
        let unseen: Vec<_> = all.iter().copied().skip(1).step_by(2).collect();
        let Ok(outcome) = calibrator.solve() else {
            continue;
        };
        match held_out.validate(&mut calibrator, &outcome) {
            Ok(arms) => {
                accepted += 1;
                for arm in arms {
                    assert!(same(arm.limit, 2.0 * chi_square_bound(8.0, 3.4)));
                }
            }
            Err(HeldOutRefusal::Overfitted { arm, ratio }) => {
                overfitted += 1;
                let (residuals, _) = rows(&outcome, arm, &unseen);
                let expected = (residuals.norm_squared() / 8.0).sqrt() / SIGMA;
                assert!(expected > 10.0);
                assert!((f64::from(ratio) / expected - 1.0).abs() < 1e-4);
            }
            Err(_) => {}
        }
    }
    assert!(accepted > 0 && overfitted > 0, "{accepted} {overfitted}");
}

/// Fitted poses that are too much alike, and others that are not: the uncertainty explains what is off, and
/// it is refused, whether the noise was stated or estimated.
#[test]
fn poses_too_much_alike_say_nothing_of_others() {
    for stated in [Some(noise()), None] {
        let settings = Settings::default().with_noise(stated);
        let mut refused = 0;
        for seed in 200..230 {
            let mut rng = generator(661, seed);
            let truth = perturbed(&paper_robot(), 0.3, 0.002, Spread::Normal, &mut rng);
            let mut calibrator = Calibrator::new(&paper_robot(), &settings);
            let mut held_out = HeldOut::new(&calibrator, 2).unwrap();
            let mut unseen = Vec::new();
            for sample in measurements(&truth, 20, Some(&noise()), &mut rng) {
                let joints = [(); 3].map(|()| 0.3 + 0.25 * delta_cal_tests::uniform(&mut rng));
                let alike =
                    delta_cal::simulate::simulate_sample(&truth, &joints, Some(&noise()), &mut rng);
                assert!(!held_out.add(&mut calibrator, &alike.unwrap()).unwrap());
                assert!(held_out.add(&mut calibrator, &sample).unwrap());
                unseen.push(sample);
            }
            let Ok(outcome) = calibrator.solve() else {
                continue;
            };
            if let Err(HeldOutRefusal::Overfitted { arm, ratio }) =
                held_out.validate(&mut calibrator, &outcome)
            {
                refused += 1;
                let (residuals, _) = rows(&outcome, arm, &unseen);
                let estimated = outcome.arms[arm.index()].estimated_noise;
                let expected =
                    (residuals.norm_squared() / 20.0).sqrt() / estimated.unwrap_or(SIGMA);
                assert!((f64::from(ratio) / expected - 1.0).abs() < 1e-4);
            }
        }
        assert!(refused > 0, "{stated:?}");
    }
}

/// ∫ of a density from 0 to t, over its whole half.
fn half_below(density: &dyn Fn(f64) -> f64, t: f64) -> f64 {
    // x = u/(1 − u) takes the half line to the unit interval; midpoints.
    let integral = |to: f64| {
        let count = 20_000;
        (0..count)
            .map(|k| {
                let u = (f64::from(k) + 0.5) / f64::from(count) * to;
                density(u / (1.0 - u)) / (1.0 - u).powi(2) * to / f64::from(count)
            })
            .sum::<f64>()
    };
    integral(t / (1.0 + t)) / integral(1.0)
}

/// The normal number that is as improbable as Student's t with ν degrees of freedom.
fn as_normal(t: f64, freedom: f64) -> f64 {
    let student = |x: f64| (1.0 + x * x / freedom).powf(-(freedom + 1.0) / 2.0);
    let wanted = half_below(&student, t.abs());
    let (mut low, mut high) = (0.0, 8.0);
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        if half_below(&|x: f64| (-x * x / 2.0).exp(), middle) < wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    low * t.signum()
}

/// Without a stated noise the innovation over its estimated σ is Student's, and is told as a normal one.
#[test]
fn without_a_stated_noise_an_innovation_is_students() {
    let settings = Settings::default();
    for (seed, count) in [(11, 14), (12, 24), (13, 60)] {
        let mut calibrator = Calibrator::new(&paper_robot(), &settings);
        let mut gate = Gate::new(&mut calibrator);
        let all = samples(seed, count + 1);
        let (seen, next) = (&all[..count], &all[count]);
        for sample in seen {
            assert_eq!(
                gate.add(&mut calibrator, sample).unwrap(),
                Verdict::Untested(Untested::NoEstimate)
            );
        }
        assert_eq!(gate.counts().untested, count as u64);
        let outcome = calibrator.solve().unwrap();
        gate.adopt(&mut calibrator, &outcome);
        for shift in [0.0, 0.1, -0.1] {
            let mut next = *next;
            next.position.z += shift;
            let found = gate.innovations(&calibrator, &next).unwrap();
            for (found, arm) in found.iter().zip(&outcome.arms) {
                let (_, fitted) = rows(&outcome, found.arm, seen);
                let (residual, row) = rows(&outcome, found.arm, &[next]);
                let covariance = covariance(&fitted, 1.0, false);
                let spread = (&row * covariance * row.transpose())[0];
                let sigma = arm.estimated_noise.unwrap();
                let t = residual[0] / (sigma * (1.0 + spread).sqrt());
                assert!((found.distance - residual[0]).abs() < 1e-6 + 1e-3 * residual[0].abs());
                let expected = as_normal(t, count as f64 - 8.0);
                // Wallace's approximation, as documented: 0.02 from twelve degrees of freedom on, 0.1
                // for six.
                let allowed = if count < 20 { 0.1 } else { 0.03 };
                if expected.abs() < 5.0 {
                    assert!(
                        (found.normalized - expected).abs() < allowed,
                        "{count} {} {expected}",
                        found.normalized
                    );
                }
            }
        }
    }
}

/// Samples taken in after the estimate count as well: in the noise and in the prediction.
#[test]
fn samples_after_the_estimate_count_as_well() {
    let settings = Settings::default();
    let all = samples(18, 41);
    let mut calibrator = Calibrator::new(&paper_robot(), &settings);
    let mut gate = Gate::new(&mut calibrator);
    calibrator.add_many(&all[..35]).unwrap();
    let outcome = calibrator.solve().unwrap();
    gate.adopt(&mut calibrator, &outcome);
    for sample in &all[35..39] {
        gate.add(&mut calibrator, sample).unwrap();
    }
    assert_eq!(gate.counts().taken, 4);
    let outcome = calibrator.solve().unwrap();
    for shift in [0.06, -0.06] {
        let mut next = all[40];
        next.position.z += shift;
        let found = gate.innovations(&calibrator, &next).unwrap();
        for (found, arm) in found.iter().zip(&outcome.arms) {
            let (_, fitted) = rows(&outcome, found.arm, &all[..39]);
            let (residual, row) = rows(&outcome, found.arm, &[next]);
            let covariance = covariance(&fitted, 1.0, false);
            let spread = (&row * covariance * row.transpose())[0];
            let sigma = arm.estimated_noise.unwrap();
            let expected = as_normal(residual[0] / (sigma * (1.0 + spread).sqrt()), 31.0);
            assert!(
                (found.normalized - expected).abs() < 0.02,
                "{} {expected}",
                found.normalized
            );
        }
    }
}

/// Eleven samples leave three degrees of freedom, from which the noise can be told; ten do not.
#[test]
fn three_spare_samples_tell_the_noise() {
    for (count, known) in [(10, false), (11, true)] {
        let settings = Settings::default();
        let all = samples(14, count + 1);
        let mut calibrator = Calibrator::new(&paper_robot(), &settings);
        let mut gate = Gate::new(&mut calibrator);
        for sample in &all[..count] {
            gate.add(&mut calibrator, sample).unwrap();
        }
        let outcome = calibrator.solve().unwrap();
        gate.adopt(&mut calibrator, &outcome);
        let found = gate.innovations(&calibrator, &all[count]);
        assert_eq!(found.is_ok(), known);
        assert!(known || found == Err(Untested::NoNoise));
    }
}

#[test]
fn the_eighth_rejection_in_a_row_raises_the_alarm() {
    let settings = Settings::default()
        .with_noise(noise())
        .with_tolerance(Tolerance::new(0.3, 0.002).unwrap());
    for (before, changed) in [(15, false), (16, true), (40, true)] {
        let mut calibrator = Calibrator::new(&paper_robot(), &settings);
        let mut gate = Gate::new(&mut calibrator);
        let mut all = samples(15, before + 30);
        for sample in &mut all[before..] {
            sample.position.z -= 20.0;
        }
        for (k, sample) in all.iter().enumerate() {
            let verdict = gate.add(&mut calibrator, sample).unwrap();
            assert_eq!(matches!(verdict, Verdict::Rejected(_)), k >= before);
            assert_eq!(gate.alarm().is_some(), k >= before + 7);
        }
        let first = before as u64;
        let expected = if changed {
            Alarm::RobotChanged { first }
        } else {
            Alarm::EarlySamplesWrong { first }
        };
        assert_eq!(gate.alarm(), Some(expected));
        let counts = gate.counts();
        assert_eq!((counts.taken, counts.rejected), (first, 30));
        assert_eq!((counts.run, counts.longest_run), (30, 30));
        assert!(
            counts
                .rejected_by_arm
                .iter()
                .all(|count| (25..=30).contains(count))
        );
    }
}

#[test]
fn a_gate_has_a_width() {
    let settings = Settings::default()
        .with_noise(noise())
        .with_tolerance(Tolerance::new(0.3, 0.002).unwrap());
    let mut calibrator = Calibrator::new(&paper_robot(), &settings);
    let gate = Gate::new(&mut calibrator);
    for sigmas in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(gate.with_sigmas(sigmas), Err(GateError::Sigmas));
    }
    let all = samples(16, 30);
    let rejected = |sigmas: f64| {
        let mut calibrator = calibrator;
        let mut gate = gate.with_sigmas(sigmas).unwrap();
        for sample in &all {
            gate.add(&mut calibrator, sample).unwrap();
        }
        gate.counts().rejected
    };
    assert_eq!(rejected(100.0), 0);
    assert!(rejected(0.5) > 15);
}

/// Σ λᵏ = N + 1, of which a sample k ago is λᵏ.
#[test]
fn a_memory_is_a_forgetting_factor() {
    for (samples, factor) in [(1.0_f64, 0.5_f64), (49.0, 0.98), (999.0, 0.999)] {
        let memory = Forgetting::new(samples).unwrap();
        assert!((memory.factor() - factor).abs() < 1e-15);
        assert!((memory.mean_age() - samples).abs() < 1e-12);
    }
    assert_eq!(Forgetting::new(0.999), Err(ForgettingError::TooShort));
    assert_eq!(Forgetting::new(f64::NAN), Err(ForgettingError::TooShort));
    // ε of single precision is 2⁻²³: 2¹⁶ samples and no more.
    assert!(Forgetting::new(65_536.0_f32).is_ok());
    assert_eq!(Forgetting::new(65_540.0_f32), Err(ForgettingError::TooLong));
}

#[test]
fn messages_name_what_is_at_fault() {
    let says = |error: &dyn core::error::Error, words: &[&str]| {
        let message = error.to_string();
        for word in words {
            assert!(message.contains(word), "{message:?} without {word:?}");
        }
    };
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
