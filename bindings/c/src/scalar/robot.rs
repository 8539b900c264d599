//! Robots and their kinematics.
#![allow(unsafe_code)] // naming symbols

use super::Real;
use crate::error::{Error, report, status_alone};
use crate::memory::{Held, HeldMut, In, New, Out, plain};
use crate::status::Status;
use delta_cal::nalgebra::Vector3;
use delta_cal::robot::Transmission;
use delta_cal::{Robot, SymmetricRobot};

plain! {
    /// The robot as a data sheet gives it: three equal arms 120 degrees apart, no tilt. Lengths in any one unit.
    pub struct Dimensions {
        /// From the base centre to the motor axes. Length.
        pub base_radius: Real,
        /// From the platform point to the forearms' ends. Length.
        pub platform_radius: Real,
        /// Upper arm. Length.
        pub upper_arm: Real,
        /// Forearm. Length.
        pub forearm: Real,
        /// Direction of the first arm; the others are 120 and 240 degrees further. Radians.
        pub azimuth: Real,
    }
}

/// Makes a robot from its dimensions, in `size` bytes of memory: write `sizeof *robot`.
///
/// Errors: `DCAL_GEOMETRY_...`.
#[unsafe(export_name = name!("robot_from_dimensions"))]
pub extern "C" fn robot_from_dimensions(
    mut robot: New<Robot<Real>>,
    size: usize,
    dimensions: In<Dimensions>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        robot.usable(size)?;
        let from = dimensions.get()?;
        let made = SymmetricRobot {
            base_radius: from.base_radius,
            platform_radius: from.platform_radius,
            upper_arm: from.upper_arm,
            forearm: from.forearm,
        }
        .robot_from_azimuth(from.azimuth)?;
        Ok(robot.put(size, &made)?)
    })
}

/// Makes a robot from its 24 parameters, in `size` bytes of memory: write `sizeof *robot`. Eight parameters an arm, in
/// the order `DCAL_DX` to `DCAL_LB`: lengths, and theta and alpha in radians.
///
/// Errors: `DCAL_GEOMETRY_...`.
#[unsafe(export_name = name!("robot_from_parameters"))]
pub extern "C" fn robot_from_parameters(
    mut robot: New<Robot<Real>>,
    size: usize,
    parameters: In<[[Real; 8]; 3]>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        robot.usable(size)?;
        let made = Robot::from_parameters(parameters.get()?)?;
        Ok(robot.put(size, &made)?)
    })
}

/// Writes a robot's 24 parameters, as `robot_from_parameters` takes them: lengths and radians.
#[unsafe(export_name = name!("robot_parameters"))]
pub extern "C" fn robot_parameters(
    robot: Held<Robot<Real>>,
    mut parameters: Out<[[Real; 8]; 3]>,
) -> Status {
    status_alone(robot.get().and_then(|own| parameters.put(own.parameters())))
}

/// Gives a robot the transmissions of its joints, which its kinematics and every calibration with it as the nominal robot
/// then use. Five numbers a joint: gain (no unit), c1, s1, c2 and s2 (radians). The angle of the arm is
/// q + gain q + c1 cos q + s1 sin q + c2 cos 2q + s2 sin 2q at the joint angle q. Zeros take them away.
///
/// Errors: `DCAL_GEOMETRY_TRANSMISSION`; the robot then keeps those that it had.
#[unsafe(export_name = name!("robot_set_transmissions"))]
pub extern "C" fn robot_set_transmissions(
    mut robot: HeldMut<Robot<Real>>,
    transmissions: In<[[Real; 5]; 3]>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        // Read first: the numbers may be anywhere, even inside the robot.
        let [first, second, third] = transmissions.get()?;
        let robot = robot.get()?;
        *robot = robot.with_transmissions([
            Transmission::new(first)?,
            Transmission::new(second)?,
            Transmission::new(third)?,
        ])?;
        Ok(())
    })
}

/// Writes a robot's transmissions, as `robot_set_transmissions` takes them.
#[unsafe(export_name = name!("robot_transmissions"))]
pub extern "C" fn robot_transmissions(
    robot: Held<Robot<Real>>,
    mut transmissions: Out<[[Real; 5]; 3]>,
) -> Status {
    let numbers = |own: &Robot<Real>| own.transmissions().map(|own| own.numbers());
    status_alone(robot.get().and_then(|own| transmissions.put(numbers(own))))
}

/// Forward kinematics: where the platform is at these joint angles. `joints`: q1, q2, q3, radians. `position`: x, y, z,
/// in the robot's unit of length.
///
/// Errors: `DCAL_UNREACHABLE`, `DCAL_SINGULAR_PARALLEL`, `DCAL_POSE_NOT_FINITE`, each with the arm.
#[unsafe(export_name = name!("robot_forward"))]
pub extern "C" fn robot_forward(
    robot: Held<Robot<Real>>,
    joints: In<[Real; 3]>,
    mut position: Out<[Real; 3]>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        let found = robot.get()?.forward(&joints.get()?)?;
        Ok(position.put([found.x, found.y, found.z])?)
    })
}

/// Inverse kinematics, elbows out: the joint angles at which the platform is at a position. `position`: x, y, z, in the
/// robot's unit of length. `joints`: q1, q2, q3, radians.
///
/// Errors: `DCAL_UNREACHABLE`, `DCAL_SINGULAR_SERIAL`, `DCAL_POSE_NOT_FINITE`, each with the arm.
#[unsafe(export_name = name!("robot_inverse"))]
pub extern "C" fn robot_inverse(
    robot: Held<Robot<Real>>,
    position: In<[Real; 3]>,
    mut joints: Out<[Real; 3]>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        let found = robot.get()?.inverse(&Vector3::from(position.get()?))?;
        Ok(joints.put(found)?)
    })
}
