//! A target's parameters and a frame, fitted so that the robot is where it is wanted.

use super::frame::Frame;
use super::geometry::{Each, Geometry, Holds};
use super::loss::reached;
use super::wanted::Wanted;
use delta_cal::{Robot, Tolerance};
use nalgebra::{DMatrix, DVector, Vector3};

/// A parameter that is one σ off its start weighs as much as this rms distance over all positions, mm.
/// It decides only between parameters that lead to nearly the same positions, and keeps each of them near what
/// it means.
const PRIOR: f64 = 0.002;
/// The unit of a turn of the frame, radians.
const TURN: f64 = 1e-2;
/// A step for derivatives: of a shift in mm, of a turn in its unit, of a parameter in σ.
const STEP: f64 = 1e-3;
/// Steps of the fit, at most.
const STEPS: u32 = 60;
/// A step that lowers the sum of squares by less than this part is the last.
const CONVERGED: f64 = 1e-10;
/// Tries with more damping before the fit ends.
const DAMPED: u32 = 12;

/// The six numbers of the frame that are fitted.
const fn frame_is_free(holds: &Holds) -> [bool; 6] {
    let height = matches!(holds.heights, Each::Fixed);
    // With azimuths of its own the controller can take the robot's x axis.
    let turn = holds.fixed_azimuths.is_some();
    [true, true, height, true, true, turn]
}

/// What is fitted.
pub(crate) struct Task<'a> {
    /// The calibrated robot.
    pub(crate) calibrated: &'a Robot<f64>,
    /// Where it is wanted.
    pub(crate) wanted: &'a Wanted,
    /// The robot whose inverse kinematics is the controller's, at these changes of its parameters in σ.
    pub(crate) controller: &'a dyn Fn(&[f64]) -> Option<Robot<f64>>,
    /// How many parameters there are.
    pub(crate) parameters: usize,
    /// Where the fit of the frame starts.
    pub(crate) frame: Frame,
    /// Which of its shifts and turns are fitted.
    pub(crate) frame_free: [bool; 6],
    /// By what an error along z counts more than one along x or y.
    pub(crate) height_weight: f64,
}

struct Problem<'a> {
    task: &'a Task<'a>,
    /// In the controller's frame.
    commanded: Vec<Vector3<f64>>,
    prior: f64,
}

impl Problem<'_> {
    fn frame(&self, unknowns: &[f64]) -> Frame {
        let mut frame = self.task.frame;
        let mut others = unknowns.iter().skip(self.task.parameters);
        for (index, free) in self.task.frame_free.into_iter().enumerate() {
            if !free {
                continue;
            }
            let by = others.next().copied().unwrap_or(0.0);
            if index < 3 {
                frame.shift[index] += by;
            } else {
                frame.turns[index - 3] += by * TURN;
            }
        }
        frame
    }

    /// Three a position, and one a parameter. `None` where a position is out of reach.
    fn residuals(&self, unknowns: &[f64]) -> Option<DVector<f64>> {
        let parameters = self.task.parameters;
        let controller = (self.task.controller)(unknowns.get(..parameters)?)?;
        let transform = self.frame(unknowns).transform();
        let positions = 3 * self.commanded.len();
        let mut residuals = DVector::zeros(positions + parameters);
        for (index, at) in self.commanded.iter().enumerate() {
            let is = reached(self.task.calibrated, &controller, at)?;
            let mut off = transform.apply(&is) - at;
            off.z *= self.task.height_weight;
            residuals.fixed_rows_mut::<3>(3 * index).copy_from(&off);
        }
        for (index, by) in unknowns.iter().take(parameters).enumerate() {
            residuals[positions + index] = self.prior * by;
        }
        Some(residuals)
    }

    fn jacobian(&self, unknowns: &[f64], rows: usize) -> Option<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(rows, unknowns.len());
        let mut moved = unknowns.to_vec();
        for (column, at) in unknowns.iter().enumerate() {
            moved[column] = at + STEP;
            let above = self.residuals(&moved)?;
            moved[column] = at - STEP;
            let below = self.residuals(&moved)?;
            moved[column] = *at;
            jacobian.set_column(column, &((above - below) / (2.0 * STEP)));
        }
        Some(jacobian)
    }

    /// Levenberg and Marquardt's method.
    fn solve(&self, unknowns: usize) -> Option<Vec<f64>> {
        let mut at = vec![0.0; unknowns];
        let mut residuals = self.residuals(&at)?;
        let mut damping = 1e-6;
        for _ in 0..STEPS {
            let jacobian = self.jacobian(&at, residuals.len())?;
            let normal = jacobian.tr_mul(&jacobian);
            let gradient = jacobian.tr_mul(&residuals);
            let before = residuals.norm_squared();
            let mut taken = false;
            for _ in 0..DAMPED {
                let mut damped = normal.clone();
                for index in 0..unknowns {
                    damped[(index, index)] += damping * (normal[(index, index)] + 1e-12);
                }
                let step = damped.cholesky().map(|factor| factor.solve(&gradient));
                let next: Option<Vec<_>> =
                    step.map(|step| at.iter().zip(&step).map(|(at, by)| at - by).collect());
                let found = next.and_then(|next| Some((self.residuals(&next)?, next)));
                if let Some((found, next)) = found
                    && found.norm_squared() <= before
                {
                    (residuals, at) = (found, next);
                    damping = f64::max(damping * 0.1, 1e-12);
                    taken = true;
                    break;
                }
                damping *= 10.0;
            }
            if !taken || before - residuals.norm_squared() <= CONVERGED * before {
                break;
            }
        }
        Some(at)
    }
}

