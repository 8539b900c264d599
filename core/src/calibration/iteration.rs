//! One iteration of Gauss–Newton or Levenberg–Marquardt.

use super::limits::LARGEST_TOLERANCES;
use super::outcome::Termination;
use super::point::{Point, Weighted};
use super::problem::Problem;
use super::step_control::{self, LONGEST_STEP, Prospect, Refinement, StepControl, StepResult};
use super::tolerance_prior::TolerancePrior;
use crate::robot::OF_ROBOT;
use crate::samples::{Triangle, Unknowns};

/// State of an iteration: a correction, and the problem linearised there.
#[derive(Debug, Clone)]
pub(crate) struct Iteration<T: Unknowns<N>, A, R, const N: usize> {
    control: StepControl<T>,
    pub(crate) point: Point<T, N>,
    pub(crate) iterations: u16,
    work: Work<T, A, R, N>,
}

/// Work that is interrupted between two pieces.
#[derive(Debug, Clone)]
enum Work<T: Unknowns<N>, A, R, const N: usize> {
    /// None: the next step is to be tried.
    None,
    /// Linearising at the correction; also the result of the step.
    Linearizing {
        at: A,
        rows: R,
        piece: usize,
        then: StepResult,
    },
    /// Summing the residuals at the trial correction.
    Trying(Trial<T, A, N>),
    /// A step was taken, and chord steps may follow before the next linearisation. Their gradient has a step of its own.
    Refining { at: A, gradient: Option<[T; N]> },
    /// Damping the step to be tried; no piece is left before the last step.
    Damping {
        damped: Triangle<T, N>,
        piece: Option<usize>,
        prospect: Prospect<T>,
    },
}

/// A candidate for the next correction, and Σ r² there as far as it is summed.
#[derive(Debug, Clone, Copy)]
struct Trial<T, A, const N: usize> {
    correction: [T; N],
    at: A,
    sum_of_squares: T,
    /// The piece to be summed next.
    piece: usize,
    /// `None` for a chord step, which nothing was judged of.
    prospect: Option<Prospect<T>>,
}

impl<T: Unknowns<N>, A, const N: usize> Trial<T, A, N> {
    /// Adds the next piece of the sum; returns whether there are more.
    fn add_piece(&mut self, problem: &impl Problem<T, N, At = A>) -> bool {
        let done = problem.sum_of_squares(&self.at, self.piece);
        self.sum_of_squares += done.sum_of_squares;
        self.piece += 1;
        done.more
    }
}

impl<T: Unknowns<N>, A: Clone, R: Clone + Default, const N: usize> Iteration<T, A, R, N> {
    /// Before its [`restart`](Self::restart).
    #[inline(always)]
    pub(crate) const fn unstarted(damped: bool, held: bool) -> Self {
        Self {
            control: StepControl::new(damped, held),
            point: Point::unstarted(),
            iterations: 0,
            work: Work::None,
        }
    }

    /// Restarts from a correction, where the first [`step`](Self::step) linearises. In place: copies of this state
    /// would fill a small stack.
    pub(crate) fn restart(
        &mut self,
        problem: &impl Problem<T, N, At = A, Rows = R>,
        prior: &Weighted<T, N>,
        correction: &[T; N],
    ) {
        self.point.correction = *correction;
        self.control = self.control.renewed();
        self.iterations = 0;
        let at = problem.displaced(correction);
        self.linearize(prior, &at, StepResult::Continue);
    }

    /// Whether the cost at the correction is still being computed.
    pub(crate) const fn is_linearizing(&self) -> bool {
        matches!(self.work, Work::Linearizing { .. })
    }

    #[inline(never)] // with the others here 0.6 kB of joint stack
    fn linearize(&mut self, prior: &Weighted<T, N>, at: &A, then: StepResult) {
        // The prior's rows are already a triangle; the samples' rows are absorbed into it.
        let Point {
            correction, normal, ..
        } = &mut self.point;
        prior.prior.put_rows(prior.sigma, correction, normal);
        self.point.sum_of_squares = T::ZERO;
        self.iterations = self.iterations.saturating_add(1);
        self.work = Work::Linearizing {
            at: at.clone(),
            rows: R::default(),
            piece: 0,
            then,
        };
    }

