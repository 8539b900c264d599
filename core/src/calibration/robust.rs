//! The robust fit: an M-estimate by iteratively reweighted least squares.
//!
//! ```text
//! minimise  Σ ρ(rₖ/s),   rₖ = f(P; Xₖ, qₖ)/σf,ₖ
//! s = max over the arms of  median |r| / 0.6745 · √(n/(n − 8))
//! ```
//!
//! The scale s is the largest of the three arms', and the stated noise keeps it at 1 or above: with few
//! samples an arm's median may be far too small by chance, and would then shrink with every good sample
//! that it makes the fit leave out. One tracker measured for all three. A round weighs every sample with
//! ψ(r/s)/(r/s), fits, and takes the new residuals (Holland and Welsch 1977). The first residuals are
//! those of the least trimmed squares' fit: Tukey's loss has many minima, and the wrong samples must not
//! choose among them (Yohai's MM-estimate, 1987).
//!
//! Which arms a wrong sample spoils is not known: a wrong position spoils all three, a wrong joint
//! angle one. An arm weighs a sample by its own residual, and a sample that one arm rejects altogether
//! counts in none. Of good samples three in a million are rejected, so this sharing costs nothing.

mod median;
mod start;
mod weighted;

pub use weighted::WeighedSample;

use super::Settings;
use super::arm::{ArmSolver, Progress};
use super::loss::{Loss, SUSPECTED};
use super::outcome::RobotOutcome;
use super::refusal::Refusal;
use super::robot::{RobotCalibrator, StoredCalibrator, references};
use crate::samples::{Displacement, Reference, Sample, SampleError};
use crate::{ArmIndex, Real, Robot};
use core::fmt;
use median::median;
use start::{Corrections, least_trimmed};
use weighted::WeightedArm;

/// A robust fit needs twice as many samples as an arm has parameters: half of them must determine it.
pub const SAMPLES_FOR_ROBUST_FIT: usize = 16;
/// Beyond this part of suspected samples it is not known which are the wrong ones.
pub const LARGEST_SUSPECTED: f64 = 0.4;
/// The median of |r| of a normal r with σ = 1.
const MEDIAN: f64 = 0.6745;
/// Rounds of reweighting at most; after half of them the scales stay, and what is rejected. Most fits
/// take 25 to 30.
const ROUNDS: u16 = 80;
/// The first round's scales are so many times as large, and each round's so much smaller than the one
/// before, down to what they are: the least trimmed squares' fit knows its own samples too well, and
/// with few of them good ones lie many scales off it. They come back as long as the scales are wide
/// (graduated non-convexity, Blake and Zisserman 1987).
const WIDENED: f64 = 20.0;
const NARROWED: f64 = 0.7;
/// Linearisations of a fit at the start.
const START_ITERATIONS: u16 = 15;
/// The scale of exact samples, in ε: what rounding leaves.
const ROUNDING: f64 = 32.0;

/// A robot calibrated by a robust fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustOutcome<T: Real> {
    /// As of the plain fit, with the samples' weights: their number is that of the samples with a
    /// weight above 0, and the covariance is the M-estimate's, mean ψ² / (mean ψ′)² · (JᵀJ)⁻¹, with the
    /// noise as stated or as estimated from the weighted residuals (see [`Worth`](crate::Worth)).
    pub robot: RobotOutcome<T>,
    /// How many samples are [suspected](WeighedSample::suspected).
    pub suspected: usize,
    /// Rounds of reweighting.
    pub rounds: u16,
    /// Whether the weights settled before the last round.
    pub settled: bool,
}

/// Why there is no robust fit.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RobustRefusal {
    /// Half of the samples must determine an arm.
    TooFewSamples {
        /// How many there are.
        samples: usize,
        /// How many are needed.
        needed: usize,
    },
    /// So many samples disagree with the others that it is not known which are right.
    TooManySuspected {
        /// How many disagree.
        suspected: usize,
        /// How many there are.
        samples: usize,
    },
    /// The work space has fewer places than there are samples.
    NoRoom {
        /// How many places are needed.
        samples: usize,
    },
    /// A faulty sample and its position in the sequence.
    Sample(usize, SampleError),
    /// What is left of the samples does not calibrate the robot.
    Fit(Refusal),
}

