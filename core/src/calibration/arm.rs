use super::condition::Conditioning;
use super::outcome::{ArmOutcome, StartUsed, Termination};
use super::problem::ArmProblem;
use super::refusal::Refusal;
use super::solver::{Iteration, StepResult};
use super::start::{SAMPLES_FOR_FREE_START, free_start};
use super::{Settings, Start};
use crate::samples::corrected_arm;
use crate::{ArmIndex, Parameter, ParameterKind, Real};
use nalgebra::SVector;

/// Parameters further from nominal than this many tolerances are refused.
const LARGEST_TOLERANCES: f64 = 6.0;
/// A stated noise is contradicted beyond this quantile of the normal distribution: one true
/// calibration in three million.
const LARGEST_DEVIATION: f64 = 5.0;
/// A parameter known no better than this part of the upper arm (or this many radians) is not known.
const LARGEST_SIGMA: f64 = 0.1;
/// Lengths of the displacements tried in search of other solutions, in units of the scale and
/// radians, along the combination of parameters that the samples determine least.
const SEARCH: [f64; 8] = [-0.01, 0.01, -0.03, 0.03, -0.06, 0.06, -0.12, 0.12];
/// Two solutions that a stated noise cannot tell apart differ by less than this in Σ (f/σf)².
const INDISTINGUISHABLE: f64 = 4.0;
/// Rounds of estimating the noise when a tolerance but no noise is stated.
const NOISE_ROUNDS: u8 = 12;

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
/// With [`ArmFactor`](crate::ArmFactor) a step takes the same time whatever the number of samples.
///
/// ```
/// use delta_cal::{ArmFactor, ArmIndex, ArmSolver, Progress, Reference, Settings, SymmetricRobot};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// # let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }.robot()?;
/// # let truth = SymmetricRobot { base_radius: 194.5, platform_radius: 30.0, upper_arm: 260.3, forearm: 479.2 }.robot()?;
/// let centre = robot.forward(&[0.2, 0.2, 0.2])?;
/// let arm = ArmIndex::First;
/// let mut factor = ArmFactor::new(Reference::new(robot.arm(arm), &centre, None));
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

