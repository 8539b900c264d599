//! Gauss–Newton and Levenberg–Marquardt on all 24 parameters.

use super::normal::{Normal, Vector24};
use super::problem::Problem;
use delta_cal::calibration::step_control::{self, LONGEST_STEP, Prospect, StepControl, StepResult};
use delta_cal::calibration::{Solver, Termination};

/// Where an iteration has come to, and the problem linearised there.
#[derive(Debug, Clone)]
pub(super) struct Point {
    pub(super) correction: Vector24,
    pub(super) normal: Normal,
    /// Σ |L⁻¹ (X − FK)|², and with the prior's share.
    pub(super) sum_of_squares: f64,
    pub(super) cost: f64,
}

/// How an iteration went.
#[derive(Debug, Clone)]
pub(super) struct Run {
    pub(super) point: Point,
    /// `None` if it did not settle.
    pub(super) termination: Option<Termination>,
    pub(super) iterations: u16,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Minimiser<'a> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) solver: Solver,
    pub(super) iteration_limit: u16,
    /// 1/tolerance as weighed against the residuals; zero without a tolerance.
    pub(super) prior: Vector24,
}

impl Minimiser<'_> {
    pub(super) fn cost(&self, correction: &Vector24) -> f64 {
        self.problem.sum_of_squares(correction) + self.prior_cost(correction)
    }

    fn prior_cost(&self, correction: &Vector24) -> f64 {
        self.prior.component_mul(correction).norm_squared()
    }

    /// `None` where the problem has no value, or fewer rows than unknowns.
    fn point(&self, correction: &Vector24, sum_of_squares: f64) -> Option<Point> {
        if !sum_of_squares.is_finite() {
            return None;
        }
        Some(Point {
            correction: *correction,
            normal: self.problem.linearize(correction, &self.prior)?,
            sum_of_squares,
            cost: sum_of_squares + self.prior_cost(correction),
        })
    }

    /// How much of a cost may be rounding.
    pub(super) fn blur(&self, cost: f64) -> f64 {
        step_control::blur(cost, self.problem.terms_squared)
    }

    /// Iterates from a correction. `None` if the robot there does not reach every sample.
    pub(super) fn run(&self, from: &Vector24) -> Option<Run> {
        let mut point = self.point(from, self.problem.sum_of_squares(from))?;
        let starting_cost = point.cost;
        let mut control = StepControl::new(self.solver);
        let mut termination = None;
        let mut iterations = 1;
        while iterations < self.iteration_limit && termination.is_none() {
            // All that the linearised problem promises to gain: the part of |r|² within J's range.
            let gain = point.normal.right.norm_squared();
            if !gain.is_finite() {
                break;
            }
            let prospect = control.judge(gain, point.cost, self.problem.terms_squared);
            let result = if let Some(next) = self.trial(&point, &control, &prospect) {
                point = next;
                iterations += u16::from(!prospect.settled);
                control.accepted(&prospect)
            } else {
                iterations += 1;
                control.rejected(&prospect)
            };
            match result {
                StepResult::Continue => {}
                StepResult::Finished(reason) => termination = Some(reason),
                StepResult::Failed => break,
            }
        }
        // Full steps can settle above where they began.
        let no_worse = point.cost <= starting_cost + 2.0 * self.blur(point.cost);
        Some(Run {
            termination: termination.filter(|_| no_worse),
            point,
            iterations,
        })
    }

    /// One step and the point it leads to, if that is an improvement.
    fn trial(
        &self,
        point: &Point,
        control: &StepControl<f64>,
        prospect: &Prospect<f64>,
    ) -> Option<Point> {
        let step = point
            .normal
            .minimiser(control.damping())
            .filter(|step| self.usable(step))?;
        let correction = point.correction + step;
        let sum_of_squares = self.problem.sum_of_squares(&correction);
        let cost = sum_of_squares + self.prior_cost(&correction);
        if !control.accepts(prospect, cost) {
            return None;
        }
        if prospect.settled {
            return Some(Point {
                correction,
                normal: point.normal.clone(),
                sum_of_squares,
                cost,
            });
        }
        self.point(&correction, sum_of_squares)
    }

    fn usable(&self, step: &Vector24) -> bool {
        let longest =
            |arm: usize| LONGEST_STEP * self.problem.reference.arms()[arm].upper_arm_length();
        self.solver == Solver::GaussNewton
            || step
                .iter()
                .enumerate()
                .all(|(index, delta)| delta.abs() <= longest(index / 8))
    }
}
