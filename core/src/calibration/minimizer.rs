use super::identifiability::Identifiability;
use super::iteration::Iteration;
use super::judgement::Judgement;
use super::outcome::{Estimate, StartUsed, Termination};
use super::point::{EndPoint, Point, Weighted, rounding_of_cost};
use super::problem::{Prior, Problem};
use super::refusal::Refusal;
use super::settings::{Settings, Start};
use super::starts::Starts;
use super::step_control::StepResult;
use crate::Real;
use crate::robot::{ArmIndex, Parameter};
use nalgebra::SMatrix;

/// Whether a solver has more to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Progress {
    /// Call `step` again.
    Working,
    /// The outcome is ready.
    Finished,
}

/// Minimises the residuals of a [`Problem`] and the cost of a [`Prior`], one bounded step at a time, and judges the
/// result: from the nominal parameters, from a free start, or along the combination that the samples determine least,
/// whichever ends best. N parameters, M = N + 1, E = M (M + 1)/2.
///
/// The calibrators own one for each problem.
#[derive(Debug, Clone)]
pub(crate) struct Minimizer<T: Real, A, R, const N: usize, const M: usize, const E: usize> {
    first_arm: ArmIndex,
    settings: Settings<T>,
    prior: R,
    /// The noise against which the tolerance is weighted.
    balance: NoiseBalance<T>,
    phase: Phase,
    iteration: Iteration<T, A, N, M, E>,
    /// The cost at the first start, or at that of the last balance: a higher end does not count.
    starting_cost: T,
    /// Whether that cost is still to be computed.
    awaits_cost: bool,
    /// The best end point so far.
    best: Option<EndPoint<T, N, M, E>>,
    /// The identifiability at the best end point.
    identifiability: Identifiability<T, N>,
    starts: Starts<T, N>,
    /// Whether only the end point is wanted.
    end_alone: bool,
    iterations: u16,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The free start is still to be found: one step to find it, another to start there.
    Beginning,
    AtFreeStart,
    From(StartUsed),
    /// An iteration has ended.
    Ended(StartUsed, Option<Termination>),
    /// The covariance at the best end point is being computed.
    Identifying,
    /// There is no free start: identifying what the samples leave undetermined.
    Undetermined,
    /// The covariance is known: judging the end point.
    Judging,
    Done,
}

