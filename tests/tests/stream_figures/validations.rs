//! Held-out samples: their deviations, what is expected of them, and the limits of either.

use crate::stream_figures::{SIGMA, covariance, noise, rows, samples};
use delta_cal::calibration::limits::{chi_square_bound, variance_ratio_bound};
use delta_cal::stream::{HeldOut, HeldOutRefusal};
use delta_cal::{ArmIndex, Calibrator, Noise, Settings, Tolerance};
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed};
use nalgebra::{DMatrix, Vector3};

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
