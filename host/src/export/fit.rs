//! A target's parameters and a frame, fitted so that the robot is where it is wanted.

use super::geometry::{Each, Frame, Geometry, Holds};
use super::positions::{Wanted, reached};
use crate::files::Tooled;
use crate::halt;
use delta_cal::robot::Drive;
use delta_cal::{Parameter, Tolerance};
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

/// What an unknown of the fit changes.
#[derive(Clone, Copy)]
enum Of {
    /// A place in [`Shape::held`](super::geometry::Shape::held) of an arm, or of all.
    Arms(usize, Option<usize>),
    Shift(usize),
    Turn(usize),
}

struct Problem<'a> {
    calibrated: Tooled<'a>,
    /// Where the fit starts.
    start: (Geometry, Frame),
    /// The unknowns, those of the arms first, and the change by each per unit: σ of a parameter, mm or radians.
    free: Vec<(Of, f64)>,
    /// By what an error along z counts more than one along x or y.
    height_weight: f64,
    /// In the controller's frame, with how many times each counts.
    commanded: Vec<(Vector3<f64>, f64)>,
    prior: f64,
}

/// The unknowns of a target's parameters and of the frame.
fn unknowns(
    start: &Geometry,
    holds: &Holds,
    tolerance: &Tolerance<f64>,
    level: bool,
) -> Vec<(Of, f64)> {
    let of = |parameter| tolerance.of(parameter);
    let radius = of(Parameter::Dx);
    let (azimuth, height, tilt) = match start.drive {
        Drive::Rotary => (
            of(Parameter::Theta),
            of(Parameter::Dz),
            of(Parameter::Alpha),
        ),
        Drive::Linear => (
            radius / start.arms[0].radius.max(1.0),
            of(Parameter::Zero),
            of(Parameter::LeanX),
        ),
    };
    let sigmas = [
        azimuth,
        radius,
        height,
        of(Parameter::LaX),
        of(Parameter::Lb),
        tilt,
    ];
    let mut free = Vec::new();
    for (index, (sigma, each)) in sigmas.into_iter().zip(holds.each()).enumerate() {
        let arms = match each {
            Each::Arm => vec![Some(0), Some(1), Some(2)],
            Each::Shared => vec![None],
            Each::Fixed => Vec::new(),
        };
        free.extend(arms.into_iter().map(|arm| (Of::Arms(index, arm), sigma)));
    }
    // The heights of the arms hold that of the frame, azimuths of their own its turn about z.
    let height = holds.heights == Each::Fixed;
    let turn = holds.azimuths_deg.is_some();
    let axes = |of: fn(usize) -> Of, unit: f64, are_free: [bool; 3]| {
        let axes = (0..3).filter(move |axis| are_free[*axis]);
        axes.map(move |axis| (of(axis), unit))
    };
    free.extend(axes(Of::Shift, 1.0, [true, true, height]));
    free.extend(axes(Of::Turn, TURN, [!level, !level, turn]));
    free
}

impl Problem<'_> {
    fn changed(&self, unknowns: &[f64]) -> (Geometry, Frame) {
        let (mut geometry, mut frame) = self.start;
        for ((of, unit), unknown) in self.free.iter().zip(unknowns) {
            let by = unknown * unit;
            match *of {
                Of::Shift(axis) => frame.shift[axis] += by,
                Of::Turn(axis) => frame.turns[axis] += by,
                Of::Arms(index, Some(arm)) => *geometry.arms[arm].held()[index] += by,
                Of::Arms(index, None) => {
                    for arm in &mut geometry.arms {
                        *arm.held()[index] += by;
                    }
                }
            }
        }
        (geometry, frame)
    }

    /// Three a position, and one a parameter. `None` where a position is out of reach.
    fn residuals(&self, unknowns: &[f64]) -> Option<DVector<f64>> {
        let (geometry, frame) = self.changed(unknowns);
        let (controller, transform) = (geometry.robot().ok()?, frame.transform());
        let of_arms = |(of, _): &&(Of, f64)| matches!(of, Of::Arms(..));
        let parameters = self.free.iter().filter(of_arms).count();
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
        let unknowns = self.free.len();
        let mut at = vec![0.0; unknowns];
        let mut residuals = self.residuals(&at)?;
        let mut damping = 1e-6;
        for _ in 0..STEPS {
            halt::check();
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
    (calibrated, tolerance): (Tooled<'_>, &Tolerance<f64>),
    (start, holds): (Geometry, &Holds),
    (frame, level): (Frame, bool),
    wanted: &Wanted,
) -> Option<(Geometry, Frame)> {
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
    let problem = Problem {
        calibrated,
        start: (start, frame),
        free: unknowns(&start, holds, tolerance, level),
        height_weight: match start.drive {
            Drive::Linear => FIRST_LAYER,
            Drive::Rotary => 1.0,
        },
        commanded,
        prior: PRIOR * all.sqrt(),
    };
    let (geometry, frame) = problem.changed(&problem.solve()?);
    Some((geometry.rounded(), frame.rounded()))
}
