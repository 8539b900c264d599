use super::end_point::{EndPoint, rounding_of_cost};
use super::identifiability::Identifiability;
use super::iteration::Iteration;
use super::judgement::Judgement;
use super::limits::{EXCESS_OF_ANOTHER_MINIMUM, SAMPLES_FOR_FREE_START};
use super::outcome::{ArmOutcome, StartUsed};
use super::problem::ArmProblem;
use super::refusal::Refusal;
use super::settings::{Settings, Start};
use super::step_control::StepResult;
use crate::Real;
use crate::robot::{ArmIndex, Parameter};

/// Lengths of the displacements tried in search of other solutions, in units of the scale and
/// radians, along the combination of parameters that the samples determine least. Single precision:
/// a conversion of `f64` at run time would link its software arithmetic.
const SEARCH: [f32; 8] = [-0.01, 0.01, -0.03, 0.03, -0.06, 0.06, -0.12, 0.12];
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

/// Calibrates one arm, one bounded step at a time, so that a control loop can interleave it.
///
/// With [`ArmFactor`](crate::samples::ArmFactor) a step takes the same time whatever the number of samples.
///
/// ```
/// use delta_cal::{ArmIndex, Progress, Settings, SymmetricRobot};
/// use delta_cal::calibration::ArmSolver;
/// use delta_cal::samples::{ArmFactor, NominalArm};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// # let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }.robot()?;
/// # let truth = SymmetricRobot { base_radius: 194.5, platform_radius: 30.0, upper_arm: 260.3, forearm: 479.2 }.robot()?;
/// let centre = robot.forward(&[0.2, 0.2, 0.2])?;
/// let arm = ArmIndex::First;
/// let mut factor = ArmFactor::new(NominalArm::new(robot.arm(arm), &centre, None));
/// for k in 0..20 {
///     let t = f64::from(k);
///     let q = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     factor.add(&truth.forward(&q)?, q[0], arm)?;
/// }
/// let mut solver = ArmSolver::new(&factor, arm, &Settings::default())?;
/// while solver.step(&factor) == Progress::Working {
///     // ... the control loop's other work ...
/// }
/// let outcome = solver.outcome(&factor)?;
/// assert!((outcome.arm.lb() - 479.2).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ArmSolver<T: Real> {
    arm: ArmIndex,
    settings: Settings<T>,
    /// 1/tolerance in internal units; zero without one.
    tolerance_weights: [T; 8],
    /// One σ of the weighted residual: 1 with a stated noise, otherwise the estimate that the
    /// tolerance is balanced against.
    residual_sigma: T,
    noise_rounds: u8,
    phase: Phase,
    iteration: Iteration<T>,
    starting_cost: T,
    /// The best end point so far.
    best: Option<EndPoint<T>>,
    /// Where the search for other solutions starts from, its direction, and how far it has come.
    search: Option<([T; 8], [T; 8])>,
    searched: usize,
    iterations: u16,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    From(StartUsed),
    Done,
}

impl<T: Real> ArmSolver<T> {
    /// Prepares the calibration of `arm` from the samples in `problem`.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`]; [`Refusal::Undetermined`] if the start without a guess is asked
    /// for and the samples do not determine it.
    pub fn new<P: ArmProblem<T>>(
        problem: &P,
        arm: ArmIndex,
        settings: &Settings<T>,
    ) -> Result<Self, Refusal> {
        let mut solver = Self::unstarted(arm, settings);
        solver.begin(problem)?;
        Ok(solver)
    }

    /// Before [`begin`](Self::begin).
    pub(super) fn unstarted(arm: ArmIndex, settings: &Settings<T>) -> Self {
        Self {
            arm,
            settings: *settings,
            tolerance_weights: [T::ZERO; 8],
            residual_sigma: T::ONE,
            noise_rounds: 0,
            phase: Phase::Done,
            starting_cost: T::ZERO,
            iteration: Iteration::unstarted(settings.solver),
            best: None,
            search: None,
            searched: 0,
            iterations: 0,
        }
    }

