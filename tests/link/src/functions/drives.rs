//! Linear drives and transmissions, and what tells the drives apart.

use core::mem::MaybeUninit;
use delta_cal::calibration::ToleranceError;
use delta_cal::kinematics::{JointLimits, JointLimitsError, KinematicsError};
use delta_cal::robot::{
    Arm, Drive, GeometryError, SymmetricLinearRobot, Transmission, TransmissionTolerance,
};
use delta_cal::{Parameter, Robot, Tolerance};
use nalgebra::{SMatrix, Vector3};

macro_rules! of_scalar {
    ($module:ident, $prefix:literal, $t:ident) => {
        mod $module {
            use super::*;

            symbols! { $prefix;
                fn arm_linear(parameters: &[$t; 7]) -> Result<Arm<$t>, GeometryError> {
                    Arm::linear(*parameters)
                }
                fn arm_with_parameters(
                    arm: &Arm<$t>,
                    parameters: &[$t; 8],
                ) -> Result<Arm<$t>, GeometryError> {
                    arm.with_parameters(*parameters)
                }
                fn arm_drive(arm: &Arm<$t>) -> Drive { arm.drive() }
                fn arm_elbow_speed(arm: &Arm<$t>) -> $t { arm.elbow_speed() }
                fn robot_drive(robot: &Robot<$t>) -> Drive { robot.drive() }
                fn robot_with_parameters(
                    robot: &Robot<$t>,
                    parameters: &[[$t; 8]; 3],
                ) -> Result<Robot<$t>, GeometryError> {
                    robot.with_parameters(*parameters)
                }
                fn robot_has_carriages_above(
                    robot: &Robot<$t>,
                    x: &Vector3<$t>,
                    q: &[$t; 3],
                ) -> bool {
                    robot.has_carriages_above(x, q)
                }
                fn symmetric_linear_robot(
                    dimensions: &SymmetricLinearRobot<$t>,
                ) -> Result<Robot<$t>, GeometryError> {
                    dimensions.robot()
                }
                fn symmetric_linear_robot_at(
                    dimensions: &SymmetricLinearRobot<$t>,
                    azimuths: &[$t; 3],
                ) -> Result<Robot<$t>, GeometryError> {
                    dimensions.robot_at(*azimuths)
                }
                fn limits_travel(
                    minimum: $t,
                    maximum: $t,
                ) -> Result<JointLimits<$t>, JointLimitsError> {
                    JointLimits::travel(minimum, maximum)
                }
                fn limits_drive(limits: &JointLimits<$t>) -> Drive { limits.drive() }
                fn transmission_new(numbers: &[$t; 5]) -> Result<Transmission<$t>, GeometryError> {
                    Transmission::new(*numbers)
                }
                fn transmission_numbers(own: &Transmission<$t>) -> [$t; 5] { own.numbers() }
                fn transmission_arm_angle(own: &Transmission<$t>, q: $t) -> ($t, $t) {
                    own.arm_angle(q)
                }
                fn transmission_joint_angle(own: &Transmission<$t>, angle: $t) -> $t {
                    own.joint_angle(angle)
                }
                fn transmission_tolerance(
                    sigma: $t,
                ) -> Result<TransmissionTolerance<$t>, GeometryError> {
                    TransmissionTolerance::new(sigma)
                }
                fn transmission_sigma(own: &TransmissionTolerance<$t>) -> $t { own.sigma() }
                fn arm_with_transmission(
                    arm: &Arm<$t>,
                    transmission: &Transmission<$t>,
                ) -> Result<Arm<$t>, GeometryError> {
                    arm.with_transmission(*transmission)
                }
                fn arm_transmission(arm: &Arm<$t>) -> Option<Transmission<$t>> {
                    arm.transmission().copied()
                }
                fn arm_constraint_by_transmission(
                    arm: &Arm<$t>,
                    x: &Vector3<$t>,
                    q: $t,
                ) -> [$t; 5] {
                    arm.constraint_by_transmission(x, q)
                }
                fn robot_with_transmissions(
                    robot: &Robot<$t>,
                    transmissions: &[Transmission<$t>; 3],
                ) -> Result<Robot<$t>, GeometryError> {
                    robot.with_transmissions(*transmissions)
                }
                fn robot_transmissions(robot: &Robot<$t>) -> [Transmission<$t>; 3] {
                    robot.transmissions()
                }
                fn robot_by_transmissions(
                    robot: &Robot<$t>,
                    x: &Vector3<$t>,
                    q: &[$t; 3],
                ) -> Result<SMatrix<$t, 3, 15>, KinematicsError> {
                    robot.by_transmissions(x, q)
                }
                fn tolerance_with_linear(
                    tolerance: &Tolerance<$t>,
                    zero: $t,
                    scale: $t,
                ) -> Result<Tolerance<$t>, ToleranceError> {
                    tolerance.with_linear(zero, scale)
                }
                fn tolerance_of_places(tolerance: &Tolerance<$t>, arm: &Arm<$t>) -> [$t; 8] {
                    tolerance.of_places(arm)
                }
                fn tolerance_of_arm(
                    tolerance: &Tolerance<$t>,
                    arm: &Arm<$t>,
                    parameter: Parameter,
                ) -> $t {
                    tolerance.of_arm(arm, parameter)
                }
                fn tolerance_with_radius(
                    tolerance: &Tolerance<$t>,
                    radius: $t,
                ) -> Result<Tolerance<$t>, ToleranceError> {
                    tolerance.with_radius(radius)
                }
                fn tolerance_radius(tolerance: &Tolerance<$t>) -> $t { tolerance.radius() }
                fn tolerance_outwards(tolerance: &Tolerance<$t>, arm: &Arm<$t>) -> [$t; 2] {
                    tolerance.outwards(arm)
                }
            }
        }
    };
}

of_scalar!(single, "f32_", f32);
of_scalar!(double, "f64_", f64);

symbols! { "any_";
    fn drive_parameters(drive: Drive) -> &'static [Parameter] { drive.parameters() }
    fn drive_places(drive: Drive) -> [Option<Parameter>; 8] { drive.places() }
}
