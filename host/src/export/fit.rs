//! A target's parameters and a frame, fitted so that the robot is where it is wanted.

use super::geometry::{Each, Frame, Free, Geometry, Holds};
use super::positions::{Wanted, reached};
use delta_cal::robot::Drive;
use delta_cal::{Robot, Tolerance};
use nalgebra::{DMatrix, DVector, Vector3};

/// A parameter that is one σ off its start weighs as much as this rms distance over all positions, mm.
/// It decides only between parameters that lead to nearly the same positions, and keeps each of them near what
/// it means.
const PRIOR: f64 = 0.002;
/// The unit of a turn of the frame, radians.
const TURN: f64 = 1e-2;
/// Fewer positions determine no fit.
pub(super) const LEAST_POSITIONS: usize = 20;
/// An error of a printer's height counts so many times as much as one along x or y: the first layer depends on it.
const FIRST_LAYER: f64 = 10.0;
/// A step for derivatives: of a shift in mm, of a turn in its unit, of a parameter in σ.
const STEP: f64 = 1e-3;
/// Steps of the fit, at most.
const STEPS: u32 = 60;
/// A step that lowers the sum of squares by less than this part is the last.
const CONVERGED: f64 = 1e-10;
/// Tries with more damping before the fit ends.
const DAMPED: u32 = 12;

struct Problem<'a> {
    calibrated: &'a Robot<f64>,
    start: Geometry,
    free: Vec<Free>,
    /// Where the fit of the frame starts.
    frame: Frame,
    /// Which of its shifts and turns are fitted.
    frame_free: [bool; 6],
    /// By what an error along z counts more than one along x or y.
    height_weight: f64,
    /// In the controller's frame, with how many times each counts.
    commanded: Vec<(Vector3<f64>, f64)>,
    prior: f64,
}

impl Problem<'_> {
    fn frame(&self, unknowns: &[f64]) -> Frame {
        let mut frame = self.frame;
        let mut others = unknowns.iter().skip(self.free.len());
        for (index, free) in self.frame_free.into_iter().enumerate() {
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
        let parameters = self.free.len();
        let controller = self.start.changed(&self.free, unknowns).robot().ok()?;
        let transform = self.frame(unknowns).transform();
        let positions = 3 * self.commanded.len();
        let mut residuals = DVector::zeros(positions + parameters);
        for (index, (at, times)) in self.commanded.iter().enumerate() {
            let is = reached(self.calibrated, &controller, at)?;
            let mut off = (transform.apply(&is) - at) * times.sqrt();
            off.z *= self.height_weight;
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
    fn solve(&self) -> Option<Vec<f64>> {
        let of_frame = self.frame_free.iter().filter(|free| **free).count();
        let unknowns = self.free.len() + of_frame;
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

/// The parameters and the frame with which the calibrated robot is nearest to where it is wanted, as they are written.
/// `frame` is where the fit of the frame starts. With a `level` the robot's z is the controller's after that frame.
/// `None` if the target's kinematics does not reach the positions from where the fit starts.
pub(super) fn fit(
    (calibrated, tolerance): (&Robot<f64>, &Tolerance<f64>),
    (start, holds): (Geometry, &Holds),
    (frame, level): (Frame, bool),
    wanted: &Wanted,
) -> Option<(Geometry, Frame)> {
    let free = start.free(holds, tolerance);
    // The heights of the arms hold that of the frame, azimuths of their own its turn about z.
    let height = holds.heights == Each::Fixed;
    let turn = holds.azimuths_deg.is_some();
    let transform = frame.transform();
    let controller = start.robot().ok()?;
    let commanded = wanted.fitted.iter();
    let commanded: Vec<_> = commanded
        .map(|(at, times)| (transform.apply(at), *times))
        .filter(|(at, _)| reached(calibrated, &controller, at).is_some())
        .collect();
    if commanded.len() < LEAST_POSITIONS {
        return None;
    }
    let all = commanded.iter().map(|(_, times)| times).sum::<f64>();
    let prior = PRIOR * all.sqrt();
    let problem = Problem {
        calibrated,
        start,
        free,
        frame,
        frame_free: [true, true, height, !level, !level, turn],
        height_weight: match start.drive {
            Drive::Linear => FIRST_LAYER,
            Drive::Rotary => 1.0,
        },
        commanded,
        prior,
    };
    let solution = problem.solve()?;
    let geometry = start.changed(&problem.free, &solution);
    Some((geometry.rounded(), problem.frame(&solution).rounded()))
}