#[derive(Debug, Clone, Copy)]
struct EndPoint<T: Real> {
    iteration: Iteration<T>,
    termination: Termination,
    start: StartUsed,
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
        let needed = match (settings.start, settings.tolerance) {
            (Start::Free, _) => SAMPLES_FOR_FREE_START,
            (Start::Reference, None) => 8,
            (Start::Reference, Some(_)) => 1,
        };
        if problem.samples() < needed {
            return Err(Refusal::TooFewSamples {
                arm,
                samples: problem.samples(),
                needed,
            });
        }
        let reference = problem.reference();
        let (tolerance_weights, residual_sigma) = match (&settings.tolerance, reference.noise()) {
            (None, _) => ([T::ZERO; 8], T::ONE),
            (Some(tolerance), Some(_)) => (tolerance.weights(reference), T::ONE),
            (Some(tolerance), None) => (
                tolerance.weights(reference),
                T::from_f64(0.01) * tolerance.of(Parameter::Lb) / reference.scale(),
            ),
        };
        let (start, correction) = match settings.start {
            Start::Reference => (StartUsed::Reference, [T::ZERO; 8]),
            Start::Free => {
                let correction = free_start(&problem.factor()).ok_or(Refusal::Undetermined {
                    arm,
                    parameter: Parameter::Dx,
                    condition: f32::INFINITY,
                })?;
                (StartUsed::Free, correction)
            }
        };
        let prior = tolerance_weights.map(|weight| weight * residual_sigma);
        let iteration = Iteration::start(problem, settings.method, &prior, correction);
        if !iteration.cost.finite() {
            return Err(Refusal::NonFinite { arm });
        }
        Ok(Self {
            arm,
            settings: *settings,
            tolerance_weights,
            residual_sigma,
            noise_rounds: 0,
            phase: Phase::From(start),
            starting_cost: iteration.cost,
            iteration,
            best: None,
            search: None,
            searched: 0,
            iterations: 0,
        })
    }

    fn prior(&self) -> [T; 8] {
        self.tolerance_weights
            .map(|weight| weight * self.residual_sigma)
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
            && self.iteration.cost <= self.starting_cost
        {
            let end = EndPoint {
                iteration: self.iteration,
                termination,
                start,
            };
            if self
                .best
                .is_none_or(|best| self.improves(problem, &end, &best))
            {
                self.best = Some(end);
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
    fn try_free_start<P: ArmProblem<T>>(&mut self, problem: &P, start: StartUsed) -> bool {
        let spare = problem.effective_samples() - T::from_count(SAMPLES_FOR_FREE_START);
        if spare < T::ZERO || start != StartUsed::Reference {
            return false;
        }
        let factor = problem.factor();
        if let Some(best) = &self.best {
            let least = factor.least_sum_of_squares();
            let variance = if problem.reference().noise().is_some() {
                T::ONE
            } else {
                least / spare.larger(T::ONE)
            };
            let rounding = problem.weight_squared() * (T::from_f64(1e3) * T::EPSILON).squared();
            let excess = best.iteration.sum_of_squares - least;
            if !(excess > T::from_f64(50.0) * variance + rounding) {
                return false;
            }
        }
        let Some(correction) = free_start(&factor) else {
            return false;
        };
        self.iterations = self.iterations();
        self.iteration = Iteration::start(problem, self.settings.method, &self.prior(), correction);
        self.phase = Phase::From(StartUsed::Free);
        true
    }

    /// Whether a further end point is to be preferred: a clearly smaller cost, or, where the
    /// samples cannot tell the two apart, the solution nearer to the reference. Eight samples have
    /// several exact solutions.
    fn improves<P: ArmProblem<T>>(
        &self,
        problem: &P,
        end: &EndPoint<T>,
        best: &EndPoint<T>,
    ) -> bool {
        let rounding = problem.weight_squared() * (T::from_f64(1e3) * T::EPSILON).squared();
        let tie = if problem.reference().noise().is_some() {
            T::from_f64(INDISTINGUISHABLE)
        } else {
            // Of two starts that end in the same point the first is kept.
            T::from_f64(1e-3) * best.iteration.cost
        } + rounding;
        let gained = best.iteration.cost - end.iteration.cost;
        if gained.magnitude() <= tie {
            let distance = |end: &EndPoint<T>| squared_length(&end.iteration.correction);
            distance(end) < T::from_f64(0.999) * distance(best)
        } else {
            gained > T::ZERO
        }
    }

    /// With fewer than twelve samples and no tolerance there may be several solutions, and no
    /// linear fit to tell a false one. Starts again from both sides of the first end point.
    fn search<P: ArmProblem<T>>(&mut self, problem: &P) -> bool {
        if self.settings.tolerance.is_some()
            || problem.effective_samples() >= T::from_count(SAMPLES_FOR_FREE_START)
        {
            return false;
        }
        let (origin, direction) = *self.search.get_or_insert_with(|| {
            let from = self
                .best
                .as_ref()
                .map_or(&self.iteration, |best| &best.iteration);
            (
                from.correction,
                Conditioning::of(&from.normal).weakest_direction(),
            )
        });
        while let Some(distance) = SEARCH.get(self.searched) {
            self.searched += 1;
            let mut correction = origin;
            for (value, part) in correction.iter_mut().zip(direction) {
                *value += part * T::from_f64(*distance);
            }
            self.iterations = self.iterations();
            self.iteration =
                Iteration::start(problem, self.settings.method, &self.prior(), correction);
            if self.iteration.cost.finite() {
                self.phase = Phase::From(StartUsed::Search);
                return true;
            }
        }
        false
    }

    /// A tolerance without a stated noise: estimates the noise from the residuals, so that samples
    /// and tolerance weigh what they are worth (`MacKay`'s evidence iteration, σ² = Σr²/(n − γ) with
    /// γ the number of parameters that the samples determine), and solves again from there.
    fn balance_tolerance<P: ArmProblem<T>>(&mut self, problem: &P) -> bool {
        if self.settings.tolerance.is_none() || problem.reference().noise().is_some() {
            return false;
        }
        let Some(best) = self.best else {
            return false;
        };
        if self.noise_rounds >= NOISE_ROUNDS {
            return false;
        }
        let conditioning = Conditioning::of(&best.iteration.normal);
        let determined = determined_parameters(&self.prior(), &conditioning);
        let spare = problem.effective_samples() - determined;
        if !(spare > T::from_f64(1e-3)) {
            return false;
        }
        let least = T::from_f64(8.0) * T::EPSILON;
        let sigma = (best.iteration.sum_of_squares / spare)
            .square_root()
            .larger(least);
        let change = (sigma - self.residual_sigma).magnitude();
        if !(change > T::from_f64(0.01) * self.residual_sigma) {
            return false;
        }
        self.noise_rounds += 1;
        self.residual_sigma = sigma;
        self.iterations = self.iterations();
        self.iteration = Iteration::start(
            problem,
            self.settings.method,
            &self.prior(),
            best.iteration.correction,
        );
        self.starting_cost = self.iteration.cost;
        self.phase = Phase::From(best.start);
        self.best = None;
        true
    }

    /// The calibrated arm, or why there is none.
    ///
    /// # Errors
    /// Every [`Refusal`] that concerns one arm; [`Refusal::Unfinished`] before the last step.
    pub fn outcome<P: ArmProblem<T>>(&self, problem: &P) -> Result<ArmOutcome<T>, Refusal> {
        let arm = self.arm;
        if self.phase != Phase::Done {
            return Err(Refusal::Unfinished);
        }
        let conditioning = Conditioning::of(
            self.best
                .as_ref()
                .map_or(&self.iteration.normal, |best| &best.iteration.normal),
        );
        let undetermined = |condition: T| Refusal::Undetermined {
            arm,
            parameter: weakest_parameter(&conditioning),
            condition: to_single(condition),
        };
        // Beyond this no digit of the weakest combination survives the arithmetic.
        let largest_condition = T::ONE / (T::from_f64(64.0) * T::EPSILON);
        if !(conditioning.condition < largest_condition) {
            return Err(undetermined(conditioning.condition));
        }
        let Some(best) = &self.best else {
            return Err(Refusal::NotConverged {
                arm,
                iterations: self.iterations(),
            });
        };
        let reference = problem.reference();
        let prior = self.prior();
        let samples = problem.effective_samples();
        let degrees_of_freedom =
            (samples - determined_parameters(&prior, &conditioning)).larger(T::ZERO);

        if reference.noise().is_some() {
            self.check_residual(best, samples)?;
        }
        if self.settings.tolerance.is_some() {
            let (parameter, tolerances) = self.farthest(best);
            if !(tolerances <= T::from_f64(LARGEST_TOLERANCES)) {
                return Err(far_from_nominal(arm, parameter, tolerances));
            }
        }

        let sum = best.iteration.sum_of_squares;
        let residual_rms = (sum / samples).square_root();
        let stated = reference.noise().is_some();
        let estimated_noise = (!stated && degrees_of_freedom >= T::HALF)
            .then(|| (sum / degrees_of_freedom).square_root());
        let variance = if stated {
            Some(T::ONE)
        } else if self.settings.tolerance.is_some() {
            Some(self.residual_sigma.squared())
        } else {
            estimated_noise.map(Real::squared)
        };
        let units = Parameter::ALL.map(|parameter| reference.unit_of(parameter));
        let covariance = variance.map(|variance| {
            let mut scaled = conditioning.covariance * variance;
            for (mut column, column_unit) in scaled.column_iter_mut().zip(units) {
                for (entry, row_unit) in column.iter_mut().zip(units) {
                    *entry = *entry * column_unit * row_unit;
                }
            }
            scaled
        });
        let calibrated = corrected_arm(reference, &best.iteration.correction)
            .map_err(|error| Refusal::ImpossibleGeometry { arm, error })?;
        let mut prior_share = SVector::<T, 8>::zeros();
        for ((share, weight), variance) in prior_share
            .iter_mut()
            .zip(prior)
            .zip(conditioning.covariance.diagonal().iter())
        {
            *share = weight.squared() * *variance;
        }
        let outcome = ArmOutcome {
            arm: calibrated,
            covariance,
            residual_rms: if stated {
                residual_rms
            } else {
                residual_rms * reference.scale()
            },
            estimated_noise: estimated_noise.map(|noise| noise * reference.scale()),
            degrees_of_freedom,
            samples: problem.samples(),
            iterations: self.iterations(),
            termination: best.termination,
            start: best.start,
            condition: conditioning.condition,
            prior_share,
        };
        for parameter in Parameter::ALL {
            let unit = match parameter.kind() {
                ParameterKind::Length => reference.arm().upper_arm_length(),
                ParameterKind::Angle => T::ONE,
            };
            if let Some(sigma) = outcome.standard_deviation(parameter)
                && !(sigma <= T::from_f64(LARGEST_SIGMA) * unit)
            {
                return Err(Refusal::Undetermined {
                    arm,
                    parameter,
                    condition: to_single(conditioning.condition),
                });
            }
        }
        Ok(outcome)
    }

    /// χ² test of the whole cost: with a prior it has as many degrees of freedom as there are
    /// samples, without one eight fewer.
    fn check_residual(&self, best: &EndPoint<T>, samples: T) -> Result<(), Refusal> {
        let freedom = if self.settings.tolerance.is_some() {
            samples
        } else {
            samples - T::from_f64(8.0)
        }
        .larger(T::ONE);
        if best.iteration.cost <= chi_square_quantile(freedom) {
            return Ok(());
        }
        let from_prior = best.iteration.cost - best.iteration.sum_of_squares;
        if from_prior > best.iteration.sum_of_squares {
            let (parameter, tolerances) = self.farthest(best);
            return Err(far_from_nominal(self.arm, parameter, tolerances));
        }
        Err(Refusal::ResidualContradictsNoise {
            arm: self.arm,
            ratio: to_single((best.iteration.sum_of_squares / freedom).square_root()),
        })
    }

    /// The parameter furthest from nominal, in tolerances.
    fn farthest(&self, best: &EndPoint<T>) -> (Parameter, T) {
        let mut farthest = (Parameter::Dx, T::ZERO);
        for ((weight, delta), parameter) in self
            .tolerance_weights
            .into_iter()
            .zip(best.iteration.correction)
            .zip(Parameter::ALL)
        {
            let tolerances = (weight * delta).magnitude();
            if tolerances > farthest.1 {
                farthest = (parameter, tolerances);
            }
        }
        farthest
    }
}

fn far_from_nominal<T: Real>(arm: ArmIndex, parameter: Parameter, tolerances: T) -> Refusal {
    Refusal::FarFromNominal {
        arm,
        parameter,
        tolerances: to_single(tolerances),
    }
}

/// A figure for a message.
fn to_single<T: Real>(value: T) -> f32 {
    <f32 as Real>::from_f64(value.to_f64())
}

fn weakest_parameter<T: Real>(conditioning: &Conditioning<T>) -> Parameter {
    Parameter::ALL
        .get(conditioning.weakest)
        .copied()
        .unwrap_or(Parameter::Dx)
}

/// γ = 8 − Σ priorⱼ² Cⱼⱼ: how many parameters the samples determine and not the prior.
fn determined_parameters<T: Real>(prior: &[T; 8], conditioning: &Conditioning<T>) -> T {
    let mut determined = T::from_f64(8.0);
    for (weight, variance) in prior.iter().zip(conditioning.covariance.diagonal().iter()) {
        determined -= weight.squared() * *variance;
    }
    determined
}

fn squared_length<T: Real>(values: &[T; 8]) -> T {
    values
        .iter()
        .fold(T::ZERO, |sum, value| sum + value.squared())
}

/// The quantile of χ² with ν degrees of freedom at [`LARGEST_DEVIATION`], by Wilson and Hilferty:
/// ν (1 − 2/(9ν) + z √(2/(9ν)))³.
fn chi_square_quantile<T: Real>(freedom: T) -> T {
    let spread = T::from_f64(2.0 / 9.0) / freedom;
    let root = T::ONE - spread + T::from_f64(LARGEST_DEVIATION) * spread.square_root();
    freedom * root * root * root
}
