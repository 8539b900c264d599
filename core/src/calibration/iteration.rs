//! One iteration of Gauss–Newton or Levenberg–Marquardt.

use super::outcome::Termination;
use super::point::{Point, Weighted};
use super::problem::{Prior, Problem};
use super::settings::Solver;
use super::step_control::{self, LONGEST_STEP, Prospect, Refinement, StepControl, StepResult};
use crate::Real;
use crate::samples::Triangle;

/// State of an iteration: a correction, and the problem linearised there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Iteration<T: Real, A, const N: usize, const M: usize, const E: usize> {
    control: StepControl<T>,
    pub(crate) point: Point<T, N, M, E>,
    pub(crate) iterations: u16,
    work: Work<T, A, N, M, E>,
}

/// What is interrupted between two pieces.
#[derive(Debug, Clone, Copy)]
enum Work<T: Real, A, const N: usize, const M: usize, const E: usize> {
    /// Nothing: the next step is to be tried.
    None,
    /// Linearising at the correction; what the step then came to.
    Linearizing {
        at: A,
        piece: usize,
        then: StepResult,
    },
    /// Summing up the residuals at the correction that is tried, by a chord step if nothing was judged.
    Trying {
        trial: Trial<T, A, N>,
        piece: usize,
        prospect: Option<Prospect<T>>,
    },
    /// A step was taken, and chord steps may follow it before the next linearisation.
    Refining { at: A },
    /// Damping the step that is to be tried.
    Damping {
        damped: Triangle<T, M, E>,
        piece: usize,
        prospect: Prospect<T>,
    },
}

/// A correction that may be the next, and Σ r² there as far as it was summed up.
#[derive(Debug, Clone, Copy)]
struct Trial<T, A, const N: usize> {
    correction: [T; N],
    at: A,
    sum_of_squares: T,
}

impl<T: Real, A: Clone, const N: usize, const M: usize, const E: usize> Iteration<T, A, N, M, E> {
    /// Before its [`restart`](Self::restart).
    pub(crate) const fn unstarted(solver: Solver) -> Self {
        Self {
            control: StepControl::new(solver),
            point: Point::unstarted(),
            iterations: 0,
            work: Work::None,
        }
    }

    /// Begins anew from a correction, where the first [`step`](Self::step) linearises. In place: copies
    /// of this state are what fills a small stack.
    #[inline(never)]
    pub(crate) fn restart<P, R>(
        &mut self,
        problem: &P,
        prior: &Weighted<'_, T, R>,
        correction: &[T; N],
    ) where
        P: Problem<T, N, M, E, At = A>,
        R: Prior<T, N, M, E>,
    {
        self.point.correction = *correction;
        self.control = StepControl::new(self.control.solver());
        self.iterations = 0;
        let at = problem.displaced(correction);
        self.linearize(prior, at, StepResult::Continue);
        if !P::PIECEWISE {
            self.finish_pieces(problem, prior);
        }
    }

    /// Whether the correction's cost is still being computed.
    pub(crate) const fn is_linearizing(&self) -> bool {
        matches!(self.work, Work::Linearizing { .. })
    }

    #[inline(never)]
    fn linearize<R: Prior<T, N, M, E>>(
        &mut self,
        prior: &Weighted<'_, T, R>,
        at: A,
        then: StepResult,
    ) {
        // The prior's rows are a triangle already; the samples' rows are absorbed into it.
        self.point.normal = prior.prior.rows(prior.sigma, &self.point.correction);
        self.point.sum_of_squares = T::ZERO;
        self.iterations = self.iterations.saturating_add(1);
        self.work = Work::Linearizing { at, piece: 0, then };
    }

