//! The symbols: both scalars, every function; results are written through a pointer.
#![allow(unsafe_code)] // naming a symbol
#![allow(improper_ctypes_definitions)] // nobody calls them
#![allow(clippy::too_many_arguments)]

use core::mem::MaybeUninit;
use delta_cal::calibration::limits::chi_square_quantile;
use delta_cal::calibration::step_control::{Prospect, StepControl, StepResult, blur};
use delta_cal::calibration::{ArmOutcome, ArmSolver, Solver, Start, ToleranceError};
use delta_cal::classical::{StoredArmSamples, StoredCalibrator, StoredError};
use delta_cal::frame::{AlignmentError, RigidTransform};
use delta_cal::kinematics::{
    JointLimits, JointLimitsError, KinematicsError, PlatformJacobian, SingularityDistance,
};
use delta_cal::robot::{Arm, ArmBasis, Drive, GeometryError, ParameterKind};
use delta_cal::robust::{
    Loss, RobustOutcome, RobustRefusal, WeighedSample, WeightNormalization, robust_fit,
};
use delta_cal::samples::{ArmFactor, MergeError, NoiseError, NominalArm, SampleError};
use delta_cal::simulate::{PoseError, made_robot, random_pose, simulate_sample, standard_normal};
use delta_cal::{
    ArmIndex, Calibrator, Noise, Parameter, Progress, Real, Refusal, Robot, RobotOutcome,
    RobotSolver, Sample, Settings, SymmetricRobot, Tolerance,
};
use nalgebra::{SVector, Vector3};
use rand_pcg::Pcg32;

/// What the form that keeps its samples holds here.
const STORED: usize = 24;

macro_rules! symbols {
    ($prefix:literal; $(
        fn $name:ident($($argument:ident: $kind:ty),* $(,)?) -> $result:ty $body:block
    )*) => {$(
        #[unsafe(export_name = concat!("core_", $prefix, stringify!($name)))]
        extern "C" fn $name(out: &mut MaybeUninit<$result>, $($argument: $kind),*) {
            out.write($body);
        }
    )*};
}

