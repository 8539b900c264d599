//! The robot: its parameters, its kinematics, the frames of its positions, and simulations of it.

use core::mem::MaybeUninit;
use delta_cal::frame::{AlignmentError, RigidTransform};
use delta_cal::kinematics::{
    JointLimits, JointLimitsError, KinematicsError, PlatformJacobian, SingularityDistance,
};
use delta_cal::robot::{Arm, ArmBasis, GeometryError, ParameterKind};
use delta_cal::simulate::{PoseError, made_robot, random_pose, simulate_sample, standard_normal};
use delta_cal::{ArmIndex, Noise, Parameter, Robot, Sample, SymmetricRobot, Tolerance};
use nalgebra::{SVector, Vector3};
use rand_pcg::Pcg32;

macro_rules! of_scalar {
    ($module:ident, $prefix:literal, $t:ident, $other:ident) => {
        mod $module {
            use super::*;

            symbols! { $prefix;
                // Robot
                fn arm_new(parameters: &[$t; 8]) -> Result<Arm<$t>, GeometryError> {
                    Arm::new(*parameters)
                }
                fn arm_parameters(arm: &Arm<$t>) -> [$t; 8] { arm.parameters() }
                fn arm_get(arm: &Arm<$t>, parameter: Parameter) -> $t { arm.get(parameter) }
                fn arm_basis(arm: &Arm<$t>) -> ArmBasis<$t> { *arm.basis() }
                fn arm_d(arm: &Arm<$t>) -> Vector3<$t> { arm.d() }
                fn arm_la(arm: &Arm<$t>) -> ($t, $t) { arm.la() }
                fn arm_lb(arm: &Arm<$t>) -> $t { arm.lb() }
                fn arm_upper_arm_length(arm: &Arm<$t>) -> $t { arm.upper_arm_length() }
                fn arm_elbow(arm: &Arm<$t>, q: $t) -> Vector3<$t> { arm.elbow(q) }
                fn arm_elbow_derivative(arm: &Arm<$t>, q: $t) -> Vector3<$t> {
                    arm.elbow_derivative(q)
                }
                fn arm_cast(arm: &Arm<$t>) -> Result<Arm<$other>, GeometryError> { arm.cast() }
                fn robot_new(arms: &[Arm<$t>; 3]) -> Result<Robot<$t>, GeometryError> {
                    Robot::new(*arms)
                }
                fn robot_from_parameters(
                    parameters: &[[$t; 8]; 3],
                ) -> Result<Robot<$t>, GeometryError> {
                    Robot::from_parameters(*parameters)
                }
                fn robot_parameters(robot: &Robot<$t>) -> [[$t; 8]; 3] { robot.parameters() }
                fn robot_arms(robot: &Robot<$t>) -> [Arm<$t>; 3] { *robot.arms() }
                fn robot_arm(robot: &Robot<$t>, arm: ArmIndex) -> Arm<$t> { *robot.arm(arm) }
                fn robot_up(robot: &Robot<$t>) -> Vector3<$t> { robot.up() }
                fn robot_cast(robot: &Robot<$t>) -> Result<Robot<$other>, GeometryError> {
                    robot.cast()
                }
                fn symmetric_robot(
                    dimensions: &SymmetricRobot<$t>,
                ) -> Result<Robot<$t>, GeometryError> {
                    dimensions.robot()
                }
                fn symmetric_robot_from_azimuth(
                    dimensions: &SymmetricRobot<$t>,
                    azimuth: $t,
                ) -> Result<Robot<$t>, GeometryError> {
                    dimensions.robot_from_azimuth(azimuth)
                }

                // Frames
                fn transform_identity() -> RigidTransform<$t> { RigidTransform::identity() }
                fn transform_apply(
                    transform: &RigidTransform<$t>,
                    point: &Vector3<$t>,
                ) -> Vector3<$t> {
                    transform.apply(point)
                }
                fn transform_inverse(transform: &RigidTransform<$t>) -> RigidTransform<$t> {
                    transform.inverse()
                }
                fn transform_align(
                    pairs: &[(Vector3<$t>, Vector3<$t>); 40],
                    count: usize,
                ) -> Result<RigidTransform<$t>, AlignmentError> {
                    RigidTransform::align(pairs.iter().take(count).copied())
                }

                // Kinematics
                fn forward(
                    robot: &Robot<$t>,
                    q: &[$t; 3],
                ) -> Result<Vector3<$t>, KinematicsError> {
                    robot.forward(q)
                }
                fn inverse(
                    robot: &Robot<$t>,
                    x: &Vector3<$t>,
                ) -> Result<[$t; 3], KinematicsError> {
                    robot.inverse(x)
                }
                fn platform_jacobian(
                    robot: &Robot<$t>,
                    x: &Vector3<$t>,
                    q: &[$t; 3],
                ) -> Result<PlatformJacobian<$t>, KinematicsError> {
                    robot.platform_jacobian(x, q)
                }
                fn singularity_distance(
                    robot: &Robot<$t>,
                    x: &Vector3<$t>,
                    q: &[$t; 3],
                ) -> SingularityDistance<$t> {
                    robot.singularity_distance(x, q)
                }
                fn is_clear(distance: &SingularityDistance<$t>) -> bool {
                    distance.is_clear()
                }
                fn constraint(arm: &Arm<$t>, x: &Vector3<$t>, q: $t) -> $t {
                    arm.constraint(x, q)
                }
                fn constraint_by_position(arm: &Arm<$t>, x: &Vector3<$t>, q: $t) -> Vector3<$t> {
                    arm.constraint_by_position(x, q)
                }
                fn constraint_by_joint(arm: &Arm<$t>, x: &Vector3<$t>, q: $t) -> $t {
                    arm.constraint_by_joint(x, q)
                }
                fn constraint_by_parameters(
                    arm: &Arm<$t>,
                    x: &Vector3<$t>,
                    q: $t,
                ) -> SVector<$t, 8> {
                    arm.constraint_by_parameters(x, q)
                }

                // Joint limits
                fn limits_new(
                    minimum: $t,
                    maximum: $t,
                ) -> Result<JointLimits<$t>, JointLimitsError> {
                    JointLimits::new(minimum, maximum)
                }
                fn limits_minimum(limits: &JointLimits<$t>) -> $t { limits.minimum() }
                fn limits_maximum(limits: &JointLimits<$t>) -> $t { limits.maximum() }
                fn limits_at(limits: &JointLimits<$t>, fraction: $t) -> $t {
                    limits.at(fraction)
                }

                // Simulation
                fn made(
                    robot: &Robot<$t>,
                    tolerance: &Tolerance<$t>,
                    rng: &mut Pcg32,
                ) -> Result<Robot<$t>, GeometryError> {
                    made_robot(robot, tolerance, rng)
                }
                fn normal(rng: &mut Pcg32) -> $t { standard_normal(rng) }
                fn pose(
                    robot: &Robot<$t>,
                    limits: &JointLimits<$t>,
                    rng: &mut Pcg32,
                ) -> Result<Sample<$t>, PoseError> {
                    random_pose(robot, limits, rng)
                }
                fn simulate(
                    robot: &Robot<$t>,
                    joints: &[$t; 3],
                    noise: Option<&Noise<$t>>,
                    rng: &mut Pcg32,
                ) -> Result<Sample<$t>, KinematicsError> {
                    simulate_sample(robot, joints, noise, rng)
                }
            }
        }
    };
}

of_scalar!(single, "f32_", f32, f64);
of_scalar!(double, "f64_", f64, f32);

symbols! { "any_";
    fn arm_index(arm: ArmIndex) -> usize { arm.index() }
    fn parameter_index(parameter: Parameter) -> usize { parameter.index() }
    fn parameter_kind(parameter: Parameter) -> ParameterKind { parameter.kind() }
    fn parameter_symbol(parameter: Parameter) -> &'static str { parameter.symbol() }
    fn kinematics_error_arm(error: &KinematicsError) -> ArmIndex { error.arm() }
}
