//! Gauss–Newton and Levenberg–Marquardt on all 24 parameters.

use super::normal::{Normal, Vector24};
use super::problem::Problem;
use delta_cal::{Method, Termination};

/// Damping after the first rejected step, relative to the squared column norms.
const FIRST_DAMPING: f64 = 1e-3;
const MORE_DAMPING: f64 = 8.0;
const LESS_DAMPING: f64 = 0.1;
/// Below this the damping is dropped and full steps are tried again.
const LEAST_DAMPING: f64 = 1e-5;
const MOST_DAMPING: f64 = 1e8;
/// A step damped by this much is shorter than the full one by a tenth or more in every direction.
const ENOUGH_DAMPING: f64 = 0.1;
/// Where the iteration converges slowly, a gain below this part of the cost is the end: it moves the
/// solution by a hundred thousandth of its σ.
const IRRELEVANT: f64 = 1e-10;
/// A predicted gain must be this much smaller than a seen one to count as nothing.
const SURELY_NOTHING: f64 = 1e-6;
/// No single step may move a parameter by more than this part of the upper arm: a longer step leaves
/// the region where the linearisation means anything.
const LONGEST_STEP: f64 = 0.25;

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
pub(super) struct Solver<'a> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) method: Method,
    pub(super) iteration_limit: u16,
    /// 1/tolerance as weighed against the residuals; zero without a tolerance.
    pub(super) prior: Vector24,
}

impl Solver<'_> {
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
        let blur = 64.0 * f64::EPSILON * (cost + self.problem.terms_squared).sqrt();
        blur * cost.sqrt() + blur * blur
    }

    /// Iterates from a correction. `None` if the robot there does not reach every sample.
    pub(super) fn run(&self, from: &Vector24) -> Option<Run> {
        let mut point = self.point(from, self.problem.sum_of_squares(from))?;
        let starting_cost = point.cost;
        let (mut damping, mut previous_gain) = (0.0, f64::INFINITY);
        let mut termination = None;
        let mut iterations = 1;
        while iterations < self.iteration_limit && termination.is_none() {
            // All that the linearised problem promises to gain: the part of |r|² within J's range.
            let gain = point.normal.right.norm_squared();
            if !gain.is_finite() {
                break;
            }
            // r is known to ε times the terms it is made of, so a gain below that squared is nothing.
            // |r|² is blurred by |r| times as much: a smaller gain is taken on trust.
            let nothing = 16.0 * f64::EPSILON.powi(2) * (point.cost + self.problem.terms_squared);
            // Near the solution each gain follows from the last two, as quadratic convergence has it.
            let ratio = if previous_gain.is_finite() {
                (gain / previous_gain).min(1.0)
            } else {
                1.0
            };
            let settled = gain <= nothing || gain * ratio * ratio <= nothing * SURELY_NOTHING;
            let at_rounding = gain <= self.blur(point.cost);
            let slow = gain >= 0.25 * previous_gain;
            let stagnant = slow && (at_rounding || gain <= IRRELEVANT * point.cost);
            previous_gain = gain;

            iterations += 1;
            let full_steps_only = self.method == Method::GaussNewton;
            if let Some((next, linearized)) = self.trial(&point, damping, at_rounding, settled) {
                point = next;
                damping = less(damping);
                if !linearized {
                    iterations -= 1;
                    termination = Some(Termination::GradientVanished);
                } else if stagnant {
                    termination = Some(Termination::RoundingReached);
                }
            } else if at_rounding && (full_steps_only || damping > ENOUGH_DAMPING) {
                // A full step that fails may be too long rather than lost in rounding.
                termination = Some(Termination::RoundingReached);
            } else if full_steps_only || damping > MOST_DAMPING {
                break;
            } else {
                damping = more(damping);
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

    /// One step and the point it leads to, if that is an improvement; and whether the problem was
    /// linearised there.
    fn trial(
        &self,
        point: &Point,
        damping: f64,
        at_rounding: bool,
        settled: bool,
    ) -> Option<(Point, bool)> {
        let step = point
            .normal
            .minimiser(damping)
            .filter(|step| self.usable(step))?;
        let correction = point.correction + step;
        let sum_of_squares = self.problem.sum_of_squares(&correction);
        let cost = sum_of_squares + self.prior_cost(&correction);
        let accepted = match self.method {
            Method::GaussNewton => cost.is_finite(),
            Method::LevenbergMarquardt => {
                cost < point.cost || (at_rounding && cost <= point.cost + self.blur(point.cost))
            }
        };
        if !accepted {
            return None;
        }
        if settled {
            // The last step is so short that the Jacobian before it is the Jacobian after it.
            let last = Point {
                correction,
                normal: point.normal.clone(),
                sum_of_squares,
                cost,
            };
            return Some((last, false));
        }
        self.point(&correction, sum_of_squares)
            .map(|next| (next, true))
    }

    fn usable(&self, step: &Vector24) -> bool {
        let longest =
            |arm: usize| LONGEST_STEP * self.problem.reference.arms()[arm].upper_arm_length();
        self.method == Method::GaussNewton
            || step
                .iter()
                .enumerate()
                .all(|(index, delta)| delta.abs() <= longest(index / 8))
    }
}

fn more(damping: f64) -> f64 {
    if damping > 0.0 {
        damping * MORE_DAMPING
    } else {
        FIRST_DAMPING
    }
}

fn less(damping: f64) -> f64 {
    let less = damping * LESS_DAMPING;
    if less < LEAST_DAMPING { 0.0 } else { less }
}
