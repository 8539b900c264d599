use super::identifiability::Identifiability;
use super::iteration::Iteration;
use super::judgement::Judgement;
use super::outcome::{Estimate, Start, Termination};
use super::point::{EndPoint, Point, Weighted};
use super::problem::{Extent, Judged};
use super::refusal::Refusal;
use super::settings::Settings;
use super::starts::{Next, Starts};
use super::step_control::StepResult;
use super::tolerance_prior::TolerancePrior;
use crate::Real;
use crate::robot::ArmIndex;
use crate::samples::Unknowns;
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

/// Minimises the residuals of a [`Problem`](super::problem::Problem) and the cost of a [`Prior`], one bounded step at a time, and judges the
/// result: from the nominal parameters, from a free start, or along the combination that the samples determine least,
/// whichever ends best.
///
/// The calibrators own one for each problem.
#[derive(Debug, Clone)]
pub(crate) struct Minimizer<T: Unknowns<N>, A, R, const N: usize> {
    first_arm: ArmIndex,
    settings: Settings<T>,
    prior: Weighted<T, N>,
    phase: Phase,
    iteration: Iteration<T, A, R, N>,
    /// The cost at the first start, or at that of the last balance: a higher end does not count.
    starting_cost: T,
    /// Whether that cost is still to be computed.
    awaits_cost: bool,
    /// The best end point so far.
    best: Option<EndPoint<T, N>>,
    /// The identifiability at the best end point.
    identifiability: Identifiability<T, N>,
    starts: Starts<T, N>,
    /// Whether only the end point is wanted.
    end_alone: bool,
    iterations: u16,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The free start is still to be found: a step for each that is tried, another to start there.
    Beginning,
    From(Start),
    /// A start without a guess or a further one was found.
    Again(Start),
    /// A further start is tried; whether the covariance at the best end point is known.
    Elsewhere(bool),
    /// An iteration has ended.
    Ended(Start, Option<Termination>),
    /// The covariance at the best end point is being computed.
    Identifying,
    /// There is no free start: identifying what the samples leave undetermined.
    Undetermined,
    /// The covariance is known: judging the end point.
    Judging,
    Done,
}