    /// In place: on a small stack a copy of a solver is a large object.
    #[inline(never)]
    pub(super) fn begin<P: ArmProblem<T>>(&mut self, problem: &P) -> Result<(), Refusal> {
        let (arm, settings) = (self.arm, self.settings);
        enough_samples(problem, arm, &settings)?;
        let nominal = problem.nominal();
        if let Some(tolerance) = &settings.tolerance {
            self.tolerance_weights = tolerance.weights(nominal);
            if nominal.noise().is_none() {
                self.residual_sigma =
                    T::from_f64(0.01) * tolerance.of(Parameter::Lb) / nominal.scale();
            }
        }
        let (start, correction) = match settings.start {
            Start::Nominal => (StartUsed::Nominal, Some([T::ZERO; 8])),
            Start::Free => (StartUsed::Free, problem.free_start()),
        };
        let from = correction.unwrap_or([T::ZERO; 8]);
        let prior = self.prior();
        self.iteration.restart(problem, &prior, &from);
        if correction.is_none() {
            return Err(Identifiability::of(&self.iteration.normal).undetermined(arm));
        }
        if !self.iteration.cost.finite() {
            return Err(Refusal::NonFinite { arm });
        }
        self.starting_cost = self.iteration.cost;
        self.phase = Phase::From(start);
        Ok(())
    }

    fn prior(&self) -> [T; 8] {
        self.prior_at(self.residual_sigma)
    }

    fn prior_at(&self, residual_sigma: T) -> [T; 8] {
        self.tolerance_weights.map(|weight| weight * residual_sigma)
    }

    /// Linearisations so far, all starts together.
    pub fn iterations(&self) -> u16 {
        self.iterations.saturating_add(self.iteration.iterations)
    }

    /// One step. Does nothing once finished.
    pub fn step<P: ArmProblem<T>>(&mut self, problem: &P) -> Progress {
        let Phase::From(start) = self.phase else {
            return Progress::Finished;
        };
        let result = self.iteration.step(problem, &self.prior());
        let termination = match result {
            StepResult::Continue if self.iteration.iterations < self.settings.iteration_limit => {
                return Progress::Working;
            }
            StepResult::Continue | StepResult::Failed => None,
            StepResult::Finished(termination) => Some(termination),
        };
        if let Some(termination) = termination
            && self.iteration.cost
                <= self.starting_cost
                    + T::TWO * self.iteration.blur(problem)
                    + rounding_of_cost(problem)
        {
            let improved = match &self.best {
                None => true,
                Some(best) => best.is_improved_by(
                    &self.iteration,
                    self.residual_sigma,
                    self.settings.tolerance.is_some(),
                    problem,
                ),
            };
            if improved {
                self.best = Some(EndPoint {
                    iteration: self.iteration,
                    termination,
                    start,
                    residual_sigma: self.residual_sigma,
                });
            }
        }
        if self.noise_rounds == 0 && (self.try_free_start(problem, start) || self.search(problem)) {
            return Progress::Working;
        }
        if self.balance_tolerance(problem) {
            return Progress::Working;
        }
        self.phase = Phase::Done;
        Progress::Finished
    }

    /// Starts again without a guess if the samples allow a clearly better fit than was found.
    ///
    /// The free fit of twelve coefficients leaves ρ², which no parameters undercut; the eight
    /// parameters of the right solution leave four residual variances more, a false minimum far
    /// more than that.
    #[inline(never)]
    fn try_free_start<P: ArmProblem<T>>(&mut self, problem: &P, start: StartUsed) -> bool {
        let spare = problem.effective_samples() - T::from_count(SAMPLES_FOR_FREE_START);
        if spare < T::ZERO || start != StartUsed::Nominal {
            return false;
        }
        if let Some(best) = &self.best {
            let least = problem.least_sum_of_squares();
            let variance = if problem.nominal().noise().is_some() {
                T::ONE
            } else {
                least / spare.larger(T::ONE)
            };
            let excess = best.iteration.sum_of_squares - least;
            if !(excess
                > T::from_f64(EXCESS_OF_ANOTHER_MINIMUM) * variance + rounding_of_cost(problem))
            {
                return false;
            }
        }
        let Some(correction) = problem.free_start() else {
            return false;
        };
        self.iterations = self.iterations();
        let prior = self.prior();
        self.iteration.restart(problem, &prior, &correction);
        self.phase = Phase::From(StartUsed::Free);
        true
    }