    fn finish_pieces<P, R>(&mut self, problem: &P, prior: &Weighted<'_, T, R>) -> StepResult
    where
        P: Problem<T, N, M, E, At = A>,
        R: Prior<T, N, M, E>,
    {
        loop {
            if let Some(result) = self.piece(problem, prior) {
                return result;
            }
        }
    }

    /// A bounded amount of work for a problem in constant memory: a trial step, or a piece of a
    /// linearisation. `None` if the step is not at its end.
    #[inline(never)]
    pub(crate) fn step<P, R>(
        &mut self,
        problem: &P,
        prior: &Weighted<'_, T, R>,
    ) -> Option<StepResult>
    where
        P: Problem<T, N, M, E, At = A>,
        R: Prior<T, N, M, E>,
    {
        if P::PIECEWISE {
            self.piece(problem, prior)
        } else {
            Some(self.finish_pieces(problem, prior))
        }
    }

    fn piece<P, R>(&mut self, problem: &P, prior: &Weighted<'_, T, R>) -> Option<StepResult>
    where
        P: Problem<T, N, M, E, At = A>,
        R: Prior<T, N, M, E>,
    {
        match &mut self.work {
            Work::Linearizing { at, piece, then } => {
                let Point {
                    normal,
                    sum_of_squares,
                    ..
                } = &mut self.point;
                let done = problem.linearize(at, normal, *piece);
                *sum_of_squares += done.sum_of_squares;
                *piece += 1;
                if done.more {
                    return None;
                }
                let then = *then;
                self.work = Work::None;
                self.point.cost = self.point.sum_of_squares + prior.cost(&self.point.correction);
                Some(then)
            }
            Work::Trying {
                trial,
                piece,
                prospect,
            } => {
                let (trial, piece, prospect) = (trial.clone(), *piece, *prospect);
                self.work = Work::None;
                self.try_piece(problem, prior, trial, piece, prospect)
            }
            Work::Refining { at } if P::CHORDS => {
                let at = at.clone();
                self.refine(problem, prior, at)
            }
            Work::None | Work::Refining { .. } => self.propose(problem, prior),
            Work::Damping {
                damped,
                piece,
                prospect,
            } => {
                let diagonal = damping_rows(&self.point.normal, self.control.damping());
                if problem.damp(damped, &diagonal, *piece) {
                    *piece += 1;
                    return None;
                }
                let prospect = *prospect;
                let step = damped.minimiser(&[T::ZERO; M]);
                self.work = Work::None;
                self.attempt(problem, prior, step, &prospect)
            }
        }
    }

    /// Judges the step that is to be tried, and tries it unless it is to be damped first.
    #[inline(never)]
    fn propose<P, R>(&mut self, problem: &P, prior: &Weighted<'_, T, R>) -> Option<StepResult>
    where
        P: Problem<T, N, M, E, At = A>,
        R: Prior<T, N, M, E>,
    {
        // All that the linearised problem promises to gain: the part of |r|² within J's range.
        let mut gain = T::ZERO;
        for row in self.point.normal.rows().take(N) {
            if let Some(right) = row.last() {
                gain += right.squared();
            }
        }
        let cost = self.point.cost;
        if !(gain.finite() && cost.finite()) {
            return Some(StepResult::Failed);
        }
        let prospect = self.control.judge(gain, cost, problem.terms_squared());
        if self.control.damping() > T::ZERO {
            self.work = Work::Damping {
                damped: self.point.normal,
                piece: 0,
                prospect,
            };
            return None;
        }
        let step = self.point.normal.minimiser(&[T::ZERO; M]);
        self.attempt(problem, prior, step, &prospect)
    }

    /// Takes a step, and begins a linearisation, if the step is good.
    #[inline(never)]
    fn attempt<P, R>(
        &mut self,
        problem: &P,
        prior: &Weighted<'_, T, R>,
        step: Option<[T; N]>,
        prospect: &Prospect<T>,
    ) -> Option<StepResult>
    where
        P: Problem<T, N, M, E, At = A>,
        R: Prior<T, N, M, E>,
    {
        let Some(step) = step.filter(|step| self.usable(step)) else {
            return Some(self.reject(prospect));
        };
        let mut trial = self.point.correction;
        for (value, delta) in trial.iter_mut().zip(&step) {
            *value += *delta;
        }
        let at = problem.displaced(&trial);
        let trial = Trial {
            correction: trial,
            at,
            sum_of_squares: T::ZERO,
        };
        self.try_piece(problem, prior, trial, 0, Some(*prospect))
    }

    /// Prepares a chord step, or the next linearisation where none leads far.
    #[inline(never)]
    fn refine<P, R>(&mut self, problem: &P, prior: &Weighted<'_, T, R>, at: A) -> Option<StepResult>
    where
        P: Problem<T, N, M, E, At = A>,
        R: Prior<T, N, M, E>,
    {
        let mut correction = self.point.correction;
        let mut gradient = problem.gradient(&at);
        prior.add_gradient(&correction, &mut gradient);
        let step = self.point.normal.step_against(gradient);
        self.work = Work::None;
        let refinement = match step {
            Some((step, gain)) if self.usable(&step) => {
                for (value, delta) in correction.iter_mut().zip(&step) {
                    *value += *delta;
                }
                self.control.refine(gain)
            }
            _ => Refinement::Linearize,
        };
        match refinement {
            Refinement::Linearize => self.linearize(prior, at, StepResult::Continue),
            Refinement::Chord => {
                let trial = Trial {
                    correction,
                    at: problem.displaced(&correction),
                    sum_of_squares: T::ZERO,
                };
                self.work = Work::Trying {
                    trial,
                    piece: 0,
                    prospect: None,
                };
            }
            Refinement::Last => {
                // The cost does not show it.
                self.point.correction = correction;
                return Some(StepResult::Finished(Termination::GradientVanished));
            }
        }
        None
    }

    /// A piece of the residuals at a trial; after the last the trial is taken or rejected.
    fn try_piece<P, R>(
        &mut self,
        problem: &P,
        prior: &Weighted<'_, T, R>,
        mut trial: Trial<T, A, N>,
        piece: usize,
        prospect: Option<Prospect<T>>,
    ) -> Option<StepResult>
    where
        P: Problem<T, N, M, E, At = A>,
        R: Prior<T, N, M, E>,
    {
        let done = problem.sum_of_squares(&trial.at, piece);
        trial.sum_of_squares += done.sum_of_squares;
        if done.more {
            self.work = Work::Trying {
                trial,
                piece: piece + 1,
                prospect,
            };
            return None;
        }
        let Trial {
            correction,
            at,
            sum_of_squares,
        } = trial;
        let cost = sum_of_squares + prior.cost(&correction);
        let taken = match &prospect {
            Some(prospect) => self.control.accepts(prospect, cost),
            None => self.control.accepts_chord(self.point.cost, cost),
        };
        if !taken {
            if let Some(prospect) = prospect {
                return Some(self.reject(&prospect));
            }
            if P::CHORDS {
                let at = problem.displaced(&self.point.correction);
                self.linearize(prior, at, StepResult::Continue);
            }
            return None;
        }
        self.point.correction = correction;
        self.point.sum_of_squares = sum_of_squares;
        self.point.cost = cost;
        let Some(prospect) = prospect else {
            self.work = Work::Refining { at };
            return None;
        };
        let then = self.control.accepted(&prospect);
        if prospect.settled {
            return Some(then);
        }
        if P::CHORDS && then == StepResult::Continue && prospect.near {
            self.work = Work::Refining { at };
        } else {
            self.linearize(prior, at, then);
        }
        None
    }

    /// How much of the cost may be rounding.
    pub(crate) fn blur<P: Problem<T, N, M, E>>(&self, problem: &P) -> T {
        step_control::blur(self.point.cost, problem.terms_squared())
    }

    fn reject(&mut self, prospect: &Prospect<T>) -> StepResult {
        let result = self.control.rejected(prospect);
        if result == StepResult::Continue {
            self.iterations = self.iterations.saturating_add(1);
        }
        result
    }

    fn usable(&self, step: &[T; N]) -> bool {
        let longest = T::from_f64(LONGEST_STEP);
        match self.control.solver() {
            Solver::GaussNewton => step.iter().all(|delta| delta.finite()),
            Solver::LevenbergMarquardt => step.iter().all(|delta| delta.magnitude() <= longest),
        }
    }
}

/// √λ D, D the lengths of the columns.
fn damping_rows<T: Real, const N: usize, const M: usize, const E: usize>(
    normal: &Triangle<T, M, E>,
    damping: T,
) -> [T; N] {
    let root = damping.square_root();
    let mut rows = [T::ZERO; N];
    for (row, norm) in rows.iter_mut().zip(normal.column_norms()) {
        *row = root * norm;
    }
    rows
}

#[cfg(test)]
mod tests;
