//! From which starts the iteration is run, and which of its ends is the result.

use super::judgement::{Identifiability, Judgement};
use super::normal::Vector24;
use super::problem::Problem;
use super::solver::{Minimiser, Point, Run};
use crate::fit::outcome::Outcome;
use delta_cal::calibration::limits::{
    INDISTINGUISHABLE, NEARER, SAME_POINT, SAMPLES_FOR_FREE_START, TIE,
};
use delta_cal::calibration::{Start, StartUsed, Termination};
use delta_cal::{ArmIndex, Parameter, Refusal, RobotOutcome, Settings};

/// Rounds of estimating the noise when a tolerance but no noise is stated.
const NOISE_ROUNDS: usize = 20;

/// The best end point so far and how it was reached.
pub(super) struct Search<'a> {
    problem: &'a Problem<'a>,
    settings: &'a Settings<f64>,
    /// One σ of the weighted residual: 1 with a stated noise, otherwise the estimate that the
    /// tolerance is balanced against.
    residual_sigma: f64,
    best: Option<End>,
    /// An end point that did not settle, for the refusal.
    unsettled: Option<Point>,
    iterations: u16,
}

struct End {
    point: Point,
    termination: Termination,
    start: StartUsed,
}

impl<'a> Search<'a> {
    pub(super) fn new(problem: &'a Problem<'a>, settings: &'a Settings<f64>) -> Self {
        let residual_sigma = match (&settings.tolerance, &settings.noise) {
            (Some(tolerance), None) => 0.01 * tolerance.of(Parameter::Lb),
            _ => 1.0,
        };
        Self {
            problem,
            settings,
            residual_sigma,
            best: None,
            unsettled: None,
            iterations: 0,
        }
    }

    fn prior(&self) -> Vector24 {
        self.problem.tolerance_weights * self.residual_sigma
    }

    fn minimiser(&self) -> Minimiser<'a> {
        Minimiser {
            problem: self.problem,
            solver: self.settings.solver,
            iteration_limit: self.settings.iteration_limit,
            prior: self.prior(),
        }
    }

    /// Iterates from a correction; an end point if it settles.
    fn run(&mut self, from: &Vector24, start: StartUsed) -> Option<End> {
        let Run {
            point,
            termination,
            iterations,
        } = self.minimiser().run(from)?;
        self.iterations = self.iterations.saturating_add(iterations);
        let Some(termination) = termination else {
            self.unsettled = Some(point);
            return None;
        };
        Some(End {
            point,
            termination,
            start,
        })
    }

    pub(super) fn start(&mut self, from: &Vector24, start: StartUsed) {
        self.best = self.run(from, start);
    }

    /// From the solution of another method, if that may lead to a better end.
    pub(super) fn second_start(&mut self, solution: &RobotOutcome<f64>) {
        let from = self.problem.correction_to(&solution.robot);
        let several = (self.problem.samples.len() as u64) < SAMPLES_FOR_FREE_START;
        let worse = |best: &End| {
            let (solver, cost) = (self.minimiser(), best.point.cost);
            solver.cost(&from) >= cost - solver.blur(cost)
        };
        if !several && self.best.as_ref().is_some_and(worse) {
            return;
        }
        let used = match self.settings.start {
            Start::Free => StartUsed::Free,
            Start::Nominal => StartUsed::Ikm,
        };
        let Some(end) = self.run(&from, used) else {
            return;
        };
        if self
            .best
            .as_ref()
            .is_none_or(|best| self.improves(&end, best))
        {
            self.best = Some(end);
        }
    }

    /// The correction of the best end point, whatever is to be said of it.
    pub(super) fn end(&self) -> Option<Vector24> {
        self.best.as_ref().map(|best| best.point.correction)
    }

    /// Whether an end point is to be preferred: a clearly smaller cost, or, where the samples cannot
    /// tell the two apart, the solution nearer to the reference.
    fn improves(&self, end: &End, best: &End) -> bool {
        let (end, best) = (&end.point, &best.point);
        let several = (self.problem.samples.len() as u64) < SAMPLES_FOR_FREE_START;
        let rounding = self.minimiser().blur(best.cost);
        let tie = rounding
            + if several && self.settings.noise.is_some() && self.settings.tolerance.is_none() {
                INDISTINGUISHABLE
            } else {
                // Of two starts that end in the same point the first is kept.
                TIE * best.cost
            };
        let gained = best.cost - end.cost;
        let apart = end.correction - best.correction;
        let same_place = best.normal.length_squared(&apart) <= SAME_POINT * tie;
        if gained.abs() <= tie {
            let nearer = end.correction.norm_squared() < NEARER * best.correction.norm_squared();
            nearer && !same_place
        } else {
            gained > 0.0
        }
    }

    /// A tolerance without a stated noise: estimates the noise from the residuals, so that samples
    /// and tolerance weigh what they are worth (MacKay's evidence iteration, σ² = Σr²/(3n − γ) with γ
    /// the number of parameters that the samples determine), and solves again from there.
    pub(super) fn balance_tolerance(&mut self) {
        if self.settings.tolerance.is_none() || self.settings.noise.is_some() {
            return;
        }
        let [arm, ..] = self.problem.reference.arms();
        let least = 8.0 * f64::EPSILON * arm.lb();
        for _ in 0..NOISE_ROUNDS {
            let Some(best) = &self.best else {
                // Too weak a tolerance leaves the problem without a firm minimum: start from a
                // stronger.
                self.residual_sigma *= 10.0;
                self.start(&Vector24::zeros(), StartUsed::Nominal);
                continue;
            };
            let determined = Identifiability::of(&best.point.normal).determined(&self.prior());
            let spare = 3.0 * self.problem.effective_samples - determined;
            if !(spare > 1e-3) {
                return;
            }
            let sigma = (best.point.sum_of_squares / spare).sqrt().max(least);
            if !((sigma - self.residual_sigma).abs() > 0.01 * self.residual_sigma) {
                return;
            }
            let (from, start) = (best.point.correction, best.start);
            let previous = std::mem::replace(&mut self.residual_sigma, sigma);
            let Some(end) = self.run(&from, start) else {
                self.residual_sigma = previous;
                return;
            };
            self.best = Some(end);
        }
    }

    /// The calibrated robot, or why there is none: the IKM method may know better.
    pub(super) fn outcome(&self, ikm: Option<Refusal>) -> Result<Outcome, Refusal> {
        let judge = |point| Judgement {
            problem: self.problem,
            settings: self.settings,
            point,
            prior: self.prior(),
            iterations: self.iterations,
        };
        match (&self.best, ikm, &self.unsettled) {
            (Some(end), ..) => judge(&end.point).outcome(end.termination, end.start),
            (None, Some(refusal), _) => Err(refusal),
            (None, None, Some(point)) => Err(judge(point).not_converged()),
            (None, None, None) => Err(Refusal::NotConverged {
                arm: ArmIndex::First,
                iterations: self.iterations,
            }),
        }
    }
}
