//! Random robots, poses and measurements shared by tests and benchmarks.

#![forbid(unsafe_code)]
#![allow(clippy::expect_used, clippy::missing_panics_doc)] // a panic fails the test

pub mod closures;
pub mod geometries;
pub mod goldens;
pub mod observed;

pub use delta_cal_target_tests::nominal as paper_robot;

use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Arm;
use delta_cal::simulate::{random_pose, simulate_sample, standard_normal};
use delta_cal::{Noise, Real, Robot, Sample};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// The paper's joint limits, −60° to 90°.
pub fn paper_limits<T: Real>() -> JointLimits<T> {
    JointLimits::new(
        T::from_f64(-60f64.to_radians()),
        T::from_f64(90f64.to_radians()),
    )
    .expect("the limits are valid")
}

/// Chooses the size of a campaign: short by default, but large enough to find the errors it targets; long with
/// `DELTA_CAL_CAMPAIGNS=long`.
pub fn size<T>(short: T, long: T) -> T {
    if is_long() { long } else { short }
}

/// Whether campaigns run at full size.
pub fn is_long() -> bool {
    std::env::var("DELTA_CAL_CAMPAIGNS").is_ok_and(|size| size == "long")
}

/// A random generator for one robot of one campaign; campaigns do not share streams.
pub fn generator(campaign: u64, robot: u64) -> Pcg32 {
    Pcg32::seed_from_u64(campaign.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ robot)
}

/// Uniform in (−1, 1).
pub fn uniform(rng: &mut Pcg32) -> f64 {
    f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0
}

/// Distribution of a robot's parameters about nominal.
#[derive(Debug, Clone, Copy)]
pub enum Spread {
    /// Uniform within ± the bound.
    Uniform,
    /// Normal with the bound as σ.
    Normal,
}

/// The nominal robot with random errors of `length` in every length and `angle` radians in every angle.
pub fn perturbed(
    nominal: &Robot<f64>,
    length: f64,
    angle: f64,
    spread: Spread,
    rng: &mut Pcg32,
) -> Robot<f64> {
    let arms = nominal.arms().map(|arm| {
        let mut parameters = arm.parameters();
        for (index, value) in parameters.iter_mut().enumerate() {
            let bound = if index == 3 || index == 4 {
                angle
            } else {
                length
            };
            *value += bound
                * match spread {
                    Spread::Uniform => uniform(rng),
                    Spread::Normal => standard_normal::<f64, _>(rng),
                };
        }
        Arm::new(parameters).expect("a slightly different arm is valid")
    });
    Robot::new(arms).expect("a slightly different robot is valid")
}

/// Measurements of `truth` at `count` random poses.
pub fn measurements(
    truth: &Robot<f64>,
    count: usize,
    noise: Option<&Noise<f64>>,
    rng: &mut Pcg32,
) -> Vec<Sample<f64>> {
    let limits = paper_limits();
    (0..count)
        .map(|_| {
            let pose = random_pose(truth, &limits, rng).expect("the robot has a workspace");
            simulate_sample(truth, &pose.joints, noise, rng).expect("the pose is reachable")
        })
        .collect()
}

/// The largest parameter difference, with angles times the upper arm's length.
pub fn largest_difference(a: &Robot<f64>, b: &Robot<f64>) -> f64 {
    parameter_differences(a, b)
        .into_iter()
        .map(f64::abs)
        .fold(0.0, f64::max)
}

/// All 24 differences a − b, with angles times the upper arm's length.
pub fn parameter_differences(a: &Robot<f64>, b: &Robot<f64>) -> Vec<f64> {
    let mut differences = Vec::with_capacity(24);
    for (a, b) in a.arms().iter().zip(b.arms()) {
        for index in 0..8 {
            let unit = if index == 3 || index == 4 {
                b.upper_arm_length()
            } else {
                1.0
            };
            differences.push((a.parameters()[index] - b.parameters()[index]) * unit);
        }
    }
    differences
}

/// The same samples, each number rounded to single precision.
pub fn to_single(samples: &[Sample<f64>]) -> Vec<Sample<f32>> {
    samples
        .iter()
        .map(|sample| Sample {
            joints: sample.joints.map(f32::from_f64),
            position: sample.position.map(f32::from_f64),
        })
        .collect()
}
