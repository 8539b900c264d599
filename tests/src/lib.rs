//! Random robots, poses and measurements shared by tests and benchmarks.

#![forbid(unsafe_code)]
#![allow(clippy::expect_used, clippy::missing_panics_doc)] // a panic fails the test

pub mod geometries;
pub mod goldens;

pub use delta_cal_target_tests::nominal as paper_robot;

use delta_cal::calibration::{Calibrator, Estimator};
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{Drive, ParameterKind};
use delta_cal::simulate::{random_pose, simulate_sample, standard_normal};
use delta_cal::{Noise, Parameter, Real, Refusal, Robot, Sample, Settings};
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

/// In radians.
pub const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// A tracker's noise and an encoder's: 0.02 mm and 0.002°.
pub fn noise<T: Real>() -> Noise<T> {
    Noise::new(T::from_f64(0.02), T::from_f64(0.002 * DEGREE)).expect("it is a noise")
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

/// The nominal robot with random errors of `length` in every length and `angle` radians in every angle, and of `angle` in
/// every ratio.
pub fn perturbed(
    nominal: &Robot<f64>,
    length: f64,
    angle: f64,
    spread: Spread,
    rng: &mut Pcg32,
) -> Robot<f64> {
    let mut parameters = nominal.parameters();
    for (place, value) in places(nominal).zip(parameters.as_flattened_mut()) {
        let bound = match place.map(Parameter::kind) {
            Some(ParameterKind::Length) => length,
            Some(_) => angle,
            None => continue,
        };
        *value += bound
            * match spread {
                Spread::Uniform => uniform(rng),
                Spread::Normal => standard_normal::<f64, _>(rng),
            };
    }
    let robot = nominal.with_parameters(parameters);
    robot.expect("a slightly different robot is valid")
}

/// The robot in another unit of length.
pub fn in_unit(robot: &Robot<f64>, unit: f64) -> Robot<f64> {
    let mut parameters = robot.parameters();
    for (place, value) in places(robot).zip(parameters.as_flattened_mut()) {
        if place.map(Parameter::kind) == Some(ParameterKind::Length) {
            *value *= unit;
        }
    }
    let scaled = robot.with_parameters(parameters);
    scaled.expect("the robot is valid in any unit")
}

/// What stands at each of the 24 places.
fn places(robot: &Robot<f64>) -> impl Iterator<Item = Option<Parameter>> {
    robot.drive().places().into_iter().cycle().take(24)
}

/// A robot of a campaign that is off the paper's, and measurements of it.
pub fn robot_and_samples(
    (campaign, robot): (u64, u64),
    (length, angle, spread): (f64, f64, Spread),
    count: usize,
    noise: Option<&Noise<f64>>,
) -> (Robot<f64>, Vec<Sample<f64>>) {
    let mut rng = generator(campaign, robot);
    let truth = perturbed(&paper_robot(), length, angle, spread, &mut rng);
    let samples = measurements(&truth, count, noise, &mut rng);
    (truth, samples)
}

/// Measurements of `truth` at `count` random poses.
pub fn measurements(
    truth: &Robot<f64>,
    count: usize,
    noise: Option<&Noise<f64>>,
    rng: &mut Pcg32,
) -> Vec<Sample<f64>> {
    measurements_within(truth, &paper_limits(), count, noise, rng)
}

/// The same with other limits of the joints.
pub fn measurements_within(
    truth: &Robot<f64>,
    limits: &JointLimits<f64>,
    count: usize,
    noise: Option<&Noise<f64>>,
    rng: &mut Pcg32,
) -> Vec<Sample<f64>> {
    (0..count)
        .map(|_| {
            let pose = random_pose(truth, limits, rng).expect("the robot has a workspace");
            simulate_sample(truth, &pose.joints, noise, rng).expect("the pose is reachable")
        })
        .collect()
}

/// The largest parameter difference, with angles times the upper arm's length or, without one, the forearm's.
pub fn largest_difference(a: &Robot<f64>, b: &Robot<f64>) -> f64 {
    let all = parameter_differences(a, b).into_iter();
    all.map(f64::abs).fold(0.0, f64::max)
}

/// All 24 differences a − b, with angles and ratios times that length.
pub fn parameter_differences(a: &Robot<f64>, b: &Robot<f64>) -> Vec<f64> {
    let units = b.arms().iter().flat_map(|arm| {
        let turned = match arm.drive() {
            Drive::Rotary => arm.upper_arm_length(),
            Drive::Linear => arm.lb(),
        };
        let unit = move |place| match place {
            Some(ParameterKind::Length) => 1.0,
            _ => turned,
        };
        let places = arm.drive().places();
        places.map(|place| unit(place.map(Parameter::kind)))
    });
    let (a, b) = (a.parameters(), b.parameters());
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs
        .zip(units)
        .map(|((a, b), unit)| (a - b) * unit)
        .collect()
}

/// The same samples, each number rounded to a precision.
pub fn converted<T: Real>(samples: &[Sample<f64>]) -> Vec<Sample<T>> {
    let sample = |own: &Sample<f64>| Sample {
        joints: own.joints.map(T::from_f64),
        position: own.position.map(T::from_f64),
    };
    samples.iter().map(sample).collect()
}

/// What comes of samples.
///
/// # Errors
/// The calibration's refusal.
///
/// # Panics
/// If a sample is none.
pub fn calibrated<T: Real, E: Estimator>(
    nominal: &Robot<T>,
    samples: &[Sample<T>],
    settings: &Settings<T>,
) -> Result<E::Outcome<T>, Refusal> {
    let mut calibrator = Calibrator::<T, E>::new(nominal, settings);
    calibrator.add_many(samples).expect("they are samples");
    calibrator.calibrate()
}