mod drives;
mod joint;
mod observations;
mod stream;
mod stream_calibrator;

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

                // Assumptions
                fn noise_new(position: $t, joint: $t) -> Result<Noise<$t>, NoiseError> {
                    Noise::new(position, joint)
                }
                fn noise_position(noise: &Noise<$t>) -> $t { noise.position() }
                fn noise_joint(noise: &Noise<$t>) -> $t { noise.joint() }
                fn tolerance_new(
                    length: $t,
                    angle: $t,
                ) -> Result<Tolerance<$t>, ToleranceError> {
                    Tolerance::new(length, angle)
                }
                fn tolerance_of(tolerance: &Tolerance<$t>, parameter: Parameter) -> $t {
                    tolerance.of(parameter)
                }
                fn settings_default() -> Settings<$t> { Settings::default() }
                fn settings_new() -> Settings<$t> { Settings::new() }
                fn settings_with(
                    settings: &Settings<$t>,
                    noise: Option<Noise<$t>>,
                    tolerance: Option<Tolerance<$t>>,
                    solver: Solver,
                    start: Start,
                    limit: u16,
                ) -> Settings<$t> {
                    settings
                        .with_noise(noise)
                        .with_tolerance(tolerance)
                        .with_solver(solver)
                        .with_start(start)
                        .with_iteration_limit(limit)
                }
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

                // Samples
                fn sample_check(sample: &Sample<$t>, drive: Drive) -> Result<(), SampleError> {
                    sample.check(drive)
                }
                fn nominal_arm_new(
                    arm: &Arm<$t>,
                    centre: &Vector3<$t>,
                    noise: Option<&Noise<$t>>,
                ) -> NominalArm<$t> {
                    NominalArm::new(arm, centre, noise.copied())
                }
                fn nominal_arm_arm(nominal: &NominalArm<$t>) -> Arm<$t> { *nominal.arm() }
                fn nominal_arm_noise(nominal: &NominalArm<$t>) -> Option<Noise<$t>> {
                    nominal.noise().copied()
                }
                fn nominal_arm_scale(nominal: &NominalArm<$t>) -> $t { nominal.scale() }
                fn nominal_arm_centre(nominal: &NominalArm<$t>) -> Vector3<$t> {
                    *nominal.centre()
                }
                fn factor_new(nominal: &NominalArm<$t>) -> ArmFactor<$t> {
                    ArmFactor::new(*nominal)
                }
                fn factor_nominal_arm(factor: &ArmFactor<$t>) -> NominalArm<$t> {
                    *factor.nominal()
                }
                fn factor_samples(factor: &ArmFactor<$t>) -> u64 { factor.samples() }
                fn factor_effective_samples(factor: &ArmFactor<$t>) -> $t {
                    factor.effective_samples()
                }
                fn factor_add(
                    factor: &mut ArmFactor<$t>,
                    x: &Vector3<$t>,
                    q: $t,
                    arm: ArmIndex,
                ) -> Result<(), SampleError> {
                    factor.add(x, q, arm)
                }
                fn factor_add_many(
                    factor: &mut ArmFactor<$t>,
                    samples: &[(Vector3<$t>, $t); 40],
                    count: usize,
                    arm: ArmIndex,
                ) -> Result<(), (usize, SampleError)> {
                    let samples = samples.iter().take(count);
                    factor.add_many(samples.map(|(x, q)| (x, *q)), arm)
                }
                fn factor_merge(
                    factor: &mut ArmFactor<$t>,
                    other: &ArmFactor<$t>,
                ) -> Result<(), MergeError> {
                    factor.merge(other)
                }
                fn factor_forget(factor: &mut ArmFactor<$t>, lambda: $t) -> () {
                    factor.forget(lambda);
                }
                fn factor_sum_of_squares(factor: &ArmFactor<$t>, arm: &Arm<$t>) -> $t {
                    factor.sum_of_squares(arm)
                }
                fn stored_new(nominal: &NominalArm<$t>) -> StoredArmSamples<$t, STORED> {
                    StoredArmSamples::new(*nominal)
                }
                fn stored_nominal_arm(stored: &StoredArmSamples<$t, STORED>) -> NominalArm<$t> {
                    *stored.nominal()
                }
                fn stored_len(stored: &StoredArmSamples<$t, STORED>) -> usize { stored.len() }
                fn stored_is_empty(stored: &StoredArmSamples<$t, STORED>) -> bool {
                    stored.is_empty()
                }
                fn stored_add(
                    stored: &mut StoredArmSamples<$t, STORED>,
                    x: &Vector3<$t>,
                    q: $t,
                    arm: ArmIndex,
                ) -> Result<(), StoredError> {
                    stored.add(x, q, arm)
                }
                fn stored_check(
                    stored: &StoredArmSamples<$t, STORED>,
                    x: &Vector3<$t>,
                    q: $t,
                    arm: ArmIndex,
                ) -> Result<(), StoredError> {
                    stored.check(x, q, arm)
                }

                // One arm
                fn arm_solver_new(
                    factor: &ArmFactor<$t>,
                    arm: ArmIndex,
                    settings: &Settings<$t>,
                ) -> Result<ArmSolver<$t>, Refusal> {
                    ArmSolver::new(factor, arm, settings)
                }
                fn arm_solver_iterations(solver: &ArmSolver<$t>) -> u16 { solver.iterations() }
                fn arm_solver_step(
                    solver: &mut ArmSolver<$t>,
                    factor: &ArmFactor<$t>,
                ) -> Progress {
                    solver.step(factor)
                }
                fn arm_solver_outcome(
                    solver: &ArmSolver<$t>,
                    factor: &ArmFactor<$t>,
                ) -> Result<ArmOutcome<$t>, Refusal> {
                    solver.outcome(factor)
                }

                // Steps of an iteration
                fn step_control_new(method: Solver) -> StepControl<$t> { StepControl::new(method) }
                fn step_control_solver(control: &StepControl<$t>) -> Solver { control.solver() }
                fn step_control_damping(control: &StepControl<$t>) -> $t { control.damping() }
                fn step_control_judge(
                    control: &mut StepControl<$t>,
                    gain: $t,
                    cost: $t,
                    terms_squared: $t,
                ) -> Prospect<$t> {
                    control.judge(gain, cost, terms_squared)
                }
                fn step_control_accepts(
                    control: &StepControl<$t>,
                    prospect: &Prospect<$t>,
                    cost: $t,
                ) -> bool {
                    control.accepts(prospect, cost)
                }
                fn step_control_accepted(
                    control: &mut StepControl<$t>,
                    prospect: &Prospect<$t>,
                ) -> StepResult {
                    control.accepted(prospect)
                }
                fn step_control_rejected(
                    control: &mut StepControl<$t>,
                    prospect: &Prospect<$t>,
                ) -> StepResult {
                    control.rejected(prospect)
                }
                fn cost_blur(cost: $t, terms_squared: $t) -> $t { blur(cost, terms_squared) }

                // The robot
                fn calibrator_new(robot: &Robot<$t>, settings: &Settings<$t>) -> Calibrator<$t> {
                    Calibrator::new(robot, settings)
                }
                fn calibrator_add(
                    calibrator: &mut Calibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<(), SampleError> {
                    calibrator.add(sample)
                }
                fn calibrator_flush(calibrator: &mut Calibrator<$t>) -> () { calibrator.flush(); }
                fn calibrator_add_many(
                    calibrator: &mut Calibrator<$t>,
                    samples: &&[Sample<$t>],
                ) -> Result<(), (usize, SampleError)> {
                    calibrator.add_many(samples)
                }
                fn calibrator_merge(
                    calibrator: &mut Calibrator<$t>,
                    other: &Calibrator<$t>,
                ) -> Result<(), MergeError> {
                    calibrator.merge(other)
                }
                fn calibrator_forget(calibrator: &mut Calibrator<$t>, lambda: $t) -> () {
                    calibrator.forget(lambda);
                }
                fn calibrator_robot(calibrator: &Calibrator<$t>) -> Robot<$t> {
                    calibrator.robot()
                }
                fn calibrator_settings(calibrator: &Calibrator<$t>) -> Settings<$t> {
                    *calibrator.settings()
                }
                fn calibrator_arms(calibrator: &Calibrator<$t>) -> [ArmFactor<$t>; 3] {
                    *calibrator.arms()
                }
                fn calibrator_samples(calibrator: &Calibrator<$t>) -> u64 {
                    calibrator.samples()
                }
                fn calibrator_solve(
                    calibrator: &mut Calibrator<$t>,
                ) -> Result<RobotOutcome<$t>, Refusal> {
                    calibrator.solve()
                }
                fn solver_new(
                    calibrator: &mut Calibrator<$t>,
                ) -> Result<RobotSolver<$t>, Refusal> {
                    RobotSolver::new(calibrator)
                }
                fn solver_arm(solver: &RobotSolver<$t>) -> ArmIndex { solver.arm() }
                fn solver_step(
                    solver: &mut RobotSolver<$t>,
                    calibrator: &Calibrator<$t>,
                ) -> Result<Progress, Refusal> {
                    solver.step(calibrator)
                }
                fn solver_outcome(
                    solver: &RobotSolver<$t>,
                ) -> Result<RobotOutcome<$t>, Refusal> {
                    solver.outcome()
                }
                fn outcome_standard_deviation(
                    outcome: &ArmOutcome<$t>,
                    parameter: Parameter,
                ) -> Option<$t> {
                    outcome.standard_deviation(parameter)
                }

                // The robot, samples kept
                fn stored_calibrator_new(
                    robot: &Robot<$t>,
                    settings: &Settings<$t>,
                ) -> StoredCalibrator<$t, STORED> {
                    StoredCalibrator::new(robot, settings)
                }
                fn stored_calibrator_add(
                    calibrator: &mut StoredCalibrator<$t, STORED>,
                    sample: &Sample<$t>,
                ) -> Result<(), StoredError> {
                    calibrator.add(sample)
                }
                fn stored_calibrator_solve(
                    calibrator: &mut StoredCalibrator<$t, STORED>,
                ) -> Result<RobotOutcome<$t>, Refusal> {
                    calibrator.solve()
                }

                // Robust fit
                fn robust(
                    robot: &Robot<$t>,
                    settings: &Settings<$t>,
                    samples: &[Sample<$t>],
                    loss: Loss,
                    work: &mut [WeighedSample<$t>],
                ) -> Result<RobustOutcome<$t>, RobustRefusal> {
                    robust_fit(robot, settings, samples, loss, work)
                }
                fn weighed_vacant() -> WeighedSample<$t> { WeighedSample::vacant() }
                fn weighed_weight(sample: &WeighedSample<$t>) -> $t { sample.weight() }
                fn weighed_factor(sample: &WeighedSample<$t>) -> $t { sample.factor() }
                fn weighed_residual(sample: &WeighedSample<$t>) -> $t { sample.residual() }
                fn weighed_suspected(sample: &WeighedSample<$t>) -> bool { sample.suspected() }
                fn loss_weight(loss: Loss, r: $t) -> $t { loss.weight(r) }
                fn loss_slope(loss: Loss, r: $t) -> $t { loss.slope(r) }
                fn loss_stretch(loss: Loss, dimensions: u8) -> $t { loss.stretch(dimensions) }
                fn loss_normalization(loss: Loss, residuals: &[($t, $t, $t)]) -> WeightNormalization<$t> {
                    loss.normalization(residuals.iter().copied())
                }

                // Limits
                fn quantile(freedom: $t) -> $t { chi_square_quantile(freedom) }
                fn needed(settings: &Settings<$t>) -> u64 { settings.samples_needed() }

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

                // The scalar
                fn from_f64(value: f64) -> $t { <$t as Real>::from_f64(value) }
                fn to_f64(value: $t) -> f64 { value.to_f64() }
                fn from_count(count: u64) -> $t { <$t as Real>::from_count(count) }
                fn finite(value: $t) -> bool { value.finite() }
                fn magnitude(value: $t) -> $t { value.magnitude() }
                fn square_root(value: $t) -> $t { value.square_root() }
                fn inverse_square_root(value: $t) -> $t { value.inverse_square_root() }
                fn sine_cosine(value: $t) -> ($t, $t) { value.sine_cosine() }
                fn angle_over(value: $t, x: $t) -> $t { value.angle_over(x) }
                fn natural_logarithm(value: $t) -> $t { value.natural_logarithm() }
                fn nearest_integer(value: $t) -> $t { value.nearest_integer() }
                fn power_of_two_below(value: $t) -> $t { value.power_of_two_below() }
                fn larger(value: $t, other: $t) -> $t { value.larger(other) }
                fn squared(value: $t) -> $t { value.squared() }
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
    fn refusal_arm(refusal: &Refusal) -> Option<ArmIndex> { refusal.arm() }
}