/// The changes of the parameters, in σ, and the frame with which the calibrated robot is nearest to where it is
/// wanted. `None` if the controller's kinematics does not reach the positions from where the fit starts.
pub(crate) fn solve(task: &Task<'_>) -> Option<(Vec<f64>, Frame)> {
    let transform = task.frame.transform();
    let mut unknowns = vec![0.0; task.parameters];
    let controller = (task.controller)(&unknowns)?;
    let commanded: Vec<_> = task
        .wanted
        .fitted
        .iter()
        .map(|at| transform.apply(at))
        .filter(|at| reached(task.calibrated, &controller, at).is_some())
        .collect();
    if commanded.len() < 20 {
        return None;
    }
    #[allow(clippy::cast_precision_loss)] // some hundreds
    let prior = PRIOR * (commanded.len() as f64).sqrt();
    let problem = Problem {
        task,
        commanded,
        prior,
    };
    let of_frame = task.frame_free.iter().filter(|free| **free).count();
    let solution = problem.solve(task.parameters + of_frame)?;
    let frame = problem.frame(&solution);
    unknowns.copy_from_slice(solution.get(..task.parameters)?);
    Some((unknowns, frame))
}

/// The parameters and the frame with which the calibrated robot is nearest to where it is wanted.
/// `None` if the target's kinematics does not reach the positions from where the fit starts. `level`: the robot's z
/// is the controller's.
pub(crate) fn fit(
    calibrated: &Robot<f64>,
    start: Geometry,
    holds: &Holds,
    tolerance: &Tolerance<f64>,
    (height, level): (f64, bool),
    wanted: &Wanted,
) -> Option<(Geometry, Frame)> {
    let free = Geometry::free(holds, tolerance);
    let [x, y, z, turn_x, turn_y, turn_z] = frame_is_free(holds);
    let (changes, frame) = solve(&Task {
        calibrated,
        wanted,
        controller: &|by| start.changed(&free, by).robot().ok(),
        parameters: free.len(),
        frame: Frame {
            shift: match holds.heights {
                Each::Fixed => Vector3::zeros(),
                _ => Vector3::new(0.0, 0.0, height),
            },
            turns: Vector3::new(0.0, 0.0, start.turn),
        },
        frame_free: [x, y, z, turn_x && !level, turn_y && !level, turn_z],
        height_weight: 1.0,
    })?;
    let geometry = start.changed(&free, &changes);
    Some((geometry.rounded(), frame.rounded()))
}