impl<T, A, R, const N: usize, const M: usize, const E: usize> Minimizer<T, A, R, N, M, E>
where
    T: Real,
    A: Clone,
    R: Prior<T, N, M, E>,
{
    /// Before [`begin`](Self::begin).
    #[allow(clippy::inline_always)] // in its place at every optimisation level: it is large
    #[inline(always)]
    pub(crate) fn unstarted(first_arm: ArmIndex, prior: R, settings: &Settings<T>) -> Self {
        Self {
            first_arm,
            settings: *settings,
            prior,
            balance: NoiseBalance::none(),
            phase: Phase::Done,
            starting_cost: T::ZERO,
            awaits_cost: false,
            iteration: Iteration::unstarted(settings.solver, settings.tolerance.is_some()),
            best: None,
            identifiability: Identifiability::unstarted(),
            starts: Starts::new(settings.start),
            end_alone: false,
            iterations: 0,
        }
    }

    /// Configures the minimiser for its [`end`](Self::end) alone: no search for other solutions, no balancing of the
    /// tolerance, no judgement.
    #[must_use]
    pub(crate) const fn for_its_end(mut self) -> Self {
        self.end_alone = true;
        self
    }

    /// Prepares the minimisation. `first_arm`: the arm of the first eight parameters.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`].
    pub(crate) fn with_prior<P: Problem<T, N, M, E, At = A>>(
        problem: &P,
        first_arm: ArmIndex,
        prior: R,
        settings: &Settings<T>,
    ) -> Result<Self, Refusal> {
        enough_samples(problem, first_arm, settings)?;
        let mut solver = Self::unstarted(first_arm, prior, settings);
        solver.begin(problem);
        Ok(solver)
    }

    /// Starts if there are [`enough_samples`]. In place: on a small stack, a copy of a solver is a large object.
    #[inline(never)]
    pub(crate) fn begin<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P) {
        if let Some(tolerance) = &self.settings.tolerance
            && !problem.noise_stated()
        {
            self.balance.sigma = T::from_f64(0.01) * tolerance.of(Parameter::Lb) / problem.unit();
        }
        match self.settings.start {
            Start::Nominal => self.start(problem, StartUsed::Nominal, &[T::ZERO; N]),
            Start::Free => self.phase = Phase::Beginning,
        }
    }

    /// Finds the free start; without one, identifies what the samples leave undetermined.
    #[inline(never)]
    fn find_free_start<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P) {
        if let Some(correction) = self.starts.next_free(problem) {
            self.iteration.point.correction = correction;
            self.phase = Phase::AtFreeStart;
        } else {
            self.start(problem, StartUsed::Free, &[T::ZERO; N]);
            self.phase = Phase::Undetermined;
        }
    }

    fn start<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
        start: StartUsed,
        correction: &[T; N],
    ) {
        self.restart(problem, correction);
        self.awaits_cost = true;
        self.phase = Phase::From(start);
    }

    fn restart<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P, correction: &[T; N]) {
        let weighted = Weighted {
            prior: &self.prior,
            sigma: self.balance.sigma,
        };
        self.iteration.restart(problem, &weighted, correction);
    }

    /// Whether the estimate is complete.
    pub(crate) const fn is_done(&self) -> bool {
        matches!(self.phase, Phase::Done)
    }

    /// Linearisations so far, over all starts.
    pub(crate) fn iterations(&self) -> u16 {
        self.iterations.saturating_add(self.iteration.iterations)
    }

    /// One step; does nothing once finished. The last one writes the estimate to `place`, scratch memory until then.
    ///
    /// # Errors
    /// From the last step: every [`Refusal`] that concerns the parameters. The estimate then has no meaning.
    pub(crate) fn step<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
        place: &mut Estimate<T, N>,
    ) -> Result<Progress, Refusal> {
        match self.phase {
            Phase::Beginning => self.find_free_start(problem),
            Phase::AtFreeStart => {
                let correction = self.iteration.point.correction;
                self.start(problem, StartUsed::Free, &correction);
            }
            Phase::From(start) => self.iterate(problem, start),
            Phase::Ended(start, termination) => self.settle(problem, start, termination),
            Phase::Identifying => self.identify(problem, covariance_of(place)),
            Phase::Undetermined => self.look_for_free(problem, covariance_of(place)),
            Phase::Judging => {
                self.judge(problem, place)?;
                self.phase = Phase::Done;
            }
            Phase::Done => {}
        }
        Ok(match self.phase {
            Phase::Done => Progress::Finished,
            _ => Progress::Working,
        })
    }

    fn iterate<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P, start: StartUsed) {
        if self.awaits_cost && !self.iteration.is_linearizing() {
            self.awaits_cost = false;
            self.starting_cost = self.iteration.point.cost;
        }
        let exhausted = self.iteration.iterations >= self.settings.iteration_limit
            && !self.iteration.is_linearizing();
        let termination = if exhausted {
            None
        } else {
            let weighted = Weighted {
                prior: &self.prior,
                sigma: self.balance.sigma,
            };
            match self.iteration.step(problem, &weighted) {
                None | Some(StepResult::Continue) => return,
                Some(StepResult::Failed) => None,
                Some(StepResult::Finished(termination)) => Some(termination),
            }
        };
        self.phase = Phase::Ended(start, termination);
    }

    /// An iteration has ended: keeps the better end, and decides what comes next.
    #[inline(never)]
    fn settle<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
        start: StartUsed,
        termination: Option<Termination>,
    ) {
        if let Some(termination) = termination {
            self.keep_better(problem, start, termination);
            self.starts.converged(start, &self.iteration.point, problem);
        }
        if self.balance.is_first() && self.start_elsewhere(problem, start) {
            return;
        }
        if self.end_alone {
            self.phase = Phase::Done;
            return;
        }
        self.identifiability.restart();
        self.phase = Phase::Identifying;
    }

    /// Keeps the end of the iteration if it is better than the best so far.
    #[inline(never)]
    fn keep_better<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
        start: StartUsed,
        termination: Termination,
    ) {
        let point = &self.iteration.point;
        if point.cost
            <= self.starting_cost
                + T::TWO * self.iteration.blur(problem)
                + rounding_of_cost(problem)
        {
            let improved = match &self.best {
                None => true,
                Some(best) => best.is_improved_by(
                    point,
                    self.balance.sigma,
                    self.settings.tolerance.is_some(),
                    problem,
                ),
            };
            if improved {
                self.best = Some(EndPoint {
                    point: point.clone(),
                    termination,
                    start,
                    residual_sigma: self.balance.sigma,
                });
            }
        }
    }

    /// A piece of the covariance at the best end point; decides what comes next once it is complete.
    #[inline(never)]
    fn identify<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
        covariance: &mut SMatrix<T, N, N>,
    ) {
        let point = match &self.best {
            Some(best) => &best.point,
            None => &self.iteration.point,
        };
        if self.identifiability.invert(&point.normal, covariance) {
            return;
        }
        if self.balance.is_first() {
            let own = &self.identifiability;
            self.starts
                .search(problem, point, || own.weakest_direction(covariance));
            if self.search_on(problem) {
                return;
            }
        }
        if self.balance_tolerance(problem, covariance) {
            return;
        }
        self.phase = Phase::Judging;
    }

    fn look_for_free<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
        covariance: &mut SMatrix<T, N, N>,
    ) {
        if self.iteration.is_linearizing() {
            let weighted = Weighted {
                prior: &self.prior,
                sigma: self.balance.sigma,
            };
            self.iteration.step(problem, &weighted);
        } else if !self
            .identifiability
            .invert(&self.iteration.point.normal, covariance)
        {
            self.phase = Phase::Judging;
        }
    }

    /// Starts again, and adds up the iterations so far.
    #[inline(never)]
    fn start_again<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
        start: StartUsed,
        correction: &[T; N],
    ) {
        self.iterations = self.iterations();
        self.restart(problem, correction);
        self.phase = Phase::From(start);
    }

    /// Starts again if the samples allow a better fit, or if there may be another solution.
    fn start_elsewhere<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
        ended: StartUsed,
    ) -> bool {
        if let Some(correction) = self.starts.better_free(problem, ended, self.best.as_ref()) {
            self.start_again(problem, StartUsed::Free, &correction);
            return true;
        }
        self.search_on(problem)
    }

    fn search_on<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P) -> bool {
        let Some((start, correction)) = self.starts.next_searched(problem) else {
            return false;
        };
        self.start_again(problem, start, &correction);
        true
    }

    /// If a tolerance but no noise is stated: solves again with the noise estimated from the residuals.
    #[inline(never)]
    fn balance_tolerance<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
        covariance: &SMatrix<T, N, N>,
    ) -> bool {
        let best = self.best.as_ref();
        if self.settings.tolerance.is_none()
            || problem.noise_stated()
            || !self
                .balance
                .next(problem, &self.prior, best, covariance.as_slice())
        {
            return false;
        }
        let (start, from) = best.map_or((StartUsed::Nominal, [T::ZERO; N]), |best| {
            (best.start, best.point.correction)
        });
        self.start_again(problem, start, &from);
        self.awaits_cost = true;
        true
    }

    /// The correction of the best end point, before any judgement.
    pub(crate) fn end(&self) -> Option<[T; N]> {
        self.best.as_ref().map(|best| best.point.correction)
    }

    /// Judges the best end point, and completes the estimate if it is good.
    #[inline(never)]
    fn judge<P: Problem<T, N, M, E, At = A>>(
        &self,
        problem: &P,
        place: &mut Estimate<T, N>,
    ) -> Result<(), Refusal> {
        let (point, end, residual_sigma): (&Point<T, N, M, E>, _, _) = match &self.best {
            Some(best) => (
                &best.point,
                Some((best.termination, best.start)),
                best.residual_sigma,
            ),
            None => (&self.iteration.point, None, self.balance.sigma),
        };
        Judgement {
            first_arm: self.first_arm,
            point,
            identifiability: &self.identifiability,
            end,
            prior: &self.prior,
            residual_sigma,
            iterations: self.iterations(),
        }
        .complete(problem, place)
    }
}

