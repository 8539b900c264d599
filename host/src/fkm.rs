//! The FKM calibration: all 24 parameters at once from the distances between measured and computed
//! positions.
//!
//! ```text
//! minimise  Σ |Lₖ⁻¹ (Xₖ − FK(P; qₖ))|²  +  Σ ((pⱼ − pⱼ,nominal)/toleranceⱼ)²
//! Lₖ Lₖᵀ = σx² I + σq² J_q J_qᵀ
//! ```
//!
//! Forward kinematics may not exist at a trial step: such a step is rejected and a shorter one tried.

mod judgement;
mod linearization;
mod normal;
mod problem;
mod solver;

pub use crate::Outcome;
pub use linearization::Linearization;

use delta_cal::limits::{INDISTINGUISHABLE, SAMPLES_FOR_FREE_START, samples_needed};
use delta_cal::{
    ArmIndex, Calibrator, Noise, Parameter, Refusal, Robot, RobotOutcome, Sample, Settings, Start,
    StartUsed, Termination, Tolerance,
};
use judgement::{Conditioning, Judgement};
use nalgebra::SMatrix;
use normal::Vector24;
use problem::Problem;
use solver::{Point, Run, Solver};

/// Rounds of estimating the noise when a tolerance but no noise is stated.
const NOISE_ROUNDS: usize = 20;

/// Calibrates a robot, which is the nominal of the tolerance and the start of the iteration.
///
/// The IKM method's solution is a second start, taken if the first leads nowhere or to a worse fit;
/// with fewer than twelve samples, which may have several solutions, also if it leads to one that is
/// nearer to the robot.
///
/// # Errors
/// Every [`Refusal`] that the IKM method has. A refusal that concerns the whole robot names the arm
/// that has the largest part in it.
///
/// ```
/// use delta_cal::{Sample, Settings, SymmetricRobot};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let truth = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..nominal }.robot()?;
/// let mut samples = Vec::new();
/// for k in 0..20 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     samples.push(Sample { joints, position: truth.forward(&joints)? });
/// }
/// let outcome = delta_cal_host::fkm::calibrate(&nominal.robot()?, &samples, &Settings::default())?;
/// assert!((outcome.robot.robot.arms()[2].lb() - 479.1).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
pub fn calibrate(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
) -> Result<Outcome, Refusal> {
    let (count, needed) = (samples.len() as u64, samples_needed(settings));
    if count < needed {
        return Err(Refusal::TooFewSamples {
            arm: ArmIndex::First,
            samples: count,
            needed,
        });
    }
    let ikm = ikm_solution(robot, samples, settings);
    if let Err(refusal @ (Refusal::WrongSide | Refusal::NonFinite { .. })) = ikm {
        return Err(refusal);
    }
    let weights = match (settings.start, &ikm) {
        (Start::Reference, _) => *robot,
        (Start::Free, Ok(solution)) => solution.robot,
        (Start::Free, Err(refusal)) => return Err(*refusal),
    };
    let problem = Problem::new(
        robot,
        &weights,
        samples,
        settings.noise.as_ref(),
        settings.tolerance.as_ref(),
    );
    let mut search = Search::new(&problem, settings);
    if settings.start == Start::Reference {
        search.start(&Vector24::zeros(), StartUsed::Reference);
    }
    if let Ok(solution) = &ikm {
        search.second_start(solution);
    }
    search.balance_tolerance();
    search.outcome(ikm.err())
}

/// The inverse of the information that samples of a robot hold of its parameters: mm², angles times
/// the upper arm's length. `None` if they do not determine it.
pub(crate) fn covariance_at(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    noise: &Noise<f64>,
    tolerance: Option<&Tolerance<f64>>,
) -> Option<SMatrix<f64, 24, 24>> {
    let problem = Problem::new(robot, robot, samples, Some(noise), tolerance);
    problem
        .linearize(&Vector24::zeros(), &problem.tolerance_weights)?
        .covariance()
}

fn ikm_solution(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
) -> Result<RobotOutcome<f64>, Refusal> {
    let mut calibrator = Calibrator::new(robot, settings);
    let overflow = |_| Refusal::NonFinite {
        arm: ArmIndex::First,
    };
    calibrator.add_many(samples).map_err(overflow)?;
    calibrator.solve()
}

/// The best end point so far and how it was reached.
struct Search<'a> {
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
    fn new(problem: &'a Problem<'a>, settings: &'a Settings<f64>) -> Self {
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

    fn solver(&self) -> Solver<'a> {
        Solver {
            problem: self.problem,
            method: self.settings.method,
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
        } = self.solver().run(from)?;
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

    fn start(&mut self, from: &Vector24, start: StartUsed) {
        self.best = self.run(from, start);
    }

    /// From the solution of another method, if that may lead to a better end.
    fn second_start(&mut self, solution: &RobotOutcome<f64>) {
        let from = self.problem.correction_to(&solution.robot);
        let several = (self.problem.samples.len() as u64) < SAMPLES_FOR_FREE_START;
        let worse = |best: &End| {
            let (solver, cost) = (self.solver(), best.point.cost);
            solver.cost(&from) >= cost - solver.blur(cost)
        };
        if !several && self.best.as_ref().is_some_and(worse) {
            return;
        }
        let used = match self.settings.start {
            Start::Free => StartUsed::Free,
            Start::Reference => StartUsed::Ikm,
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

    /// Whether an end point is to be preferred: a clearly smaller cost, or, where the samples cannot
    /// tell the two apart, the solution nearer to the reference.
    fn improves(&self, end: &End, best: &End) -> bool {
        let (end, best) = (&end.point, &best.point);
        let several = (self.problem.samples.len() as u64) < SAMPLES_FOR_FREE_START;
        let rounding = self.solver().blur(best.cost);
        let tie = rounding
            + if several && self.settings.noise.is_some() && self.settings.tolerance.is_none() {
                INDISTINGUISHABLE
            } else {
                // Of two starts that end in the same point the first is kept.
                1e-3 * best.cost
            };
        let gained = best.cost - end.cost;
        let apart = end.correction - best.correction;
        let same_place = best.normal.length_squared(&apart) <= 16.0 * tie;
        if gained.abs() <= tie {
            let nearer = end.correction.norm_squared() < 0.999 * best.correction.norm_squared();
            nearer && !same_place
        } else {
            gained > 0.0
        }
    }

    /// A tolerance without a stated noise: estimates the noise from the residuals, so that samples
    /// and tolerance weigh what they are worth (MacKay's evidence iteration, σ² = Σr²/(3n − γ) with γ
    /// the number of parameters that the samples determine), and solves again from there.
    fn balance_tolerance(&mut self) {
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
                self.start(&Vector24::zeros(), StartUsed::Reference);
                continue;
            };
            let determined = Conditioning::of(&best.point.normal).determined(&self.prior());
            let spare = 3.0 * count(self.problem.samples.len()) - determined;
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
    fn outcome(&self, ikm: Option<Refusal>) -> Result<Outcome, Refusal> {
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

#[allow(clippy::cast_precision_loss)]
fn count(number: usize) -> f64 {
    number as f64
}
