use super::end_point::{EndPoint, rounding_of_cost};
use super::identifiability::Identifiability;
use super::iteration::Iteration;
use super::judgement::Judgement;
use super::limits::{EXCESS_OF_ANOTHER_MINIMUM, SAMPLES_FOR_FREE_START};
use super::outcome::{Estimate, StartUsed, Termination};
use super::point::{Point, Weighted};
use super::problem::{Prior, Problem, sum_of_squares};
use super::refusal::Refusal;
use super::search::Search;
use super::settings::{Settings, Start};
use super::step_control::StepResult;
use crate::Real;
use crate::robot::{ArmIndex, Parameter};

/// Rounds of estimating the noise when a tolerance but no noise is stated.
const NOISE_ROUNDS: u8 = 20;

/// Whether a solver has more to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Progress {
    /// Call `step` again.
    Working,
    /// The outcome is ready.
    Finished,
}

/// Minimises the residuals of a [`Problem`] and the cost of a [`Prior`], one bounded step at a time, and
/// judges what it found: from the nominal parameters, without a guess, or along what the samples
/// determine least, whichever ends best. N parameters, M = N + 1, E = M (M + 1)/2.
///
/// Use it as [`ArmSolver`](super::ArmSolver) or [`JointSolver`](super::JointSolver).
#[derive(Debug, Clone, Copy)]
pub struct Minimizer<T: Real, A, R, const N: usize, const M: usize, const E: usize> {
    first_arm: ArmIndex,
    settings: Settings<T>,
    prior: R,
    /// One σ of the weighted residual: 1 with a stated noise, otherwise the estimate that the
    /// tolerance is balanced against.
    residual_sigma: T,
    noise_rounds: u8,
    phase: Phase,
    iteration: Iteration<T, A, N, M, E>,
    starting_cost: T,
    /// Whether the cost at the start is still to be computed.
    awaits_cost: bool,
    /// The best end point so far.
    best: Option<EndPoint<T, N, M, E>>,
    /// Of the best end point.
    identifiability: Identifiability<T, N>,
    /// For other solutions, once there is a first end point.
    search: Option<Search<T, N>>,
    /// Whether the end point is all that is asked for.
    end_alone: bool,
    /// How many starts without a guess were tried.
    free_starts: u8,
    iterations: u16,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The start without a guess is still to be found: a step by itself, and another to begin there.
    Beginning,
    AtFreeStart,
    From(StartUsed),
    /// An iteration has ended.
    Ended(StartUsed, Option<Termination>),
    /// Computing the covariance at the best end point.
    Identifying,
    /// There is no start without a guess: looking for what the samples leave free.
    Undetermined,
    Done,
}

