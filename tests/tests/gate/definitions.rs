//! The gate against its definitions: innovations as deviates of a normal distribution, its width, its alarm.

use delta_cal::stream::{Alarm, Forgetting, ForgettingError, Gate, GateError, Untested, Verdict};
use delta_cal::{ArmIndex, Calibrator, Noise, RobotOutcome, Sample, Settings, Tolerance};
use delta_cal_tests::closures::{Jacobian, distances};
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed};
use nalgebra::{DVector, SMatrix};

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
) -> (DVector<f64>, Jacobian) {
    distances(&paper_robot(), index, outcome.robot.arm(index), samples)
}

/// (JᵀJ + prior)⁻¹ at one σ of the distances.
fn covariance(jacobian: &Jacobian, sigma: f64, tolerance: bool) -> SMatrix<f64, 8, 8> {
    let mut information = jacobian.tr_mul(jacobian) / (sigma * sigma);
    if tolerance {
        for k in 0..8 {
            let tolerance: f64 = if k == 3 || k == 4 { 0.002 } else { 0.3 };
            information[(k, k)] += tolerance.powi(-2);
        }
    }
    information.try_inverse().unwrap()
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
