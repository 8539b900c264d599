//! One iteration of Gauss–Newton or Levenberg–Marquardt on an arm's problem.

use super::problem::{ArmProblem, Normal};
use super::settings::Solver;
use super::step_control::{self, LONGEST_STEP, Prospect, StepControl, StepResult};
use crate::Real;
use crate::samples::Displacement;

/// State of an iteration: a correction, and the problem linearised there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Iteration<T: Real> {
    control: StepControl<T>,
    pub(crate) correction: [T; 8],
    pub(crate) normal: Normal<T>,
    /// Σ (f/σf)² at the correction, and with the prior's share.
    pub(crate) sum_of_squares: T,
    pub(crate) cost: T,
    pub(crate) iterations: u16,
}

/// Prior rows: weight and distance from the nominal arm.
fn prior_cost<T: Real>(prior: &[T; 8], correction: &[T; 8]) -> T {
    let mut sum = T::ZERO;
    for (weight, delta) in prior.iter().zip(correction) {
        sum += (*weight * *delta).squared();
    }
    sum
}

impl<T: Real> Iteration<T> {
    /// Before its [`restart`](Self::restart).
    pub(crate) const fn unstarted(solver: Solver) -> Self {
        Self {
            control: StepControl::new(solver),
            correction: [T::ZERO; 8],
            normal: Normal::zero(),
            sum_of_squares: T::ZERO,
            cost: T::ZERO,
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
        self.control = StepControl::new(self.control.solver());
        self.iterations = 0;
        let at = Displacement::new(problem.nominal(), correction);
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
        let prospect = self.control.judge(gain, self.cost, problem.terms_squared());

        let Some(step) = self.trial_step() else {
            return self.reject(&prospect);
        };
        let mut trial = self.correction;
        for (value, delta) in trial.iter_mut().zip(&step) {
            *value += *delta;
        }
        let at = Displacement::new(problem.nominal(), &trial);
        let sum_of_squares = problem.sum_of_squares(&at);
        let cost = sum_of_squares + prior_cost(prior, &trial);
        if !self.control.accepts(&prospect, cost) {
            return self.reject(&prospect);
        }
        self.correction = trial;
        if prospect.settled {
            self.sum_of_squares = sum_of_squares;
            self.cost = cost;
        } else {
            self.linearize(problem, prior, &at);
        }
        self.control.accepted(&prospect)
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
    pub(crate) fn blur<P: ArmProblem<T>>(&self, problem: &P) -> T {
        step_control::blur(self.cost, problem.terms_squared())
    }

    fn reject(&mut self, prospect: &Prospect<T>) -> StepResult {
        let result = self.control.rejected(prospect);
        if result == StepResult::Continue {
            self.iterations = self.iterations.saturating_add(1);
        }
        result
    }

    /// δ that minimises |T δ + b|² + λ|D δ|², D the column norms; `None` if it does not exist or,
    /// for Levenberg–Marquardt, is too long.
    #[inline(never)]
    fn trial_step(&self) -> Option<[T; 8]> {
        let mut normal = self.normal;
        let damping = self.control.damping();
        if damping > T::ZERO {
            let root = damping.square_root();
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
        let usable = match self.control.solver() {
            Solver::GaussNewton => step.iter().all(|delta| delta.finite()),
            Solver::LevenbergMarquardt => step.iter().all(|delta| delta.magnitude() <= longest),
        };
        usable.then_some(step)
    }
}

#[cfg(test)]
mod tests;
