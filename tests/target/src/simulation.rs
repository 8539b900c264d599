//! Robots drawn near the nominal one, and their measurements.

use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Arm;
use delta_cal::simulate::{random_pose, simulate_sample, standard_normal};
use delta_cal::{Noise, Parameter, Real, Robot, Sample, Tolerance};
use rand_pcg::Pcg32;

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
    let pose = random_pose(robot, &limits, rng).ok()?;
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
