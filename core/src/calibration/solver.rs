//! One iteration of Gauss–Newton or Levenberg–Marquardt on an arm's problem.

use super::problem::{ArmProblem, Normal};
use super::{Method, Termination};
use crate::Real;
use crate::samples::Displacement;

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
/// No single step may move a parameter by more than this, in units of the scale and radians: the
/// solution nearest to the start is wanted, and a longer step leaves the region where the
/// linearisation means anything.
const LONGEST_STEP: f64 = 0.25;

/// State of an iteration: a correction, and the problem linearised there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Iteration<T: Real> {
    method: Method,
    pub(crate) correction: [T; 8],
    pub(crate) normal: Normal<T>,
    /// Σ (f/σf)² at the correction, and with the prior's share.
    pub(crate) sum_of_squares: T,
    pub(crate) cost: T,
    damping: T,
    previous_gain: T,
    pub(crate) iterations: u16,
}

/// What one step came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StepResult {
    Continue,
    Finished(Termination),
    /// The full step does not exist or does not lead down, and the method has no other.
    Failed,
}

/// Prior rows: weight and distance from the reference.
fn prior_cost<T: Real>(prior: &[T; 8], correction: &[T; 8]) -> T {
    let mut sum = T::ZERO;
    for (weight, delta) in prior.iter().zip(correction) {
        sum += (*weight * *delta).squared();
    }
    sum
}

impl<T: Real> Iteration<T> {
    /// Before its [`restart`](Self::restart).
    pub(crate) const fn unstarted(method: Method) -> Self {
        Self {
            method,
            correction: [T::ZERO; 8],
            normal: Normal::zero(),
            sum_of_squares: T::ZERO,
            cost: T::ZERO,
            damping: T::ZERO,
            previous_gain: T::INFINITY,
            iterations: 0,
        }
    }

    /// Begins anew from a correction. In place: copies of this state are what fills a small stack.
    #[inline(never)]
    pub(crate) fn restart<P: ArmProblem<T>>(
        &mut self,
        problem: &P,
        prior: &[T; 8],
        correction: &[T; 8],
    ) {
        self.correction = *correction;
        self.damping = T::ZERO;
        self.previous_gain = T::INFINITY;
        self.iterations = 0;
        let at = Displacement::new(problem.reference(), correction);
        self.linearize(problem, prior, &at);
    }

    /// Linearises at the correction, whose displacement the caller has at hand.
    #[inline(never)]
    fn linearize<P: ArmProblem<T>>(&mut self, problem: &P, prior: &[T; 8], at: &Displacement<T>) {
        let mut rights = [T::ZERO; 8];
        for ((right, weight), delta) in rights.iter_mut().zip(prior).zip(&self.correction) {
            *right = *weight * *delta;
        }
        // The prior's rows are a triangle already; the samples' rows are absorbed into it.
        self.normal = Normal::from_diagonal(prior, &rights);
        self.sum_of_squares = problem.linearize(at, &mut self.normal);
        self.cost = self.sum_of_squares + prior_cost(prior, &self.correction);
        self.iterations = self.iterations.saturating_add(1);
    }