impl fmt::Display for RobustRefusal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewSamples { samples, needed } => {
                write!(
                    formatter,
                    "{samples} samples are too few for a robust fit: it needs {needed}"
                )
            }
            Self::TooManySuspected { suspected, samples } => write!(
                formatter,
                "{suspected} of {samples} samples disagree with the others"
            ),
            Self::NoRoom { samples } => {
                write!(
                    formatter,
                    "the work space has no room for {samples} samples"
                )
            }
            Self::Sample(index, error) => write!(formatter, "sample {index}: {error}"),
            Self::Fit(refusal) => refusal.fmt(formatter),
        }
    }
}

impl core::error::Error for RobustRefusal {}

impl From<Refusal> for RobustRefusal {
    fn from(refusal: Refusal) -> Self {
        Self::Fit(refusal)
    }
}

/// Calibrates a robot from samples of which some may be wrong. `work` has room for as many; its first
/// places hold afterwards what became of each sample, in their order.
///
/// # Errors
/// Too few samples, too many that disagree, or a [`Refusal`] of what is left.
///
/// ```
/// use delta_cal::{Loss, Sample, Settings, SymmetricRobot, WeighedSample, robust_fit};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let truth = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..nominal }.robot()?;
/// let mut samples = [Sample { joints: [0.0; 3], position: Default::default() }; 30];
/// for (k, sample) in (0..).zip(&mut samples) {
///     let t = f64::from(k);
///     sample.joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     sample.position = truth.forward(&sample.joints)?;
/// }
/// // The reflector slipped.
/// samples[7].position.x += 12.0;
///
/// let mut work = [WeighedSample::vacant(); 30];
/// let outcome = robust_fit(&nominal.robot()?, &Settings::default(), &samples, Loss::Tukey, &mut work)?;
/// assert!((outcome.robot.robot.arms()[2].lb() - 479.1).abs() < 1e-6);
/// assert!(outcome.suspected == 1 && work[7].suspected());
/// # Ok(())
/// # }
/// ```
pub fn robust_fit<T: Real>(
    robot: &Robot<T>,
    settings: &Settings<T>,
    samples: &[Sample<T>],
    loss: Loss,
    work: &mut [WeighedSample<T>],
) -> Result<RobustOutcome<T>, RobustRefusal> {
    let references = references(robot, settings);
    let work = places(work, samples.len())?;
    for (index, (place, sample)) in work.iter_mut().zip(samples).enumerate() {
        *place = WeighedSample::vacant();
        for ((weighed, reference), (q, arm)) in place
            .arms
            .iter_mut()
            .zip(&references)
            .zip(sample.joints.into_iter().zip(ArmIndex::ALL))
        {
            weighed.sample = reference
                .sample(&sample.position, q, arm)
                .map_err(|error| RobustRefusal::Sample(index, error))?;
        }
    }
    let [first, second, third] = &references;
    fit(settings, [first, second, third], loss, work)
}

impl<T: Real, const N: usize> StoredCalibrator<T, N> {
    /// As [`robust_fit`], of the stored samples. Only this form can: the constant-memory one has
    /// no sample left to weigh again.
    ///
    /// # Errors
    /// As [`robust_fit`].
    pub fn solve_robust(
        &self,
        loss: Loss,
        work: &mut [WeighedSample<T>],
    ) -> Result<RobustOutcome<T>, RobustRefusal> {
        let [first, second, third] = self.arms();
        let work = places(work, first.len())?;
        let stored = first
            .samples()
            .iter()
            .zip(second.samples())
            .zip(third.samples());
        for (place, ((one, two), three)) in work.iter_mut().zip(stored) {
            *place = WeighedSample::new([*one, *two, *three]);
        }
        let references = [first.reference(), second.reference(), third.reference()];
        fit(self.settings(), references, loss, work)
    }
}

fn places<T: Real>(
    work: &mut [WeighedSample<T>],
    samples: usize,
) -> Result<&mut [WeighedSample<T>], RobustRefusal> {
    if samples < SAMPLES_FOR_ROBUST_FIT {
        return Err(RobustRefusal::TooFewSamples {
            samples,
            needed: SAMPLES_FOR_ROBUST_FIT,
        });
    }
    work.get_mut(..samples)
        .ok_or(RobustRefusal::NoRoom { samples })
}

