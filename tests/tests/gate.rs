//! The gate in the stream: how often it rejects a good sample, how surely a wrong one, and how soon it
//! says that the robot has changed.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

use delta_cal::limits::{REJECTIONS_OF_A_CHANGE, SUSPECTED};
use delta_cal::{
    Alarm, Calibrator, Gate, Noise, Robot, Sample, Settings, Tolerance, Untested, Verdict,
};
use delta_cal_tests::{
    Spread, generator, measurements, paper_robot, perturbed, to_single, uniform,
};
use nalgebra::Vector3;
use rand_pcg::Pcg32;

const DEGREE: f64 = std::f64::consts::PI / 180.0;

fn noise() -> Noise<f64> {
    Noise::new(0.02, 0.002 * DEGREE).unwrap()
}

/// Noise and tolerance stated, the robot drawn by them.
fn stated(length: f64, angle: f64) -> Settings<f64> {
    Settings {
        noise: Some(noise()),
        tolerance: Some(Tolerance::new(length, angle).unwrap()),
        ..Settings::default()
    }
}

fn robot(length: f64, angle: f64, rng: &mut Pcg32) -> Robot<f64> {
    perturbed(&paper_robot(), length, angle, Spread::Normal, rng)
}

/// A calibrator and its gate, which solves when it is asked to.
struct Stream {
    calibrator: Calibrator<f64>,
    gate: Gate<f64>,
}

impl Stream {
    fn new(settings: &Settings<f64>) -> Self {
        let mut calibrator = Calibrator::new(&paper_robot(), settings);
        let gate = Gate::new(&mut calibrator);
        Self { calibrator, gate }
    }

    fn add(&mut self, sample: &Sample<f64>) -> Verdict<f64> {
        let verdict = self.gate.add(&mut self.calibrator, sample).unwrap();
        if self.gate.wants_estimate()
            && let Ok(outcome) = self.calibrator.solve()
        {
            self.gate.adopt(&mut self.calibrator, &outcome);
        }
        verdict
    }
}

/// Normalised innovations of good samples: mean square, and how many are beyond a number of σ.
#[derive(Debug, Default)]
struct Innovations {
    number: u32,
    sum: f64,
    beyond: [u32; 3],
    rejected: u64,
    samples: u64,
}

const SIGMAS: [f64; 3] = [2.0, 3.0, 4.0];
/// 2Φ(−z) of those.
const EXPECTED: [f64; 3] = [0.045_500, 0.002_699_8, 0.000_063_342];

fn innovations(campaign: u64, settings: &Settings<f64>, length: f64, angle: f64) -> Innovations {
    let mut found = Innovations::default();
    for number in 0..300 {
        let mut rng = generator(campaign, number);
        let truth = robot(length, angle, &mut rng);
        let mut stream = Stream::new(settings);
        for sample in measurements(&truth, 120, Some(&noise()), &mut rng) {
            if let Ok(arms) = stream.gate.innovations(&stream.calibrator, &sample) {
                for arm in arms {
                    found.number += 1;
                    found.sum += arm.normalized.powi(2);
                    for (count, sigmas) in found.beyond.iter_mut().zip(SIGMAS) {
                        *count += u32::from(arm.normalized.abs() > sigmas);
                    }
                }
            }
            stream.add(&sample);
        }
        found.rejected += stream.gate.counts().rejected;
        found.samples += 120;
    }
    found
}

/// The distribution of good samples' normalised innovations squared is χ² with one degree of freedom: so is
/// how often they are rejected.
#[test]
fn good_samples_are_rejected_as_often_as_chi_square_has_it() {
    let no_tolerance = Settings {
        noise: Some(noise()),
        ..Settings::default()
    };
    for (what, campaign, settings, length, angle) in [
        (
            "noise, tolerance 0.5 mm/0.2°",
            900,
            stated(0.5, 0.2 * DEGREE),
            0.5,
            0.2 * DEGREE,
        ),
        (
            "noise, tolerance 2 mm/1°",
            901,
            stated(2.0, DEGREE),
            2.0,
            DEGREE,
        ),
        ("noise alone", 902, no_tolerance, 0.5, 0.2 * DEGREE),
        (
            "nothing stated",
            903,
            Settings::default(),
            0.5,
            0.2 * DEGREE,
        ),
    ] {
        let found = innovations(campaign, &settings, length, angle);
        let number = f64::from(found.number);
        let mean = found.sum / number;
        println!(
            "{what}: {} innovations, mean square {mean:.4}, beyond 2, 3, 4 sigma {:?}, expected \
             {:.1?}; rejected {} of {} samples",
            found.number,
            found.beyond,
            EXPECTED.map(|probability| number * probability),
            found.rejected,
            found.samples,
        );
    }
}