impl<T: Unknowns<N>, A: Clone, R: Clone + Default, const N: usize> Minimizer<T, A, R, N> {
    /// Before [`begin`](Self::begin).
    #[inline(always)]
    pub(crate) fn unstarted(
        first_arm: ArmIndex,
        prior: TolerancePrior<T, N>,
        settings: &Settings<T>,
    ) -> Self {
        Self {
            first_arm,
            settings: *settings,
            prior: Weighted::new(prior),
            phase: Phase::Done,
            starting_cost: T::ZERO,
            awaits_cost: false,
            iteration: Iteration::unstarted(settings.damped, settings.tolerance.is_some()),
            best: None,
            identifiability: Identifiability::unstarted(),
            starts: Starts::new(settings.free_start),
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

    /// Starts if there are [`enough_samples`]. In place: on a small stack, a copy of a solver is a large object.
    pub(crate) fn begin(&mut self, problem: &impl Judged<T, N, At = A, Rows = R>) {
        if let Some(tolerance) = &self.settings.tolerance
            && let Some(unit) = problem.extent().unit
        {
            self.prior.sigma = T::from_f64(0.01) * tolerance.length() / unit;
        }
        self.awaits_cost = true;
        if self.settings.free_start {
            self.phase = Phase::Beginning;
        } else {
            self.start_at(Start::Nominal, [T::ZERO; N]);
        }
    }

    /// The next step starts there.
    fn start_at(&mut self, start: Start, correction: [T; N]) {
        self.iteration.point.correction = correction;
        self.phase = Phase::Again(start);
    }

    fn restart(&mut self, problem: &impl Judged<T, N, At = A, Rows = R>, correction: &[T; N]) {
        self.iteration.restart(problem, &self.prior, correction);
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
    pub(crate) fn step(
        &mut self,
        problem: &impl Judged<T, N, At = A, Rows = R>,
        place: &mut Estimate<T, N>,
    ) -> Result<Progress, Refusal> {
        match self.phase {
            Phase::Beginning | Phase::Elsewhere(_) => self.start_elsewhere(problem, place),
            Phase::Again(start) => {
                self.iterations = self.iterations();
                let correction = self.iteration.point.correction;
                self.restart(problem, &correction);
                self.phase = Phase::From(start);
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

    fn iterate(&mut self, problem: &impl Judged<T, N, At = A, Rows = R>, start: Start) {
        if self.awaits_cost && !self.iteration.is_linearizing() {
            self.awaits_cost = false;
            self.starting_cost = self.iteration.point.cost;
        }
        let exhausted = self.iteration.iterations >= self.settings.iteration_limit
            && !self.iteration.is_linearizing();
        let termination = if exhausted {
            None
        } else {
            match self.iteration.step(problem, &self.prior) {
                None | Some(StepResult::Continue) => return,
                Some(StepResult::Failed) => None,
                Some(StepResult::Finished(termination)) => Some(termination),
            }
        };
        self.phase = Phase::Ended(start, termination);
    }

    /// An iteration has ended: keeps the better end, and decides what comes next.
    #[inline(never)] // with the others here 0.7 kB of joint flash, 0.6 kB of joint stack
    fn settle(
        &mut self,
        problem: &impl Judged<T, N, At = A, Rows = R>,
        start: Start,
        termination: Option<Termination>,
    ) {
        if let Some(termination) = termination {
            self.keep_better(problem, start, termination);
            self.starts.converged(start, &self.iteration.point, problem);
            // What comes next is decided in a step of its own.
            self.phase = Phase::Ended(start, None);
            return;
        }
        if self.prior.rounds == 0 {
            self.starts.better_free(problem, start, self.best.as_ref());
            if self.starts.any() {
                self.phase = Phase::Elsewhere(false);
                return;
            }
        }
        self.settle_there();
    }

    /// The best end point is the last.
    fn settle_there(&mut self) {
        self.identifiability.restart();
        self.phase = if self.end_alone {
            Phase::Done
        } else {
            Phase::Identifying
        };
    }

    /// Keeps the end of the iteration if it is better than the best so far.
    fn keep_better(
        &mut self,
        problem: &impl Judged<T, N, At = A, Rows = R>,
        start: Start,
        termination: Termination,
    ) {
        let point = &self.iteration.point;
        if point.cost
            <= self.starting_cost
                + T::TWO * self.iteration.blur(problem)
                + problem.rounding_of_cost()
        {
            let improved = match &self.best {
                None => true,
                Some(best) => best.is_improved_by(
                    point,
                    self.prior.sigma,
                    self.settings.tolerance.is_some(),
                    problem,
                ),
            };
            if improved {
                self.best = Some(EndPoint {
                    point: point.clone(),
                    termination,
                    start,
                    residual_sigma: self.prior.sigma,
                });
            }
        }
    }

    /// A piece of the covariance at the best end point; decides what comes next once it is complete.
    #[inline(never)] // see `settle`
    fn identify(
        &mut self,
        problem: &impl Judged<T, N, At = A, Rows = R>,
        covariance: &mut SMatrix<T, N, N>,
    ) {
        let point = match &self.best {
            Some(best) => &best.point,
            None => &self.iteration.point,
        };
        if self.identifiability.invert(&point.normal, covariance) {
            return;
        }
        if self.prior.rounds == 0 {
            let own = &self.identifiability;
            self.starts.search(&problem.extent(), point, || {
                own.weakest_direction(covariance)
            });
            if self.starts.any() {
                self.phase = Phase::Elsewhere(true);
                return;
            }
        }
        self.balance_tolerance(problem, covariance);
    }

    fn look_for_free(
        &mut self,
        problem: &impl Judged<T, N, At = A, Rows = R>,
        covariance: &mut SMatrix<T, N, N>,
    ) {
        if self.iteration.is_linearizing() {
            self.iteration.step(problem, &self.prior);
        } else if !self
            .identifiability
            .invert(&self.iteration.point.normal, covariance)
        {
            self.phase = Phase::Judging;
        }
    }

    /// Tries a start; without one, identifies what the samples leave undetermined, or the best end point is the last.
    #[inline(never)] // see `settle`
    fn start_elsewhere(
        &mut self,
        problem: &impl Judged<T, N, At = A, Rows = R>,
        place: &mut Estimate<T, N>,
    ) {
        match (self.starts.next(problem), self.phase) {
            (Next::Start(start, correction), _) => self.start_at(start, correction),
            (Next::Undetermined, _) => {}
            (Next::None, Phase::Elsewhere(true)) => {
                self.balance_tolerance(problem, covariance_of(place));
            }
            (Next::None, Phase::Elsewhere(false)) => self.settle_there(),
            (Next::None, _) => {
                self.restart(problem, &[T::ZERO; N]);
                self.phase = Phase::Undetermined;
            }
        }
    }

    /// If a tolerance but no noise is stated: solves again with the noise estimated from the residuals. Otherwise the
    /// best end point is judged.
    #[inline(never)] // see `settle`
    fn balance_tolerance(
        &mut self,
        problem: &impl Judged<T, N, At = A, Rows = R>,
        covariance: &SMatrix<T, N, N>,
    ) {
        let (best, extent) = (self.best.as_ref(), problem.extent());
        if self.settings.tolerance.is_none()
            || extent.unit.is_none()
            || !self.prior.balance(&extent, best, covariance.as_slice())
        {
            self.phase = Phase::Judging;
            return;
        }
        let (start, from) = best.map_or((Start::Nominal, [T::ZERO; N]), |best| {
            (best.start, best.point.correction)
        });
        self.awaits_cost = true;
        self.start_at(start, from);
    }

    /// The correction of the best end point, before any judgement.
    pub(crate) fn end(&self) -> Option<[T; N]> {
        self.best.as_ref().map(|best| best.point.correction)
    }

    /// Judges the best end point, and completes the estimate if it is good.
    fn judge(
        &self,
        problem: &impl Judged<T, N, At = A, Rows = R>,
        place: &mut Estimate<T, N>,
    ) -> Result<(), Refusal> {
        let (point, end, residual_sigma): (&Point<T, N>, _, _) = match &self.best {
            Some(best) => (
                &best.point,
                Some((best.termination, best.start)),
                best.residual_sigma,
            ),
            None => (&self.iteration.point, None, self.prior.sigma),
        };
        Judgement {
            first_arm: self.first_arm,
            point,
            identifiability: &self.identifiability,
            end,
            prior: &self.prior.prior,
            tolerance: self.settings.tolerance.as_ref(),
            residual_sigma,
            iterations: self.iterations(),
        }
        .complete(problem, place)
    }
}

/// Where the covariance is stored.
fn covariance_of<T: Real, const N: usize>(place: &mut Estimate<T, N>) -> &mut SMatrix<T, N, N> {
    place.covariance.get_or_insert_with(SMatrix::zeros)
}

/// Checks that a calibration with these settings can start.
pub(crate) fn enough_samples<T: Real>(
    extent: &Extent<T>,
    arm: ArmIndex,
    settings: &Settings<T>,
) -> Result<(), Refusal> {
    let forgotten = !(extent.effective_samples > T::ZERO);
    let samples = if forgotten { 0 } else { extent.samples };
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