    /// One trial step, and a linearisation if it is taken. A bounded amount of work for the
    /// constant-memory form; proportional to the samples for the stored one.
    #[inline(never)]
    pub(crate) fn step<P: ArmProblem<T>>(&mut self, problem: &P, prior: &[T; 8]) -> StepResult {
        // All that the linearised problem promises to gain: the part of |r|² within J's range.
        let mut gain = T::ZERO;
        for row in self.normal.rows().take(8) {
            if let Some(right) = row.last() {
                gain += right.squared();
            }
        }
        if !(gain.finite() && self.cost.finite()) {
            return StepResult::Failed;
        }
        // r is known to ε times the terms it is made of, so a gain below that squared is nothing.
        // |r|² is blurred by |r| times as much, so a smaller gain cannot be seen in it and is taken
        // on trust.
        let terms = self.cost + problem.terms_squared();
        // Near the solution each gain follows from the last two, as quadratic convergence has it: the
        // next one would be g (g/g′)². If that is nothing, this step is the last.
        let ratio = if self.previous_gain.finite() && gain < self.previous_gain {
            gain / self.previous_gain
        } else {
            T::ONE
        };
        let nothing = T::from_f64(16.0) * T::EPSILON.squared() * terms;
        let settled =
            gain <= nothing || gain * ratio.squared() <= nothing * T::from_f64(SURELY_NOTHING);
        let invisible = self.blur(problem);
        let at_rounding = gain <= invisible;
        let slow = gain >= self.previous_gain * T::from_f64(0.25);
        let stagnant = slow && (at_rounding || gain <= T::from_f64(IRRELEVANT) * self.cost);
        self.previous_gain = gain;

        let Some(step) = self.trial_step() else {
            return self.reject(at_rounding);
        };
        let mut trial = self.correction;
        for (value, delta) in trial.iter_mut().zip(&step) {
            *value += *delta;
        }
        let at = Displacement::new(problem.reference(), &trial);
        let sum_of_squares = problem.sum_of_squares(&at);
        let cost = sum_of_squares + prior_cost(prior, &trial);
        let accepted = match self.method {
            Method::GaussNewton => cost.finite(),
            Method::LevenbergMarquardt => {
                cost < self.cost || (at_rounding && cost <= self.cost + invisible)
            }
        };
        if !accepted {
            return self.reject(at_rounding);
        }
        self.correction = trial;
        self.damping *= T::from_f64(LESS_DAMPING);
        if self.damping < T::from_f64(LEAST_DAMPING) {
            self.damping = T::ZERO;
        }
        if settled {
            // The last step is so short that the Jacobian before it is the Jacobian after it.
            self.sum_of_squares = sum_of_squares;
            self.cost = cost;
            return StepResult::Finished(Termination::GradientVanished);
        }
        self.linearize(problem, prior, &at);
        if stagnant {
            StepResult::Finished(Termination::RoundingReached)
        } else {
            StepResult::Continue
        }
    }

    /// |T δ|²: by how much a displacement from a minimum raises the cost.
    #[inline(never)]
    pub(crate) fn length_squared(&self, displacement: &[T; 8]) -> T {
        let mut sum = T::ZERO;
        for (index, row) in self.normal.rows().take(8).enumerate() {
            let mut entry = T::ZERO;
            let below = displacement.get(index..).unwrap_or_default();
            for (factor, delta) in row.iter().zip(below) {
                entry += *factor * *delta;
            }
            sum += entry.squared();
        }
        sum
    }

    /// How much of the cost may be rounding.
    #[inline(never)]
    pub(crate) fn blur<P: ArmProblem<T>>(&self, problem: &P) -> T {
        let blur =
            T::from_f64(64.0) * T::EPSILON * (self.cost + problem.terms_squared()).square_root();
        blur * self.cost.square_root() + blur.squared()
    }

    fn reject(&mut self, at_rounding: bool) -> StepResult {
        // A full step that fails may be too long rather than lost in rounding.
        if at_rounding
            && (self.method == Method::GaussNewton || self.damping > T::from_f64(ENOUGH_DAMPING))
        {
            return StepResult::Finished(Termination::RoundingReached);
        }
        if self.method == Method::GaussNewton || self.damping > T::from_f64(MOST_DAMPING) {
            return StepResult::Failed;
        }
        self.iterations = self.iterations.saturating_add(1);
        self.damping = if self.damping > T::ZERO {
            self.damping * T::from_f64(MORE_DAMPING)
        } else {
            T::from_f64(FIRST_DAMPING)
        };
        StepResult::Continue
    }

    /// δ that minimises |T δ + b|² + λ|D δ|², D the column norms; `None` if it does not exist or,
    /// for Levenberg–Marquardt, is too long.
    #[inline(never)]
    fn trial_step(&self) -> Option<[T; 8]> {
        let mut normal = self.normal;
        if self.damping > T::ZERO {
            let root = self.damping.square_root();
            // As many rows as a linearisation has, so that both share one reduction.
            let mut block = [[T::ZERO; 12]; 9];
            for (index, (column, norm)) in
                block.iter_mut().zip(self.normal.column_norms()).enumerate()
            {
                if let Some(entry) = column.get_mut(index) {
                    *entry = root * norm;
                }
            }
            normal.absorb(&mut block);
        }
        let step = normal.minimiser(&[T::ZERO; 9])?;
        let longest = T::from_f64(LONGEST_STEP);
        let usable = match self.method {
            Method::GaussNewton => step.iter().all(|delta| delta.finite()),
            Method::LevenbergMarquardt => step.iter().all(|delta| delta.magnitude() <= longest),
        };
        usable.then_some(step)
    }
}
