//! The FKM method: exact data return the robot, noisy data the statistics that they should.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

use delta_cal::{Calibrator, Method, Noise, Refusal, Robot, Sample, Settings, Start, StartUsed};
use delta_cal_host::fkm::{self, Linearization};
use delta_cal_tests::{
    Spread, generator, largest_difference, measurements, paper_robot, perturbed,
};

const ROBOTS: u64 = 500;

/// A robot off by up to 1 cm and 1°, measured exactly.
fn case(campaign: u64, robot: u64, count: usize) -> (Robot<f64>, Vec<Sample<f64>>) {
    let mut rng = generator(campaign, robot);
    let angle = 1f64.to_radians();
    let truth = perturbed(&paper_robot(), 10.0, angle, Spread::Uniform, &mut rng);
    let samples = measurements(&truth, count, None, &mut rng);
    (truth, samples)
}

#[test]
fn nine_or_more_poses_return_500_of_500_robots_to_1e_6_mm() {
    for count in [9, 12, 20, 60] {
        let (mut by_itself, mut worst) = (0, 0f64);
        let mut iterations = 0;
        let mut failures = Vec::new();
        for robot in 0..ROBOTS {
            let (truth, samples) = case(31, robot, count);
            match fkm::calibrate(&paper_robot(), &samples, &Settings::default()) {
                Ok(outcome) => {
                    let error = largest_difference(&outcome.robot.robot, &truth);
                    let [arm, ..] = outcome.robot.arms;
                    if !(error < 1e-6) {
                        failures.push((robot, format!("{error:e} mm")));
                    }
                    worst = worst.max(error);
                    by_itself += usize::from(arm.start == StartUsed::Reference);
                    iterations = iterations.max(arm.iterations);
                }
                Err(refusal) => failures.push((robot, refusal.to_string())),
            }
        }
        println!(
            "{count} poses: {} of {ROBOTS} returned, {by_itself} from the nominal start, worst \
             {worst:.1e} mm, at most {iterations} iterations",
            ROBOTS as usize - failures.len()
        );
        assert!(failures.is_empty(), "{count} poses: {failures:?}");
    }
}