    /// With fewer than twelve samples there may be several solutions, and no linear fit to tell a
    /// false one. Starts again from both sides of the first end point.
    #[inline(never)]
    fn search<P: ArmProblem<T>>(&mut self, problem: &P) -> bool {
        if problem.effective_samples() >= T::from_count(SAMPLES_FOR_FREE_START) {
            return false;
        }
        let (origin, direction) = *self.search.get_or_insert_with(|| {
            let from = self
                .best
                .as_ref()
                .map_or(&self.iteration, |best| &best.iteration);
            (
                from.correction,
                Identifiability::of(&from.normal).weakest_direction(),
            )
        });
        while let Some(distance) = SEARCH.get(self.searched) {
            self.searched += 1;
            let mut correction = origin;
            for (value, part) in correction.iter_mut().zip(direction) {
                *value += part * T::from_f64(f64::from(*distance));
            }
            self.iterations = self.iterations();
            let prior = self.prior();
            self.iteration.restart(problem, &prior, &correction);
            if self.iteration.cost.finite() {
                self.phase = Phase::From(StartUsed::Search);
                return true;
            }
        }
        false
    }

    /// A tolerance without a stated noise: estimates the noise from the residuals, so that samples
    /// and tolerance have the right weights (`MacKay`'s evidence iteration, σ² = Σr²/(n − γ) with
    /// γ the number of parameters that the samples determine), and solves again from there.
    #[inline(never)]
    fn balance_tolerance<P: ArmProblem<T>>(&mut self, problem: &P) -> bool {
        if self.settings.tolerance.is_none() || problem.nominal().noise().is_some() {
            return false;
        }
        if self.noise_rounds >= NOISE_ROUNDS {
            return false;
        }
        let Some(best) = &self.best else {
            // Too weak a tolerance leaves the problem without a firm minimum: start from a stronger.
            self.restart_balanced(
                problem,
                T::from_f64(10.0) * self.residual_sigma,
                &[T::ZERO; 8],
            );
            self.phase = Phase::From(StartUsed::Nominal);
            return true;
        };
        let identifiability = Identifiability::of(&best.iteration.normal);
        let determined = identifiability.determined_parameters(&self.prior_at(best.residual_sigma));
        let spare = problem.effective_samples() - determined;
        if !(spare > T::from_f64(1e-3)) {
            return false;
        }
        let least = T::from_f64(8.0) * T::EPSILON;
        let sigma = (best.iteration.sum_of_squares / spare)
            .square_root()
            .larger(least);
        let change = (sigma - best.residual_sigma).magnitude();
        if best.residual_sigma != self.residual_sigma
            || !(change > T::from_f64(0.01) * self.residual_sigma)
        {
            // Settled; or the last round failed, and the one before it stands.
            return false;
        }
        let (from, start) = (best.iteration.correction, best.start);
        self.restart_balanced(problem, sigma, &from);
        self.phase = Phase::From(start);
        true
    }

    #[inline(never)]
    fn restart_balanced<P: ArmProblem<T>>(&mut self, problem: &P, sigma: T, from: &[T; 8]) {
        self.noise_rounds += 1;
        self.residual_sigma = sigma;
        self.iterations = self.iterations();
        let prior = self.prior();
        self.iteration.restart(problem, &prior, from);
        self.starting_cost = self.iteration.cost;
    }

    /// The correction of the best end point, whatever is to be said of it.
    pub(crate) fn end(&self) -> Option<[T; 8]> {
        self.best.as_ref().map(|best| best.iteration.correction)
    }

    /// The calibrated arm, or why there is none.
    ///
    /// # Errors
    /// Every [`Refusal`] that concerns one arm; [`Refusal::Unfinished`] before the last step.
    #[inline(never)]
    pub fn outcome<P: ArmProblem<T>>(&self, problem: &P) -> Result<ArmOutcome<T>, Refusal> {
        if self.phase != Phase::Done {
            return Err(Refusal::Unfinished);
        }
        let iteration = self
            .best
            .as_ref()
            .map_or(&self.iteration, |best| &best.iteration);
        Judgement {
            arm: self.arm,
            iteration,
            end: self
                .best
                .as_ref()
                .map(|best| (best.termination, best.start)),
            tolerance_weights: &self.tolerance_weights,
            prior: self.prior_at(
                self.best
                    .as_ref()
                    .map_or(self.residual_sigma, |best| best.residual_sigma),
            ),
            has_tolerance: self.settings.tolerance.is_some(),
            iterations: self.iterations(),
        }
        .outcome(problem)
    }
}

/// Whether a calibration with these settings can begin.
pub(super) fn enough_samples<T: Real, P: ArmProblem<T>>(
    problem: &P,
    arm: ArmIndex,
    settings: &Settings<T>,
) -> Result<(), Refusal> {
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