    /// A bounded amount of work: a piece of a linearisation, of a damped step, or of a trial. `None` if the step is not
    /// finished.
    pub(crate) fn step<P: Problem<T, N, At = A, Rows = R>>(
        &mut self,
        problem: &P,
        prior: &Weighted<T, N>,
    ) -> Option<StepResult> {
        match &mut self.work {
            Work::Linearizing {
                at,
                rows,
                piece,
                then,
            } => {
                let Point {
                    normal,
                    sum_of_squares,
                    ..
                } = &mut self.point;
                let done = problem.linearize(at, rows, normal, *piece);
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
            Work::Trying(trial) => {
                if trial.add_piece(problem) {
                    return None;
                }
                self.decide(problem, prior)
            }
            Work::Refining { at, gradient } => match (P::GRADIENT, *gradient) {
                (None, _) => self.propose(problem, prior),
                (Some(compute), None) => {
                    *gradient = Some(compute(problem, at));
                    None
                }
                (Some(_), Some(found)) => {
                    let at = at.clone();
                    self.refine(problem, prior, found, &at)
                }
            },
            Work::None => self.propose(problem, prior),
            Work::Damping {
                damped,
                piece,
                prospect,
            } => {
                if let Some(next) = *piece {
                    let diagonal = damping_row(&self.point.normal, self.control.damping);
                    let more = problem.damp(damped, diagonal, next);
                    *piece = more.then_some(next + 1);
                    return None;
                }
                let prospect = *prospect;
                let step = damped.minimiser(&[T::ZERO; N]);
                self.work = Work::None;
                self.attempt(problem, prior, step, &prospect)
            }
        }
    }

    /// Judges the step to be tried, and tries it unless it must be damped first.
    #[inline(never)] // see `linearize`
    fn propose(
        &mut self,
        problem: &impl Problem<T, N, At = A, Rows = R>,
        prior: &Weighted<T, N>,
    ) -> Option<StepResult> {
        // The whole gain predicted by the linearised problem: the part of |r|² within the range of J.
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
        if self.control.damping > T::ZERO {
            self.work = Work::Damping {
                damped: self.point.normal.clone(),
                piece: Some(0),
                prospect,
            };
            return None;
        }
        let step = self.point.normal.minimiser(&[T::ZERO; N]);
        self.attempt(problem, prior, step, &prospect)
    }

    /// Takes a step and starts a linearisation, if the step is good.
    #[inline(never)] // see `linearize`
    fn attempt(
        &mut self,
        problem: &impl Problem<T, N, At = A, Rows = R>,
        prior: &Weighted<T, N>,
        step: Option<[T; N]>,
        prospect: &Prospect<T>,
    ) -> Option<StepResult> {
        let Some(mut step) = step else {
            self.control.damp();
            return Some(self.reject(prospect));
        };
        let part = self.control.part;
        if part < T::ONE {
            for delta in &mut step {
                *delta *= part;
            }
        }
        if !self.usable(&prior.prior, &step) {
            return Some(self.reject(prospect));
        }
        let correction = prior.prior.advanced(&self.point.correction, &step);
        let trial = Trial {
            correction,
            at: problem.displaced(&correction),
            sum_of_squares: T::ZERO,
            piece: 0,
            prospect: Some(*prospect),
        };
        // Its sum begins in the next step.
        self.work = Work::Trying(trial);
        None
    }

    /// Prepares a chord step, or the next linearisation if chord steps would gain little.
    #[inline(never)] // see `linearize`
    fn refine(
        &mut self,
        problem: &impl Problem<T, N, At = A, Rows = R>,
        prior: &Weighted<T, N>,
        mut gradient: [T; N],
        at: &A,
    ) -> Option<StepResult> {
        let mut correction = self.point.correction;
        prior.add_gradient(&correction, &mut gradient);
        let step = self.point.normal.step_against(gradient);
        self.work = Work::None;
        let refinement = match step {
            Some((step, gain)) if self.usable(&prior.prior, &step) => {
                correction = prior.prior.advanced(&correction, &step);
                self.control.refine(gain)
            }
            _ => Refinement::Linearize,
        };
        match refinement {
            Refinement::Linearize => self.linearize(prior, at, StepResult::Continue),
            Refinement::Chord => {
                self.work = Work::Trying(Trial {
                    correction,
                    at: problem.displaced(&correction),
                    sum_of_squares: T::ZERO,
                    piece: 0,
                    prospect: None,
                });
            }
            Refinement::Last => {
                // Too small to show in the cost.
                self.point.correction = correction;
                return Some(StepResult::Finished(Termination::GradientVanished));
            }
        }
        None
    }

    /// Accepts or rejects a trial. Its copy is on no other step's stack: 0.5 kB jointly.
    #[inline(never)] // see `linearize`
    fn decide<P: Problem<T, N, At = A, Rows = R>>(
        &mut self,
        problem: &P,
        prior: &Weighted<T, N>,
    ) -> Option<StepResult> {
        let Work::Trying(trial) = &self.work else {
            debug_assert!(false, "nothing is tried");
            return None;
        };
        let trial = trial.clone();
        self.work = Work::None;
        let cost = trial.sum_of_squares + prior.cost(&trial.correction);
        let taken = match &trial.prospect {
            Some(prospect) => self.control.accepts(prospect, cost),
            None => P::GRADIENT.is_some() && self.control.accepts_chord(self.point.cost, cost),
        };
        if !taken {
            if let Some(prospect) = &trial.prospect {
                return Some(self.reject(prospect));
            }
            if P::GRADIENT.is_some() {
                let at = problem.displaced(&self.point.correction);
                self.linearize(prior, &at, StepResult::Continue);
            }
            return None;
        }
        self.point.correction = trial.correction;
        self.point.sum_of_squares = trial.sum_of_squares;
        self.point.cost = cost;
        let mut then = StepResult::Continue;
        let mut refined = P::GRADIENT.is_some();
        if let Some(prospect) = &trial.prospect {
            then = self.control.accepted(prospect);
            if prospect.settled {
                return Some(then);
            }
            refined &= then == StepResult::Continue && prospect.near;
        }
        if refined {
            let at = trial.at.clone();
            self.work = Work::Refining { at, gradient: None };
        } else {
            self.linearize(prior, &trial.at, then);
        }
        None
    }

    /// How much of the cost may be rounding.
    pub(crate) fn blur(&self, problem: &impl Problem<T, N>) -> T {
        step_control::blur(self.point.cost, problem.terms_squared())
    }

    fn reject(&mut self, prospect: &Prospect<T>) -> StepResult {
        let result = self.control.rejected(prospect);
        if result == StepResult::Continue && !(self.control.part < T::ONE) {
            self.iterations = self.iterations.saturating_add(1);
        }
        result
    }

    /// Whether a step is short enough. It may be longer for a parameter whose prior allows an error that large, and for
    /// those that are not the robot's, which follow it.
    fn usable(&self, prior: &TolerancePrior<T, N>, step: &[T; N]) -> bool {
        let longest = T::from_f64(LONGEST_STEP);
        let most = T::from_f64(LARGEST_TOLERANCES);
        if !self.control.damped {
            return step.iter().all(|delta| delta.finite());
        }
        let distances = prior.distances(step);
        let mut deltas = step.iter().zip(distances).enumerate();
        deltas.all(|(parameter, (delta, tolerances))| {
            let expected = tolerances > T::ZERO && tolerances <= most;
            delta.magnitude() <= longest || parameter >= OF_ROBOT || expected
        })
    }
}

/// √λ D by its diagonal, D the lengths of the columns.
fn damping_row<T: Unknowns<N>, const N: usize>(
    normal: &Triangle<T, N>,
    damping: T,
) -> impl Fn(usize) -> T {
    let root = damping.square_root();
    move |column| root * normal.column_norm(column)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::{TolerancePrior, Work, damping_row};
    use crate::calibration::Problem;
    use crate::calibration::arm_problem::Normal;
    use crate::calibration::point::Weighted;
    use crate::calibration::step_control::{StepControl, StepResult};
    use crate::fixtures::{changed, filled, linearized, noises, samples};
    use crate::robot::Arm;
    use crate::samples::{ArmFactor, Displacement, JointDisplacement, NominalArm};
    use nalgebra::{SVector, Vector3};

    type Iteration = super::Iteration<f64, Displacement<f64>, (), 8>;

    /// Any problem; only its sizes are used.
    fn problem() -> ArmFactor<f64> {
        let arm = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0]).unwrap();
        ArmFactor::new(NominalArm::new(&arm, &Vector3::new(0.0, 0.0, -450.0), None))
    }

    /// The step that the iteration would try, with its current damping, if it is short enough.
    fn trial_step(iteration: &Iteration, problem: &ArmFactor<f64>) -> Option<[f64; 8]> {
        let mut damped = iteration.point.normal.clone();
        let damping = iteration.control.damping;
        if damping > 0.0 {
            let diagonal = damping_row(&iteration.point.normal, damping);
            assert!(!problem.damp(&mut damped, diagonal, 0));
        }
        damped
            .minimiser(&[0.0; 8])
            .filter(|step| iteration.usable(&TolerancePrior::of_weights([0.0; 8]), step))
    }

    /// An iteration at a random linearised problem.
    fn iteration(normal: Normal<f64>) -> Iteration {
        let mut iteration = Iteration::unstarted(true, false);
        iteration.point.normal = normal;
        iteration
    }

    /// (JᵀJ + λ D²) δ = −Jᵀ r, D the lengths of the columns (Marquardt 1963).
    #[test]
    fn a_damped_step_is_marquardts() {
        for seed in 0..20 {
            let (jacobian, residual, normal) = linearized(seed);
            let mut iteration = iteration(normal);
            let information = jacobian.transpose() * jacobian;
            let right = -(jacobian.transpose() * residual);
            let mut control = StepControl::new(true, false);
            for _ in 0..5 {
                let mut damped = information;
                for k in 0..8 {
                    damped[(k, k)] *= 1.0 + control.damping;
                }
                let expected = damped.try_inverse().unwrap() * right;
                iteration.control = control;
                let found = SVector::from(trial_step(&iteration, &problem()).unwrap());
                assert!((found - expected).norm() < 1e-9 * expected.norm());
                let prospect = control.judge(0.5, 1.0, 1.0);
                assert_eq!(control.rejected(&prospect), StepResult::Continue);
            }
        }
    }

    #[test]
    fn a_step_that_is_too_long_is_taken_by_gauss_newton_alone() {
        let mut diagonal = [1.0; 8];
        diagonal[5] = 0.01;
        let mut iteration = Iteration::unstarted(true, false);
        for (right, short) in [(0.002_49, true), (0.002_51, false), (-0.003, false)] {
            let mut rights = [0.0; 8];
            rights[5] = right;
            iteration.point.normal = Normal::from_diagonal(&diagonal, &rights);
            iteration.control = StepControl::new(true, false);
            // At most a quarter of the unit.
            assert_eq!(trial_step(&iteration, &problem()).is_some(), short);
            iteration.control = StepControl::new(false, false);
            let step = trial_step(&iteration, &problem()).unwrap();
            assert!((step[5] + right / 0.01).abs() < 1e-12);
        }
    }

    /// At the point of linearisation a chord step is the full step; one that is too long is not tried.
    #[test]
    fn a_chord_step_is_the_full_step_there() {
        type Joint = super::Iteration<f64, JointDisplacement<f64>, (), 24>;
        let factor = filled(noises()[2], &samples::<30>(&changed(11), 12));
        let weighted = Weighted::new(TolerancePrior::of_weights([500.0; 24]));
        for azimuth in [0.0, 0.01, 0.8] {
            let mut from = [0.0; 24];
            from[3] = azimuth;
            let mut iteration = Joint::unstarted(true, false);
            iteration.restart(&factor, &weighted, &from);
            while iteration.is_linearizing() {
                iteration.step(&factor, &weighted);
            }
            let step: [f64; 24] = iteration.point.normal.minimiser(&[0.0; 24]).unwrap();
            let longest = step.into_iter().map(f64::abs).fold(0.0, f64::max);
            let at = Problem::displaced(&factor, &from);
            let gradient = factor.gradient(&at);
            let refined = iteration.refine(&factor, &weighted, gradient, &at);
            assert!(refined.is_none());
            let tried = match &iteration.work {
                Work::Trying(trial) => Some(trial.correction),
                _ => None,
            };
            assert_eq!(tried.is_some(), longest <= 0.25, "{longest}");
            assert_eq!(iteration.is_linearizing(), longest > 0.25);
            assert_eq!(longest <= 0.25, azimuth < 0.1);
            for ((tried, before), step) in tried.iter().flatten().zip(from).zip(step) {
                // Two ways to compute the same step, with a condition number of some thousands.
                assert!((tried - before - step).abs() < 1e-9 * longest);
            }
        }
    }
}
