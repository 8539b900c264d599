//! The calibration of all 24 parameters together.

use core::mem::MaybeUninit;
use delta_cal::calibration::{
    ArmOutcome, FreeFrame, JointCalibrator, JointNormal, JointOutcome, JointSolver, Minimizer,
    Motion, Prior, Problem, TolerancePrior, Triangle,
};
use delta_cal::samples::{
    JointDisplacement, JointFactor, MergeError, NoiseError, NominalArm, SampleError,
};
use delta_cal::{
    ArmIndex, Calibrator, Noise, Parameter, Progress, Refusal, Robot, RobotOutcome, Sample,
    Settings, Tolerance,
};
use nalgebra::Vector3;

macro_rules! of_scalar {
    ($module:ident, $prefix:literal, $t:ident) => {
        mod $module {
            use super::*;

            type At = <JointFactor<$t> as Problem<$t, 24, 25, 325>>::At;
            type JointMinimizer = Minimizer<$t, At, TolerancePrior<$t, 24>, 24, 25, 325>;

            symbols! { $prefix;
                // Noise
                fn noise_by_axis(position: &[$t; 3], joint: $t) -> Result<Noise<$t>, NoiseError> {
                    Noise::by_axis(*position, joint)
                }
                fn noise_position_by_axis(noise: &Noise<$t>) -> [$t; 3] {
                    noise.position_by_axis()
                }
                fn noise_isotropic(noise: &Noise<$t>) -> Option<$t> { noise.isotropic() }

                // Samples
                fn tolerance_prior_new(
                    robot: &Robot<$t>,
                    units: &[$t; 24],
                    tolerance: Option<&Tolerance<$t>>,
                ) -> TolerancePrior<$t, 24> {
                    TolerancePrior::new(robot, units, tolerance)
                }
                fn tolerance_prior_weights(prior: &TolerancePrior<$t, 24>) -> [$t; 24] {
                    *prior.weights()
                }
                fn tolerance_prior_information(
                    prior: &TolerancePrior<$t, 24>,
                    row: usize,
                    column: usize,
                ) -> $t {
                    prior.information(row, column)
                }
                fn tolerance_prior_rows(
                    prior: &TolerancePrior<$t, 24>,
                    sigma: $t,
                    correction: &[$t; 24],
                ) -> JointNormal<$t> {
                    prior.rows(sigma, correction)
                }
                fn free_frame_new(
                    robot: &Robot<$t>,
                    units: &[$t; 24],
                    tolerance: Option<&Tolerance<$t>>,
                ) -> FreeFrame<$t> {
                    FreeFrame::new(robot, units, tolerance)
                }
                fn free_frame_motion(frame: &FreeFrame<$t>, correction: &[$t; 24]) -> Motion<$t> {
                    frame.motion(correction)
                }
                fn joint_factor_new(
                    robot: &Robot<$t>,
                    centre: &Vector3<$t>,
                    noise: Option<&Noise<$t>>,
                ) -> JointFactor<$t> {
                    JointFactor::new(robot, centre, noise.copied())
                }
                fn joint_factor_nominal_arms(factor: &JointFactor<$t>) -> [NominalArm<$t>; 3] {
                    *factor.nominal_arms()
                }
                fn joint_factor_noise(factor: &JointFactor<$t>) -> Option<Noise<$t>> {
                    factor.noise().copied()
                }
                fn joint_factor_unit(factor: &JointFactor<$t>) -> $t { factor.unit() }
                fn joint_factor_samples(factor: &JointFactor<$t>) -> u64 { factor.samples() }
                fn joint_factor_effective_samples(factor: &JointFactor<$t>) -> $t {
                    factor.effective_samples()
                }
                fn joint_factor_check(
                    factor: &JointFactor<$t>,
                    sample: &Sample<$t>,
                ) -> Result<(), SampleError> {
                    factor.check(sample)
                }
                fn joint_factor_add(
                    factor: &mut JointFactor<$t>,
                    sample: &Sample<$t>,
                ) -> Result<(), SampleError> {
                    factor.add(sample)
                }
                fn joint_factor_add_weighted(
                    factor: &mut JointFactor<$t>,
                    samples: &[(Sample<$t>, $t)],
                    effective: $t,
                ) -> Result<(), (usize, SampleError)> {
                    let weighted = samples.iter().map(|(sample, weight)| (sample, *weight));
                    factor.add_weighted(weighted, effective)
                }
                fn joint_factor_residual(
                    factor: &JointFactor<$t>,
                    sample: &Sample<$t>,
                    at: &JointDisplacement<$t>,
                ) -> $t {
                    factor.residual(sample, at)
                }
                fn joint_factor_add_many(
                    factor: &mut JointFactor<$t>,
                    samples: &[Sample<$t>],
                ) -> Result<(), (usize, SampleError)> {
                    factor.add_many(samples)
                }
                fn joint_factor_merge(
                    factor: &mut JointFactor<$t>,
                    other: &JointFactor<$t>,
                ) -> Result<(), MergeError> {
                    factor.merge(other)
                }
                fn joint_factor_forget(factor: &mut JointFactor<$t>, lambda: $t) -> () {
                    factor.forget(lambda);
                }
                fn joint_factor_sum_of_squares(
                    factor: &JointFactor<$t>,
                    robot: &Robot<$t>,
                ) -> $t {
                    factor.sum_of_squares(robot)
                }

                // Calibrator and solver
                fn joint_new(robot: &Robot<$t>, settings: &Settings<$t>) -> JointCalibrator<$t> {
                    JointCalibrator::new(robot, settings)
                }
                fn joint_of_factor(
                    factor: &JointFactor<$t>,
                    settings: &Settings<$t>,
                ) -> JointCalibrator<$t> {
                    JointCalibrator::of_factor(*factor, settings)
                }
                fn joint_add(
                    calibrator: &mut JointCalibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<(), SampleError> {
                    calibrator.add(sample)
                }
                fn joint_check(
                    calibrator: &JointCalibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<(), SampleError> {
                    calibrator.check(sample)
                }
                fn joint_flush(calibrator: &mut JointCalibrator<$t>) -> () { calibrator.flush(); }
                fn joint_add_many(
                    calibrator: &mut JointCalibrator<$t>,
                    samples: &[Sample<$t>],
                ) -> Result<(), (usize, SampleError)> {
                    calibrator.add_many(samples)
                }
                fn joint_merge(
                    calibrator: &mut JointCalibrator<$t>,
                    other: &JointCalibrator<$t>,
                ) -> Result<(), MergeError> {
                    calibrator.merge(other)
                }
                fn joint_forget(calibrator: &mut JointCalibrator<$t>, lambda: $t) -> () {
                    calibrator.forget(lambda);
                }
                fn joint_robot(calibrator: &JointCalibrator<$t>) -> Robot<$t> {
                    calibrator.robot()
                }
                fn joint_settings(calibrator: &JointCalibrator<$t>) -> Settings<$t> {
                    *calibrator.settings()
                }
                fn joint_factor_of(calibrator: &JointCalibrator<$t>) -> JointFactor<$t> {
                    *calibrator.factor()
                }
                fn joint_samples(calibrator: &JointCalibrator<$t>) -> u64 { calibrator.samples() }
                fn joint_solve(
                    calibrator: &mut JointCalibrator<$t>,
                ) -> Result<JointOutcome<$t>, Refusal> {
                    calibrator.solve()
                }
                fn joint_solver_new(
                    calibrator: &mut JointCalibrator<$t>,
                ) -> Result<JointSolver<$t>, Refusal> {
                    JointSolver::new(calibrator)
                }
                fn joint_solver_step(
                    solver: &mut JointSolver<$t>,
                    calibrator: &JointCalibrator<$t>,
                ) -> Progress {
                    solver.step(calibrator)
                }
                fn joint_solver_iterations(solver: &JointSolver<$t>) -> u16 { solver.iterations() }
                fn joint_solver_outcome(
                    solver: &JointSolver<$t>,
                    calibrator: &JointCalibrator<$t>,
                ) -> Result<JointOutcome<$t>, Refusal> {
                    solver.outcome(calibrator)
                }

                // The minimisation that both solvers stand on
                fn minimizer_with_prior(
                    factor: &JointFactor<$t>,
                    prior: &TolerancePrior<$t, 24>,
                    settings: &Settings<$t>,
                ) -> Result<JointMinimizer, Refusal> {
                    Minimizer::with_prior(factor, ArmIndex::First, *prior, settings)
                }
                fn minimizer_step(
                    minimizer: &mut JointMinimizer,
                    factor: &JointFactor<$t>,
                ) -> Progress {
                    minimizer.step(factor)
                }
                fn minimizer_end(minimizer: &JointMinimizer) -> Option<[$t; 24]> {
                    minimizer.end()
                }
                fn minimizer_estimate(
                    minimizer: &JointMinimizer,
                    factor: &JointFactor<$t>,
                ) -> Result<JointOutcome<$t>, Refusal> {
                    let estimate = minimizer.estimate(factor);
                    estimate.and_then(|estimate| JointOutcome::new(factor, &estimate))
                }
                fn problem_residuals(factor: &JointFactor<$t>) -> $t { factor.residuals() }

                // Outcome
                fn joint_outcome_arm(outcome: &JointOutcome<$t>, arm: ArmIndex) -> ArmOutcome<$t> {
                    outcome.arm(arm)
                }
                fn joint_outcome_robot(outcome: &JointOutcome<$t>) -> RobotOutcome<$t> {
                    RobotOutcome::from(outcome)
                }
                fn joint_outcome_standard_deviation(
                    outcome: &JointOutcome<$t>,
                    arm: ArmIndex,
                    parameter: Parameter,
                ) -> Option<$t> {
                    outcome.standard_deviation(arm, parameter)
                }

                // Triangles, for other problems
                fn triangle_from_diagonal(
                    diagonal: &[$t],
                    last_column: &[$t],
                ) -> JointNormal<$t> {
                    JointNormal::<$t>::from_diagonal(diagonal, last_column)
                }
                fn triangle_of_diagonal(
                    diagonal: &[$t],
                    last_column: &[$t],
                ) -> Triangle<$t, 9, 45> {
                    Triangle::from_diagonal(diagonal, last_column)
                }
                fn triangle_rows(normal: &JointNormal<$t>, row: usize) -> Option<$t> {
                    normal.rows().nth(row).and_then(|row| row.last().copied())
                }
                fn triangle_eliminate(
                    normal: &mut JointNormal<$t>,
                    columns: &mut [[$t; 4]],
                    pivots: usize,
                ) -> () {
                    normal.eliminate(columns, pivots);
                }

                // Weighted samples of the arms
                fn calibrator_add_weighted(
                    calibrator: &mut Calibrator<$t>,
                    samples: &[(Sample<$t>, $t)],
                    effective: $t,
                ) -> Result<(), (usize, SampleError)> {
                    let weighted = samples.iter().map(|(sample, weight)| (sample, *weight));
                    calibrator.add_weighted(weighted, effective)
                }
            }
        }
    };
}

of_scalar!(single, "f32_", f32);
of_scalar!(double, "f64_", f64);
