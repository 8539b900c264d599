//! Simulated measurements of a robot with known parameters.

use crate::Real;
use crate::calibration::Tolerance;
use crate::kinematics::{JointLimits, KinematicsError};
use crate::robot::{Drive, GeometryError, Parameter, Robot};
use crate::samples::{Noise, Sample};
use nalgebra::Vector3;
use rand_core::Rng;

/// A number from the standard normal distribution (Marsaglia's polar method).
pub fn standard_normal<T: Real, R: Rng + ?Sized>(rng: &mut R) -> T {
    // Accepts π/4 of the draws: 64 failures in a row have probability 1e-43. The bound prevents a stuck generator from
    // hanging a controller.
    for _ in 0..64 {
        let a = T::TWO * uniform::<T, R>(rng) - T::ONE;
        let b = T::TWO * uniform::<T, R>(rng) - T::ONE;
        let squared = a * a + b * b;
        if squared > T::ZERO && squared < T::ONE {
            return a * (-T::TWO * squared.natural_logarithm() / squared).square_root();
        }
    }
    T::ZERO
}

/// A uniform number in [0, 1), in steps of 2⁻²⁴ so that both scalar types represent it exactly.
fn uniform<T: Real, R: Rng + ?Sized>(rng: &mut R) -> T {
    T::from_count(u64::from(rng.next_u32() >> 8)) * T::from_f64(1.0 / 16_777_216.0)
}

/// Joint angles drawn uniformly within the limits, and accepted if the platform can reach the pose and it is clear of
/// singularities by the inverse-kinematics Jacobian ([`SingularityDistance`](crate::kinematics::SingularityDistance)):
/// |det| of the forearms' unit vectors at least 0.05 (type 2), and each forearm at least 6° off its upper arm's line
/// (type 1). With linear drives the carriages are above the platform.
///
/// `None` after 10,000 draws: within its limits the robot has (almost) no such pose.
pub fn random_pose<T: Real, R: Rng + ?Sized>(
    robot: &Robot<T>,
    limits: &JointLimits<T>,
    rng: &mut R,
) -> Option<Sample<T>> {
    for _ in 0..10_000 {
        let joints = [(); 3].map(|()| limits.at(uniform(rng)));
        if let Ok(position) = robot.forward(&joints)
            && robot.singularity_distance(&position, &joints).is_clear()
            && robot.has_carriages_above(&position, &joints)
        {
            return Some(Sample { joints, position });
        }
    }
    None
}

/// A robot manufactured to a tolerance: each parameter is normal about its nominal value; if the tolerance states
/// [joint zeros](Tolerance::with_joint_zero), so are the length and direction of each upper arm.
///
/// # Errors
/// In the rare case that the drawn parameters are not a valid robot.
pub fn made_robot<T: Real, R: Rng + ?Sized>(
    nominal: &Robot<T>,
    tolerance: &Tolerance<T>,
    rng: &mut R,
) -> Result<Robot<T>, GeometryError> {
    let mut parameters = nominal.parameters();
    for (values, arm) in parameters.iter_mut().zip(nominal.arms()) {
        let zero = tolerance
            .joint_zero()
            .filter(|_| arm.drive() == Drive::Rotary);
        let mut turn = T::ZERO;
        for (value, place) in values.iter_mut().zip(arm.drive().places()) {
            let Some(parameter) = place else { continue };
            let off = standard_normal::<T, R>(rng);
            match (parameter, zero) {
                // The length; La_y follows from both.
                (Parameter::LaX, Some(_)) => *value = tolerance.of(parameter) * off,
                (Parameter::LaY, Some(zero)) => turn = zero * off,
                _ => *value += tolerance.of(parameter) * off,
            }
        }
        if zero.is_some() {
            let [.., la_x, la_y, _] = values;
            let (x, y) = arm.la();
            let (sine, cosine) = turn.sine_cosine();
            let part = T::ONE + *la_x / arm.upper_arm_length();
            *la_x = (x * cosine - y * sine) * part;
            *la_y = (x * sine + y * cosine) * part;
        }
    }
    if tolerance.radius() > T::ZERO {
        let common = standard_normal::<T, R>(rng);
        for (values, arm) in parameters.iter_mut().zip(nominal.arms()) {
            for (value, outwards) in values.iter_mut().zip(tolerance.outwards(arm)) {
                *value += outwards * common;
            }
        }
    }
    if tolerance.forearm() > T::ZERO {
        let common = tolerance.forearm() * standard_normal::<T, R>(rng);
        for [.., lb] in &mut parameters {
            *lb += common;
        }
    }
    nominal.with_parameters(parameters)
}

/// A simulated measurement of the pose, with noise on the position and the joint angles.
///
/// # Errors
/// If the robot has no pose at these joint angles, from which the exact position is computed.
///
/// ```
/// use delta_cal::{Noise, SymmetricRobot};
/// use delta_cal::kinematics::JointLimits;
/// use delta_cal::simulate::{random_pose, simulate_sample};
/// use rand_core::SeedableRng;
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }
///     .robot()?;
/// let limits = JointLimits::new(-60f64.to_radians(), 90f64.to_radians())?;
/// let mut rng = rand_pcg::Pcg32::seed_from_u64(1);
/// let pose = random_pose(&robot, &limits, &mut rng).ok_or("no pose")?;
/// let measured = simulate_sample(&robot, &pose.joints, Some(&Noise::new(0.01, 0.0)?), &mut rng)?;
/// assert!((measured.position - pose.position).norm() < 0.1);
/// # Ok(())
/// # }
/// ```
pub fn simulate_sample<T: Real, R: Rng + ?Sized>(
    robot: &Robot<T>,
    joints: &[T; 3],
    noise: Option<&Noise<T>>,
    rng: &mut R,
) -> Result<Sample<T>, KinematicsError> {
    let position = robot.forward(joints)?;
    let Some(noise) = noise else {
        return Ok(Sample {
            joints: *joints,
            position,
        });
    };
    Ok(Sample {
        joints: joints.map(|q| q + noise.joint() * standard_normal::<T, R>(rng)),
        position: position.zip_map(&Vector3::from(noise.position_by_axis()), |c, sigma| {
            c + sigma * standard_normal::<T, R>(rng)
        }),
    })
}