impl<T, A, R, const N: usize, const M: usize, const E: usize> Minimizer<T, A, R, N, M, E>
where
    T: Real,
    A: Clone,
    R: Prior<T, N, M, E>,
{
    /// Before [`begin`](Self::begin).
    pub(crate) fn unstarted(first_arm: ArmIndex, prior: R, settings: &Settings<T>) -> Self {
        Self {
            first_arm,
            settings: *settings,
            prior,
            residual_sigma: T::ONE,
            noise_rounds: 0,
            phase: Phase::Done,
            starting_cost: T::ZERO,
            awaits_cost: false,
            iteration: Iteration::unstarted(settings.solver),
            best: None,
            identifiability: Identifiability::unstarted(),
            search: None,
            end_alone: false,
            free_starts: 0,
            iterations: 0,
        }
    }

    /// The same for its [`end`](Self::end) alone: no search for other solutions, no balance of the
    /// tolerance, and nothing to judge.
    pub(crate) const fn for_its_end(mut self) -> Self {
        self.end_alone = true;
        self
    }

    /// Prepares the minimisation. `first_arm`: the arm of the first eight parameters.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`].
    pub fn with_prior<P: Problem<T, N, M, E, At = A>>(
        problem: &P,
        first_arm: ArmIndex,
        prior: R,
        settings: &Settings<T>,
    ) -> Result<Self, Refusal> {
        let mut solver = Self::unstarted(first_arm, prior, settings);
        solver.begin(problem)?;
        Ok(solver)
    }

    /// In place: on a small stack a copy of a solver is a large object.
    #[inline(never)]
    pub(crate) fn begin<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
    ) -> Result<(), Refusal> {
        enough_samples(problem, self.first_arm, &self.settings)?;
        if let Some(tolerance) = &self.settings.tolerance
            && !problem.noise_stated()
        {
            self.residual_sigma = T::from_f64(0.01) * tolerance.of(Parameter::Lb) / problem.unit();
        }
        match self.settings.start {
            Start::Nominal => self.start(problem, StartUsed::Nominal, &[T::ZERO; N]),
            Start::Free => self.phase = Phase::Beginning,
        }
        Ok(())
    }

    /// Where there is none, looks for what the samples leave free.
    #[inline(never)]
    fn find_free_start<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P) {
        if let Some(correction) = self.next_free_start(problem) {
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
            sigma: self.residual_sigma,
        };
        self.iteration.restart(problem, &weighted, correction);
    }

    /// The arm of the first eight parameters.
    pub(super) const fn first_arm(&self) -> ArmIndex {
        self.first_arm
    }

    /// Linearisations so far, all starts together.
    pub fn iterations(&self) -> u16 {
        self.iterations.saturating_add(self.iteration.iterations)
    }

    /// One step. Does nothing once finished.
    pub fn step<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P) -> Progress {
        match self.phase {
            Phase::Beginning => self.find_free_start(problem),
            Phase::AtFreeStart => {
                let correction = self.iteration.point.correction;
                self.start(problem, StartUsed::Free, &correction);
            }
            Phase::From(start) => self.iterate(problem, start),
            Phase::Ended(start, termination) => self.settle(problem, start, termination),
            Phase::Identifying => self.identify(problem),
            Phase::Undetermined => self.look_for_free(problem),
            Phase::Done => {}
        }
        match self.phase {
            Phase::Done => Progress::Finished,
            _ => Progress::Working,
        }
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
                sigma: self.residual_sigma,
            };
            match self.iteration.step(problem, &weighted) {
                None | Some(StepResult::Continue) => return,
                Some(StepResult::Failed) => None,
                Some(StepResult::Finished(termination)) => Some(termination),
            }
        };
        self.phase = Phase::Ended(start, termination);
    }

    /// An iteration has ended: keeps the better end, and decides what is next.
    #[inline(never)]
    fn settle<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
        start: StartUsed,
        termination: Option<Termination>,
    ) {
        let point = &self.iteration.point;
        if let Some(termination) = termination
            && point.cost
                <= self.starting_cost
                    + T::TWO * self.iteration.blur(problem)
                    + rounding_of_cost(problem)
        {
            let improved = match &self.best {
                None => true,
                Some(best) => best.is_improved_by(
                    point,
                    self.residual_sigma,
                    self.settings.tolerance.is_some(),
                    problem,
                ),
            };
            if improved {
                self.best = Some(EndPoint {
                    point: *point,
                    termination,
                    start,
                    residual_sigma: self.residual_sigma,
                });
            }
        }
        if start == StartUsed::Search
            && termination.is_some()
            && let Some(search) = &mut self.search
        {
            search.converged(&self.iteration.point, problem);
        }
        if self.noise_rounds == 0 {
            if self.try_free_start(problem, start) || self.try_another_free_start(problem) {
                return;
            }
            if self.search.is_some() && self.search_on(problem) {
                return;
            }
        }
        if self.end_alone {
            self.phase = Phase::Done;
            return;
        }
        self.identifiability.restart();
        self.phase = Phase::Identifying;
    }

    /// A piece of the covariance at the best end point; what is next once it is there.
    #[inline(never)]
    fn identify<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P) {
        let point = match &self.best {
            Some(best) => &best.point,
            None => &self.iteration.point,
        };
        if self.identifiability.invert(&point.normal) {
            return;
        }
        if self.noise_rounds == 0 && self.search(problem) {
            return;
        }
        if self.balance_tolerance(problem) {
            return;
        }
        self.phase = Phase::Done;
    }

    fn look_for_free<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P) {
        if self.iteration.is_linearizing() {
            let weighted = Weighted {
                prior: &self.prior,
                sigma: self.residual_sigma,
            };
            self.iteration.step(problem, &weighted);
        } else if !self.identifiability.invert(&self.iteration.point.normal) {
            self.phase = Phase::Done;
        }
    }

    /// Starts again without a guess if the samples allow a clearly better fit than was found.
    ///
    /// The free fit of the coefficients leaves ρ², which no parameters undercut; the parameters of the
    /// right solution leave four residual variances an arm more, a false minimum far more than that.
    #[inline(never)]
    fn try_free_start<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
        start: StartUsed,
    ) -> bool {
        let samples_needed = T::from_count(SAMPLES_FOR_FREE_START);
        if problem.effective_samples() < samples_needed
            || start != StartUsed::Nominal
            || !self.another_minimum_may_fit_better(problem)
        {
            return false;
        }
        let Some(correction) = problem.free_start(0) else {
            return false;
        };
        self.start_free(problem, &correction);
        true
    }

    fn another_minimum_may_fit_better<P: Problem<T, N, M, E>>(&self, problem: &P) -> bool {
        let Some(best) = &self.best else {
            return true;
        };
        let spare = problem.effective_samples() - T::from_count(SAMPLES_FOR_FREE_START);
        let least = problem.least_sum_of_squares();
        let variance = if problem.noise_stated() {
            T::ONE
        } else {
            let residuals = spare * T::from_count(u64::from(P::RESIDUALS));
            least / residuals.larger(T::ONE)
        };
        let excess = best.point.sum_of_squares - least;
        excess > T::from_f64(EXCESS_OF_ANOTHER_MINIMUM) * variance + rounding_of_cost(problem)
    }

    fn start_free<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P, correction: &[T; N]) {
        self.iterations = self.iterations();
        self.restart(problem, correction);
        self.phase = Phase::From(StartUsed::Free);
    }

    fn next_free_start<P: Problem<T, N, M, E>>(&mut self, problem: &P) -> Option<[T; N]> {
        while self.free_starts < P::FREE_STARTS {
            self.free_starts += 1;
            if let Some(correction) = problem.free_start(self.free_starts - 1) {
                return Some(correction);
            }
        }
        None
    }

    /// Without a guess: starts again where the starts so far led to no solution that is surely the best.
    #[inline(never)]
    fn try_another_free_start<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P) -> bool {
        if self.settings.start != Start::Free || !self.another_minimum_may_fit_better(problem) {
            return false;
        }
        let Some(correction) = self.next_free_start(problem) else {
            return false;
        };
        self.start_free(problem, &correction);
        self.awaits_cost = true;
        true
    }

    /// With fewer than twelve samples there may be several solutions, and no linear fit to tell a
    /// false one. Starts again from both sides of the first end point.
    #[inline(never)]
    fn search<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P) -> bool {
        if problem.effective_samples() >= T::from_count(SAMPLES_FOR_FREE_START) {
            return false;
        }
        if self.search.is_none() {
            let from = match &self.best {
                Some(best) => &best.point,
                None => &self.iteration.point,
            };
            let direction = self.identifiability.weakest_direction();
            self.search = Some(Search::new(from.correction, direction));
        }
        self.search_on(problem)
    }

    fn search_on<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P) -> bool {
        while let Some(correction) = self.search.as_mut().and_then(Search::next) {
            // Where there is no such robot nothing can start.
            if sum_of_squares(problem, &problem.displaced(&correction)).finite() {
                self.iterations = self.iterations();
                self.restart(problem, &correction);
                self.phase = Phase::From(StartUsed::Search);
                return true;
            }
        }
        // Few samples may determine a start without a guess all the same.
        if self.free_starts == 0 {
            self.free_starts = 1;
            if let Some(correction) = problem.free_start(0) {
                self.start_free(problem, &correction);
                return true;
            }
        }
        false
    }

    /// A tolerance without a stated noise: estimates the noise from the residuals, so that samples
    /// and tolerance have the right weights (`MacKay`'s evidence iteration, σ² = Σr²/(n − γ) with
    /// γ the number of parameters that the samples determine), and solves again from there.
    #[inline(never)]
    fn balance_tolerance<P: Problem<T, N, M, E, At = A>>(&mut self, problem: &P) -> bool {
        if self.settings.tolerance.is_none()
            || problem.noise_stated()
            || self.noise_rounds >= NOISE_ROUNDS
        {
            return false;
        }
        let Some(best) = &self.best else {
            // Too weak a tolerance leaves the problem without a firm minimum: start from a stronger.
            let sigma = T::from_f64(10.0) * self.residual_sigma;
            self.restart_balanced(problem, sigma, &[T::ZERO; N]);
            self.phase = Phase::From(StartUsed::Nominal);
            return true;
        };
        let determined = determined_parameters(
            &self.prior,
            best.residual_sigma,
            self.identifiability.covariance.as_slice(),
        );
        let spare = problem.residuals() - determined;
        if !(spare > T::from_f64(1e-3)) {
            return false;
        }
        let least = T::from_f64(8.0) * T::EPSILON;
        let sigma = (best.point.sum_of_squares / spare)
            .square_root()
            .larger(least);
        let change = (sigma - best.residual_sigma).magnitude();
        if best.residual_sigma != self.residual_sigma
            || !(change > T::from_f64(0.01) * self.residual_sigma)
        {
            // Settled; or the last round failed, and the one before it stands.
            return false;
        }
        let (from, start) = (best.point.correction, best.start);
        self.restart_balanced(problem, sigma, &from);
        self.phase = Phase::From(start);
        true
    }

    #[inline(never)]
    fn restart_balanced<P: Problem<T, N, M, E, At = A>>(
        &mut self,
        problem: &P,
        sigma: T,
        from: &[T; N],
    ) {
        self.noise_rounds += 1;
        self.residual_sigma = sigma;
        self.iterations = self.iterations();
        self.restart(problem, from);
        self.awaits_cost = true;
    }

    /// The correction of the best end point, whatever is to be said of it.
    pub fn end(&self) -> Option<[T; N]> {
        self.best.as_ref().map(|best| best.point.correction)
    }

    /// The parameters, or why there are none.
    ///
    /// # Errors
    /// Every [`Refusal`] that concerns the parameters; [`Refusal::Unfinished`] before the last step.
    #[inline(never)]
    pub fn estimate<P: Problem<T, N, M, E, At = A>>(
        &self,
        problem: &P,
    ) -> Result<Estimate<T, N>, Refusal> {
        if self.phase != Phase::Done {
            return Err(Refusal::Unfinished);
        }
        let (point, end, residual_sigma): (&Point<T, N, M, E>, _, _) = match &self.best {
            Some(best) => (
                &best.point,
                Some((best.termination, best.start)),
                best.residual_sigma,
            ),
            None => (&self.iteration.point, None, self.residual_sigma),
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
        .estimate(problem)
    }
}

/// γ = N − Σ σ² (UᵀU C)ⱼⱼ: how many parameters the samples determine and not the prior.
pub(super) fn determined_parameters<T, R, const N: usize, const M: usize, const E: usize>(
    prior: &R,
    sigma: T,
    covariance: &[T],
) -> T
where
    T: Real,
    R: Prior<T, N, M, E>,
{
    let mut determined = T::from_count(N as u64);
    for parameter in 0..N {
        determined -= prior.share(covariance, parameter) * sigma.squared();
    }
    determined
}

/// Whether a calibration with these settings can begin.
pub(super) fn enough_samples<T, P, const N: usize, const M: usize, const E: usize>(
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
