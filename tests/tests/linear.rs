//! Robots whose elbows are carriages on towers: kinematics against other formulas, exact data give the robot
//! back, noisy data are at the Cramér–Rao bound, and what owners of ten printers measured is predicted better
//! than by a least-squares fit.

mod exact;
mod instruments;
mod kinematics;
mod noisy;
mod printers;
mod radius;

use delta_cal::kinematics::JointLimits;
use delta_cal::simulate::{random_pose, simulate_sample, standard_normal};
use delta_cal::{Noise, Robot, Sample, Tolerance};
use delta_cal_tests::{Spread, uniform};
use rand_pcg::Pcg32;

/// One σ of a length, of an angle, of the carriages' zero and of the scale.
const LENGTH: f64 = 0.5;
const ANGLE: f64 = 3e-3;
const ZERO: f64 = 5.0;
const SCALE: f64 = 1e-3;

fn tolerance() -> Tolerance<f64> {
    let own = Tolerance::new(LENGTH, ANGLE).unwrap();
    own.with_linear(ZERO, SCALE).unwrap()
}

/// The nominal robot with every parameter off by so many tolerances.
fn made(nominal: &Robot<f64>, tolerances: f64, spread: Spread, rng: &mut Pcg32) -> Robot<f64> {
    let [arm, ..] = nominal.arms();
    let sigmas = tolerance().of_places(arm);
    let parameters = nominal.parameters().map(|mut arm| {
        for (value, sigma) in arm.iter_mut().zip(sigmas) {
            let part = match spread {
                Spread::Uniform => uniform(rng),
                Spread::Normal => standard_normal::<f64, _>(rng),
            };
            *value += tolerances * sigma * part;
        }
        arm
    });
    nominal.with_parameters(parameters).unwrap()
}

/// The same with its towers further out by a length that all have in common.
fn spread_out(robot: &Robot<f64>, by: f64) -> Robot<f64> {
    let mut parameters = robot.parameters();
    for [x, y, ..] in &mut parameters {
        let radius = x.hypot(*y);
        (*x, *y) = (*x * (1.0 + by / radius), *y * (1.0 + by / radius));
    }
    robot.with_parameters(parameters).unwrap()
}

fn measurements(
    truth: &Robot<f64>,
    [low, high]: [f64; 2],
    count: usize,
    noise: Option<&Noise<f64>>,
    rng: &mut Pcg32,
) -> Vec<Sample<f64>> {
    let limits = JointLimits::travel(low, high).unwrap();
    let sample = |_| {
        let pose = random_pose(truth, &limits, rng).unwrap();
        simulate_sample(truth, &pose.joints, noise, rng).unwrap()
    };
    (0..count).map(sample).collect()
}

/// The largest difference of any parameter, angles and scales times the forearm.
fn largest_difference(a: &Robot<f64>, b: &Robot<f64>) -> f64 {
    let mut largest = 0.0_f64;
    for (a, b) in a.arms().iter().zip(b.arms()) {
        for parameter in a.drive().parameters() {
            let unit = match parameter.kind() {
                delta_cal::robot::ParameterKind::Length => 1.0,
                _ => b.lb(),
            };
            largest = largest.max((a.get(*parameter) - b.get(*parameter)).abs() * unit);
        }
    }
    largest
}