/// Where the covariance is stored. Not inlined: its stack would add to that of every step.
#[inline(never)]
fn covariance_of<T: Real, const N: usize>(place: &mut Estimate<T, N>) -> &mut SMatrix<T, N, N> {
    place.covariance.get_or_insert_with(SMatrix::zeros)
}

/// Checks that a calibration with these settings can start.
pub(crate) fn enough_samples<T, P, const N: usize, const M: usize, const E: usize>(
    problem: &P,
    arm: ArmIndex,
    settings: &Settings<T>,
) -> Result<(), Refusal>
where
    T: Real,
    P: Problem<T, N, M, E>,
{
    let forgotten = !(problem.effective_samples() > T::ZERO);
    let samples = if forgotten { 0 } else { problem.samples() };
    let needed = settings.samples_needed();
    if samples < needed {
        return Err(Refusal::TooFewSamples {
            arm,
            samples,
            needed,
        });
    }
    Ok(())
}

/// Rounds of noise estimation if a tolerance but no noise is stated.
const ROUNDS: u8 = 20;

/// The noise, estimated iteratively from the residuals so that samples and tolerance have the right weights (`MacKay`'s
/// evidence iteration, σ² = Σr²/(n − γ) with γ the number of parameters determined by the samples).
#[derive(Debug, Clone, Copy)]
pub(super) struct NoiseBalance<T> {
    /// σ of the weighted residual; 1 with a stated noise.
    pub(super) sigma: T,
    rounds: u8,
}

impl<T: Real> NoiseBalance<T> {
    pub(super) const fn none() -> Self {
        Self {
            sigma: T::ONE,
            rounds: 0,
        }
    }

    /// Whether the noise has not been estimated yet.
    pub(super) const fn is_first(&self) -> bool {
        self.rounds == 0
    }

