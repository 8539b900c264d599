//! The calibration of one arm after the other: its settings, its steps, and the robust fit.

use super::samples::STORED;
use core::mem::MaybeUninit;
use delta_cal::calibration::limits::chi_square_quantile;
use delta_cal::calibration::step_control::{Prospect, StepControl, StepResult, blur};
use delta_cal::calibration::{ArmOutcome, ArmSolver, Solver, Start, ToleranceError};
use delta_cal::classical::{StoredCalibrator, StoredError};
use delta_cal::robust::{
    Loss, RobustOutcome, RobustRefusal, WeighedSample, WeightNormalization, robust_fit,
};
use delta_cal::samples::{ArmFactor, MergeError, SampleError};
use delta_cal::{
    ArmIndex, Calibrator, Noise, Parameter, Progress, Refusal, Robot, RobotOutcome, RobotSolver,
    Sample, Settings, Tolerance,
};

macro_rules! of_scalar {
    ($module:ident, $prefix:literal, $t:ident) => {
        mod $module {
            use super::*;

            symbols! { $prefix;
                // Tolerance and settings
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
            }
        }
    };
}

of_scalar!(single, "f32_", f32);
of_scalar!(double, "f64_", f64);

symbols! { "any_";
    fn refusal_arm(refusal: &Refusal) -> Option<ArmIndex> { refusal.arm() }
}