/// What the three arms are fitted with.
struct Arms<'a, T: Real> {
    settings: &'a Settings<T>,
    references: [&'a Reference<T>; 3],
}

fn fit<T: Real>(
    settings: &Settings<T>,
    references: [&Reference<T>; 3],
    loss: Loss,
    samples: &mut [WeighedSample<T>],
) -> Result<RobustOutcome<T>, RobustRefusal> {
    let arms = Arms {
        settings,
        references,
    };
    let mut effective = [T::from_count(samples.len() as u64); 3];
    let (mut rounds, mut settled) = (0, false);
    if let Some(corrections) = least_trimmed(&arms, samples) {
        arms.residuals(&corrections, samples);
        let mut scales = [T::ZERO; 3];
        let mut width = T::from_f64(WIDENED);
        while rounds < ROUNDS && !settled {
            let late = rounds >= ROUNDS / 2;
            if !late {
                scales = arms.scales(samples).map(|scale| scale * width);
            }
            let change = weigh(loss, &scales, late, samples);
            settled = width <= T::ONE && change <= T::EPSILON.square_root();
            rounds += 1;
            width = T::ONE.larger(width * T::from_f64(NARROWED));
            for (effective, arm) in effective.iter_mut().zip(ArmIndex::ALL) {
                *effective = normalise(loss, &scales, arm, samples);
            }
            let Some(corrections) = arms.fits(samples, &effective) else {
                break;
            };
            arms.residuals(&corrections, samples);
        }
    }
    let suspected = samples.iter().filter(|sample| sample.suspected).count();
    if T::from_count(suspected as u64)
        > T::from_f64(LARGEST_SUSPECTED) * T::from_count(samples.len() as u64)
    {
        return Err(RobustRefusal::TooManySuspected {
            suspected,
            samples: samples.len(),
        });
    }
    let problems = ArmIndex::ALL.map(|arm| arms.problem(arm, samples, &effective));
    let robot = RobotCalibrator::of_arms(settings, problems).solve()?;
    if settings.noise.is_none() {
        in_sigmas(&robot, references, samples);
    }
    Ok(RobustOutcome {
        robot,
        suspected,
        rounds,
        settled,
    })
}

impl<'a, T: Real> Arms<'a, T> {
    fn reference(&self, arm: ArmIndex) -> &'a Reference<T> {
        let [first, second, third] = self.references;
        match arm {
            ArmIndex::First => first,
            ArmIndex::Second => second,
            ArmIndex::Third => third,
        }
    }

    fn problem<'b>(
        &self,
        arm: ArmIndex,
        samples: &'b [WeighedSample<T>],
        effective: &[T; 3],
    ) -> WeightedArm<'b, T>
    where
        'a: 'b,
    {
        WeightedArm {
            reference: self.reference(arm),
            samples,
            arm,
            effective_samples: effective.get(arm.index()).copied().unwrap_or(T::ZERO),
        }
    }

    /// The three arms' fits as the samples are weighed; `None` if one does not settle. What is judged
    /// is the last fit alone.
    fn fits_with(
        &self,
        settings: &Settings<T>,
        samples: &[WeighedSample<T>],
        effective: &[T; 3],
    ) -> Option<Corrections<T>> {
        let mut corrections = [[T::ZERO; 8]; 3];
        for (correction, arm) in corrections.iter_mut().zip(ArmIndex::ALL) {
            let problem = self.problem(arm, samples, effective);
            let mut solver = ArmSolver::new(&problem, arm, settings).ok()?;
            while solver.step(&problem) == Progress::Working {}
            *correction = solver.end()?;
        }
        Some(corrections)
    }

    fn fits(&self, samples: &[WeighedSample<T>], effective: &[T; 3]) -> Option<Corrections<T>> {
        self.fits_with(self.settings, samples, effective)
    }

    fn start_fits(&self, samples: &[WeighedSample<T>], count: T) -> Option<Corrections<T>> {
        let settings = Settings {
            iteration_limit: self.settings.iteration_limit.min(START_ITERATIONS),
            ..*self.settings
        };
        self.fits_with(&settings, samples, &[count; 3])
    }

    /// Every sample's residuals at a correction of each arm.
    fn residuals(&self, corrections: &Corrections<T>, samples: &mut [WeighedSample<T>]) {
        for sample in samples.iter_mut() {
            sample.distance = T::ZERO;
        }
        for (correction, arm) in corrections.iter().zip(ArmIndex::ALL) {
            let reference = self.reference(arm);
            let at = Displacement::new(reference, correction);
            let unit = residual_unit(reference);
            for sample in samples.iter_mut() {
                let own = sample.of_mut(arm);
                own.residual = at.weighted_constraint(&own.sample);
                let residual = own.residual * unit;
                sample.distance += residual.squared();
            }
        }
    }

    /// The largest of the arms' scales, in the unit of each arm's residuals.
    fn scales(&self, samples: &[WeighedSample<T>]) -> [T; 3] {
        let count = T::from_count(samples.len() as u64);
        let fitted = (count / (count - T::from_f64(8.0))).square_root() / T::from_f64(MEDIAN);
        let mut largest = T::ZERO;
        for arm in ArmIndex::ALL {
            let sizes = samples
                .iter()
                .map(move |sample| sample.of(arm).residual.magnitude());
            largest = largest.larger(median(sizes) * residual_unit(self.reference(arm)));
        }
        ArmIndex::ALL.map(|arm| {
            let reference = self.reference(arm);
            let least = match reference.noise() {
                Some(_) => T::ONE,
                None => T::from_f64(ROUNDING) * T::EPSILON,
            };
            least.larger(largest / residual_unit(reference) * fitted)
        })
    }
}