    /// Whether to solve once more, with the σ estimated here from the best end point and its covariance.
    pub(super) fn next<P, R, const N: usize, const M: usize, const E: usize>(
        &mut self,
        problem: &P,
        prior: &R,
        best: Option<&EndPoint<T, N, M, E>>,
        covariance: &[T],
    ) -> bool
    where
        P: Problem<T, N, M, E>,
        R: Prior<T, N, M, E>,
    {
        if self.rounds >= ROUNDS {
            return false;
        }
        let Some(best) = best else {
            // Too weak a tolerance leaves the problem without a well-defined minimum: start from a stronger one.
            self.rounds += 1;
            self.sigma *= T::from_f64(10.0);
            return true;
        };
        let correction = &best.point.correction;
        let determined = determined_parameters(prior, correction, best.residual_sigma, covariance);
        let spare = problem.residuals() - determined;
        if !(spare > T::from_f64(1e-3)) {
            return false;
        }
        let least = T::from_f64(8.0) * T::EPSILON;
        let sigma = (best.point.sum_of_squares / spare)
            .square_root()
            .larger(least);
        let change = (sigma - best.residual_sigma).magnitude();
        if best.residual_sigma != self.sigma || !(change > T::from_f64(0.01) * self.sigma) {
            // Converged; or the last round failed, and the previous one stands.
            return false;
        }
        self.rounds += 1;
        self.sigma = sigma;
        true
    }
}

/// γ = N − Σ σ² (UᵀU C)ⱼⱼ: the number of parameters determined by the samples rather than the prior.
pub(super) fn determined_parameters<T, R, const N: usize, const M: usize, const E: usize>(
    prior: &R,
    correction: &[T; N],
    sigma: T,
    covariance: &[T],
) -> T
where
    T: Real,
    R: Prior<T, N, M, E>,
{
    let mut determined = T::from_count(N as u64);
    for share in prior.shares(correction, covariance) {
        determined -= share * sigma.squared();
    }
    determined
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::{Minimizer, Progress};
    use crate::calibration::curve::Curve;
    use crate::calibration::outcome::Estimate;
    use crate::calibration::settings::{Settings, Solver};
    use crate::calibration::tolerance::Tolerance;
    use crate::robot::ArmIndex;

    /// The end of the iteration of a problem, by full steps from p = 0.
    fn end(problem: &Curve) -> Option<[f64; 1]> {
        let settings = Settings::new().with_solver(Solver::GaussNewton);
        let mut solver =
            Minimizer::<f64, f64, [f64; 1], 1, 2, 3>::unstarted(ArmIndex::First, [0.0], &settings);
        solver.begin(problem);
        while solver.step(problem, &mut Estimate::vacant()) == Ok(Progress::Working) {}
        solver.end()
    }

    /// A full step can lead over a hill into another valley. Residuals of (1, 0) at p = 0 lead to p = 10, and the next
    /// step to p = 11, the bottom of a valley. That counts as an end only if the residuals there are smaller than at
    /// the start, however well the iteration has converged.
    #[test]
    fn an_end_that_is_worse_than_the_start_is_none() {
        let lower = Curve {
            residuals: |p| {
                if p < 5.0 {
                    [(1.0 - 0.1 * p, -0.1), (0.0, 0.0)]
                } else {
                    [(p - 11.0, 1.0), (0.9, 0.0)]
                }
            },
            ..Curve::straight()
        };
        assert_eq!(end(&lower), Some([11.0]));
        let higher = Curve {
            residuals: |p| {
                if p < 5.0 {
                    [(1.0 - 0.1 * p, -0.1), (0.0, 0.0)]
                } else {
                    [(p - 11.0, 1.0), (1.1, 0.0)]
                }
            },
            ..Curve::straight()
        };
        assert_eq!(end(&higher), None);
    }

    /// With a tolerance but no noise, the noise is estimated in rounds that solve the problem again. Only the first
    /// round searches for other solutions: the residuals of (p, 1) exceed any noise in every round.
    #[test]
    fn other_solutions_are_looked_for_once_and_not_with_every_estimate_of_the_noise() {
        let problem = Curve {
            residuals: |p| [(p, 1.0), (1.0, 0.0)],
            free_start: Some(7.0),
            ..Curve::straight()
        };
        let settings = Settings::new().with_tolerance(Tolerance::new(0.5, 0.003).unwrap());
        let mut solver =
            Minimizer::<f64, f64, [f64; 1], 1, 2, 3>::unstarted(ArmIndex::First, [1.0], &settings);
        solver.begin(&problem);
        let mut place = Estimate::vacant();
        while solver.step(&problem, &mut place) == Ok(Progress::Working) {}
        // Two residuals of 0 and 1, out of 60, one degree of freedom taken by the parameter.
        let sigma = libm::sqrt(1.0 / 59.0);
        assert!((solver.balance.sigma / sigma - 1.0).abs() < 0.01);
        assert_eq!(problem.asked.get(), 1);
    }
}
