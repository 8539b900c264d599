//! The example's measurements, and robots drawn near the nominal one with theirs.

use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Arm;
use delta_cal::simulate::{random_pose, simulate_sample, standard_normal};
use delta_cal::{Noise, Parameter, Real, Robot, Sample, SymmetricRobot, Tolerance};
use nalgebra::Vector3;
use rand_pcg::Pcg32;

#[allow(clippy::unreadable_literal)] // bit patterns
mod built_in {
    include!(concat!(env!("OUT_DIR"), "/samples.rs"));
}

/// How many samples are built in.
pub const SAMPLES: usize = built_in::SAMPLES.len();

/// The built-in measurements (simulated): radians and millimetres, each number rounded to nearest.
pub fn samples<T: Real>() -> [Sample<T>; SAMPLES] {
    built_in::SAMPLES.map(|bits| {
        let [q1, q2, q3, x, y, z] = bits.map(|bits| T::from_f64(f64::from_bits(bits)));
        Sample {
            joints: [q1, q2, q3],
            position: Vector3::new(x, y, z),
        }
    })
}

/// The robot as drawn: Ra 194, Rb 30, La 260, Lb 480 mm.
///
/// # Panics
/// Never: the dimensions are a robot's.
pub fn nominal<T: Real>() -> Robot<T> {
    SymmetricRobot {
        base_radius: T::from_f64(194.0),
        platform_radius: T::from_f64(30.0),
        upper_arm: T::from_f64(260.0),
        forearm: T::from_f64(480.0),
    }
    .robot()
    .expect("the dimensions are a robot's")
}

/// The noise of the built-in measurements: 0.02 mm and 0.002°.
///
/// # Panics
/// Never: the numbers are a noise.
pub fn noise<T: Real>() -> Noise<T> {
    Noise::new(T::from_f64(0.02), T::from_f64(0.002_f64.to_radians()))
        .expect("the numbers are a noise")
}

/// As the parts are made: one σ of 0.5 mm and 0.2°.
///
/// # Panics
/// Never: the numbers are a tolerance.
pub fn tolerance<T: Real>() -> Tolerance<T> {
    Tolerance::new(T::from_f64(0.5), T::from_f64(0.2_f64.to_radians()))
        .expect("the numbers are a tolerance")
}

/// A robot whose parameters differ from `nominal` by so many times the [`tolerance`], normally
/// distributed.
///
/// # Panics
/// If `tolerances` is so large that arms become impossible.
#[inline(never)]
pub fn robot_near<T: Real>(nominal: &Robot<T>, tolerances: f64, rng: &mut Pcg32) -> Robot<T> {
    let tolerance = tolerance::<T>();
    let arms = nominal.arms().map(|arm| {
        let mut parameters = Parameter::ROTARY.map(|parameter| arm.get(parameter));
        for (value, parameter) in parameters.iter_mut().zip(Parameter::ROTARY) {
            let sigma = tolerance.of(parameter) * T::from_f64(tolerances);
            *value += sigma * standard_normal::<T, _>(rng);
        }
        Arm::new(parameters).expect("a slightly different arm is valid")
    });
    Robot::new(arms).expect("a slightly different robot is valid")
}

/// One measurement of a robot at a random pose; `None` if it has none.
#[inline(never)]
pub(crate) fn measured<T: Real>(
    robot: &Robot<T>,
    noise: Option<&Noise<T>>,
    rng: &mut Pcg32,
) -> Option<Sample<T>> {
    let angle = |degrees: f64| T::from_f64(degrees.to_radians());
    let limits = JointLimits::new(angle(-60.0), angle(90.0)).expect("the limits are valid");
    let pose = random_pose(robot, &limits, rng)?;
    simulate_sample(robot, &pose.joints, noise, rng).ok()
}

/// Measurements of `truth` at random poses, as many as fit.
///
/// # Panics
/// If the robot has no pose: it is nothing like the nominal one.
pub fn measurements_of<T: Real, const N: usize>(
    truth: &Robot<T>,
    noise: Option<&Noise<T>>,
    rng: &mut Pcg32,
) -> [Sample<T>; N] {
    [(); N].map(|()| measured(truth, noise, rng).expect("a robot near nominal has poses"))
}
