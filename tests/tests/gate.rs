//! The gate in the stream: how often it rejects a good sample, how surely a wrong one, and how soon it
//! says that the robot has changed.

mod alarms;
mod decisions;
mod definitions;
mod innovations;

use delta_cal::stream::{Gate, Verdict};
use delta_cal::{Calibrator, Noise, Robot, Sample, Settings, Tolerance};
use delta_cal_tests::{Spread, paper_robot, perturbed};
use rand_pcg::Pcg32;

const DEGREE: f64 = std::f64::consts::PI / 180.0;

fn noise() -> Noise<f64> {
    Noise::new(0.02, 0.002 * DEGREE).unwrap()
}

/// Noise and tolerance stated, the robot drawn by them.
fn stated(length: f64, angle: f64) -> Settings<f64> {
    Settings::default()
        .with_noise(noise())
        .with_tolerance(Tolerance::new(length, angle).unwrap())
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
