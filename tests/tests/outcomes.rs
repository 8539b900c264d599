//! What a calibration reports, against the definitions: residuals, noise, covariance, the share of the
//! prior, the limits of a refusal, iterations.

mod iterations;
mod kept_samples;
mod limits;
mod uncertainty;

use delta_cal::robot::Arm;
use delta_cal::{ArmIndex, Calibrator, Noise, Refusal, Robot, RobotOutcome, Sample, Settings};
use delta_cal_tests::closures::distances;
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed};
use nalgebra::SMatrix;

const SIGMA: f64 = 0.02;

fn case(seed: u64, count: usize) -> (Robot<f64>, Vec<Sample<f64>>) {
    let mut rng = generator(640, seed);
    let truth = perturbed(&paper_robot(), 0.3, 0.002, Spread::Normal, &mut rng);
    let noise = Noise::new(SIGMA, 0.0).unwrap();
    let samples = measurements(&truth, count, Some(&noise), &mut rng);
    (truth, samples)
}

fn calibrate(
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
) -> Result<RobotOutcome<f64>, Refusal> {
    let mut calibrator = Calibrator::new(&paper_robot(), settings);
    calibrator.add_many(samples).unwrap();
    calibrator.solve()
}

/// Σ d² and JᵀJ of an arm, d the distance along the forearm of the robot before.
fn sums(arm: &Arm<f64>, index: ArmIndex, samples: &[Sample<f64>]) -> (f64, SMatrix<f64, 8, 8>) {
    let (distances, jacobian) = distances(&paper_robot(), index, arm, samples);
    (distances.norm_squared(), jacobian.tr_mul(&jacobian))
}
