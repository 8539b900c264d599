//! The calibration from heights, distances and single coordinates, with twelve unknowns of instruments.

use core::mem::MaybeUninit;
use delta_cal::calibration::{
    Estimate, JointOutcome, Minimizer, Problem, TolerancePrior, sum_of_squares,
};
use delta_cal::frame::RigidTransform;
use delta_cal::observations::{
    Instrument, Instruments, InstrumentsAt, Observation, ObservationError, ObservationNoise,
    ObservationOutcome, ObservationProblem, ObservationRow, PrepareError, RobustObservationError,
    robust_fit_observations,
};
use delta_cal::robot::Drive;
use delta_cal::robust::{Loss, RobustOutcome, WeighedSample};
use delta_cal::samples::NoiseError;
use delta_cal::{Noise, Progress, Refusal, Robot, Settings};

/// Parameters in all, columns and entries of the triangle.
const N: usize = 36;
const M: usize = 37;
const E: usize = 703;

macro_rules! of_scalar {
    ($module:ident, $prefix:literal, $t:ident) => {
        mod $module {
            use super::*;

            type ObservationSolver = delta_cal::observations::ObservationSolver<$t, N, M, E>;
            type Found = Minimizer<$t, InstrumentsAt<$t, N>, TolerancePrior<$t, N>, N, M, E>;

            symbols! { $prefix;
                fn observation_at(joints: &[$t; 3]) -> Observation<$t> { Observation::at(*joints) }
                fn observation_readings(observation: &Observation<$t>) -> usize {
                    observation.readings()
                }
                fn observation_other_joints(observation: &Observation<$t>) -> Option<[$t; 3]> {
                    observation.other_joints().copied()
                }
                fn observation_check(
                    observation: &Observation<$t>,
                    drive: Drive,
                    instruments: &Instruments<'_, $t>,
                ) -> Result<(), ObservationError> {
                    observation.check(drive, instruments)
                }
                fn observation_noise_new(
                    position: &Noise<$t>,
                    height: $t,
                    distance: $t,
                ) -> Result<ObservationNoise<$t>, NoiseError> {
                    ObservationNoise::new(*position, height, distance)
                }
                fn observation_noise_position(noise: &ObservationNoise<$t>) -> Noise<$t> {
                    *noise.position()
                }
                fn observation_noise_height(noise: &ObservationNoise<$t>) -> $t { noise.height() }
                fn observation_noise_distance(noise: &ObservationNoise<$t>) -> $t {
                    noise.distance()
                }
                fn instruments_unknowns(instruments: &Instruments<'_, $t>) -> usize {
                    instruments.unknowns()
                }
                fn instruments_instrument_of(
                    instruments: &Instruments<'_, $t>,
                    parameter: usize,
                ) -> Option<Instrument> {
                    instruments.instrument_of(parameter)
                }
                fn observation_row_new(observation: &Observation<$t>) -> ObservationRow<$t> {
                    ObservationRow::new(*observation)
                }
                fn observation_row_observation(row: &ObservationRow<$t>) -> Observation<$t> {
                    *row.observation()
                }
                fn observation_row_set_weight(row: &mut ObservationRow<$t>, weight: $t) -> () {
                    row.set_weight(weight);
                }
                fn observation_row_weight(row: &ObservationRow<$t>) -> $t { row.weight() }
                fn observation_row_is_left_out(row: &ObservationRow<$t>) -> bool {
                    row.is_left_out()
                }
                fn observations_prepare(
                    robot: &Robot<$t>,
                    instruments: &Instruments<'_, $t>,
                    rows: &mut [ObservationRow<$t>],
                ) -> Result<usize, PrepareError> {
                    let problem: Result<ObservationProblem<'_, $t, N>, _> =
                        ObservationProblem::prepare(robot, instruments, rows);
                    problem.map(|problem| problem.rows().len())
                }
                fn observations_solve(
                    problem: &ObservationProblem<'_, $t, N>,
                    settings: &Settings<$t>,
                ) -> Result<ObservationOutcome<$t, N>, Refusal> {
                    problem.solve::<M, E>(settings)
                }
                fn observations_robust(
                    robot: &Robot<$t>,
                    instruments: &Instruments<'_, $t>,
                    rows: &mut [ObservationRow<$t>],
                    settings: &Settings<$t>,
                    loss: Loss,
                    work: &mut [WeighedSample<$t>],
                ) -> Result<RobustOutcome<$t, ObservationOutcome<$t, N>>, RobustObservationError> {
                    robust_fit_observations::<$t, N, M, E>(robot, instruments, rows, settings, loss, work)
                }
                fn observation_row_checked(
                    observation: &Observation<$t>,
                    robot: &Robot<$t>,
                    instruments: &Instruments<'_, $t>,
                ) -> Result<ObservationRow<$t>, ObservationError> {
                    ObservationRow::checked(*observation, robot, instruments)
                }
                fn observation_solver_new() -> ObservationSolver {
                    ObservationSolver::new()
                }
                fn observation_solver_has_room_for(instruments: &Instruments<'_, $t>) -> bool {
                    ObservationSolver::has_room_for(instruments)
                }
                fn observation_solver_step(
                    solver: &mut ObservationSolver,
                    robot: &Robot<$t>,
                    instruments: &Instruments<'_, $t>,
                    rows: &mut [ObservationRow<$t>],
                    settings: &Settings<$t>,
                ) -> Option<Result<ObservationOutcome<$t, N>, Refusal>> {
                    solver.step(robot, instruments, rows, settings)
                }
                fn observations_minimizer(
                    problem: &ObservationProblem<'_, $t, N>,
                    settings: &Settings<$t>,
                ) -> Result<Found, Refusal> {
                    problem.minimizer(settings)
                }
                fn observations_step(
                    minimizer: &mut Found,
                    problem: &ObservationProblem<'_, $t, N>,
                ) -> Progress {
                    minimizer.step(problem)
                }
                fn observations_estimate(
                    minimizer: &Found,
                    problem: &ObservationProblem<'_, $t, N>,
                ) -> Result<Estimate<$t, N>, Refusal> {
                    minimizer.estimate(problem)
                }
                fn observations_outcome(
                    problem: &ObservationProblem<'_, $t, N>,
                    estimate: &Estimate<$t, N>,
                ) -> Result<ObservationOutcome<$t, N>, Refusal> {
                    problem.outcome(estimate)
                }
                fn observations_residuals(
                    problem: &ObservationProblem<'_, $t, N>,
                    outcome: &ObservationOutcome<$t, N>,
                    row: usize,
                ) -> Option<[$t; 5]> {
                    problem.residuals(outcome, row)
                }
                fn observations_residuals_at(
                    problem: &ObservationProblem<'_, $t, N>,
                    robot: &Robot<$t>,
                    unknowns: &[$t; N],
                    row: usize,
                ) -> Option<[$t; 5]> {
                    problem.residuals_at(robot, unknowns, row)
                }
                fn instruments_unknowns_at(
                    instruments: &Instruments<'_, $t>,
                    planes: &[[$t; 3]],
                    points: &[[$t; 4]],
                ) -> [$t; N] {
                    instruments.unknowns_at(planes, points)
                }
                fn observations_instruments(problem: &ObservationProblem<'_, $t, N>) -> usize {
                    problem.instruments().planes.len()
                }
                fn observations_linearized(
                    problem: &ObservationProblem<'_, $t, N>,
                    row: usize,
                ) -> Option<[[$t; 5]; M]> {
                    problem.linearized(row)
                }
                fn observations_prior(
                    problem: &ObservationProblem<'_, $t, N>,
                    settings: &Settings<$t>,
                ) -> TolerancePrior<$t, N> {
                    problem.prior(settings)
                }
                fn observations_sum_of_squares(
                    problem: &ObservationProblem<'_, $t, N>,
                    correction: &[$t; N],
                ) -> $t {
                    let at = Problem::<$t, N, M, E>::displaced(problem, correction);
                    sum_of_squares::<$t, _, N, M, E>(problem, &at)
                }
                fn observation_outcome_unknowns(outcome: &ObservationOutcome<$t, N>) -> [$t; N] {
                    *outcome.unknowns()
                }
                fn observation_outcome_frame(
                    outcome: &ObservationOutcome<$t, N>,
                ) -> RigidTransform<$t> {
                    outcome.frame()
                }
                fn observation_outcome_plane(
                    outcome: &ObservationOutcome<$t, N>,
                    instruments: &Instruments<'_, $t>,
                    plane: u8,
                ) -> [$t; 3] {
                    outcome.plane(instruments, plane)
                }
                fn observation_outcome_point(
                    outcome: &ObservationOutcome<$t, N>,
                    instruments: &Instruments<'_, $t>,
                    point: u8,
                ) -> [$t; 4] {
                    outcome.point(instruments, point)
                }
                fn observation_outcome_of_robot(
                    outcome: &ObservationOutcome<$t, N>,
                ) -> JointOutcome<$t> {
                    outcome.of_robot()
                }
            }
        }
    };
}

of_scalar!(single, "f32_", f32);
of_scalar!(double, "f64_", f64);