/// Length of a residual's unit without a stated noise; with one it is in σ.
fn residual_unit<T: Real>(reference: &Reference<T>) -> T {
    match reference.noise() {
        Some(_) => T::ONE,
        None => reference.scale(),
    }
}

/// Weighs every sample by its residuals; returns the largest change of a weight. Late in the rounds
/// what was suspected stays so, for the rounds to come to an end.
fn weigh<T: Real>(loss: Loss, scales: &[T; 3], late: bool, samples: &mut [WeighedSample<T>]) -> T {
    let mut largest = T::ZERO;
    for sample in samples {
        let mut suspected = late && sample.suspected;
        for (own, scale) in sample.arms.iter().zip(scales) {
            suspected |= !(own.residual.magnitude() < T::from_f64(SUSPECTED) * *scale);
        }
        sample.suspected = suspected;
        for (own, scale) in sample.arms.iter_mut().zip(scales) {
            let weight = if suspected {
                T::ZERO
            } else {
                loss.weight(own.residual / *scale)
            };
            largest = largest.larger((weight - own.weight).magnitude());
            own.weight = weight;
        }
    }
    largest
}

/// Brings an arm's weights to what they are worth; returns the number of samples that they are.
fn normalise<T: Real>(
    loss: Loss,
    scales: &[T; 3],
    arm: ArmIndex,
    samples: &mut [WeighedSample<T>],
) -> T {
    let scale = scales.get(arm.index()).copied().unwrap_or(T::ONE);
    let counted = samples.iter().map(|sample| sample.of(arm));
    let sizes = counted
        .filter(|own| own.weight > T::ZERO)
        .map(|own| own.residual.magnitude() / scale);
    let worth = loss.worth(sizes, T::ONE, T::ONE);
    for sample in samples.iter_mut() {
        let own = sample.of_mut(arm);
        own.root = (own.weight / worth.divisor).square_root();
    }
    worth.samples
}

/// Residuals in σ, of the noise that each arm's residuals have.
fn in_sigmas<T: Real>(
    robot: &RobotOutcome<T>,
    references: [&Reference<T>; 3],
    samples: &mut [WeighedSample<T>],
) {
    for ((outcome, reference), arm) in robot.arms.iter().zip(references).zip(ArmIndex::ALL) {
        let sigma = outcome.estimated_noise.unwrap_or(T::ONE);
        let factor = reference.scale() / sigma;
        for sample in samples.iter_mut() {
            let own = sample.of_mut(arm);
            own.residual *= factor;
        }
    }
}
