//! The gate against its definitions: its memory, its width, its alarm.

use delta_cal::stream::{Alarm, Forgetting, ForgettingError, Gate, GateError, Untested, Verdict};
use delta_cal::{Calibrator, Noise, Sample, Settings, Tolerance};
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed};

const SIGMA: f64 = 0.02;

fn noise() -> Noise<f64> {
    Noise::new(SIGMA, 0.0).unwrap()
}

fn samples(seed: u64, count: usize) -> Vec<Sample<f64>> {
    let mut rng = generator(660, seed);
    let truth = perturbed(&paper_robot(), 0.3, 0.002, Spread::Normal, &mut rng);
    measurements(&truth, count, Some(&noise()), &mut rng)
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
