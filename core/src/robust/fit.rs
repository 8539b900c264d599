use super::arms::Arms;
use super::loss::Loss;
use super::outcome::{RobustOutcome, RobustRefusal};
use super::start::least_trimmed;
use super::weighted::WeighedSample;
use crate::Real;
use crate::calibration::limits::{LARGEST_SUSPECTED, SAMPLES_FOR_ROBUST_FIT, SUSPECTED};
use crate::calibration::{RobotCalibrator, RobotOutcome, Settings, nominal_arms};
use crate::robot::{ArmIndex, Robot};
use crate::samples::{NominalArm, Sample};

/// Rounds of reweighting at most; after half of them the scales stay, and what is rejected. Most fits
/// take 25 to 30.
const ROUNDS: u16 = 80;
/// The first round's scales are so many times as large, and each round's so much smaller than the one
/// before, down to what they are: the least trimmed squares' fit knows its own samples too well, and
/// with few of them good ones lie many scales off it. They come back as long as the scales are wide
/// (graduated non-convexity, Blake and Zisserman 1987).
const WIDENED: f64 = 20.0;
const NARROWED: f64 = 0.7;

/// Calibrates a robot from samples of which some may be wrong. `work` has room for as many; its first
/// places hold afterwards what became of each sample, in their order.
///
/// # Errors
/// Too few samples, too many that disagree, or a [`Refusal`](crate::Refusal) of what is left.
///
/// ```
/// use delta_cal::{Sample, Settings, SymmetricRobot};
/// use delta_cal::robust::{Loss, WeighedSample, robust_fit};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let truth = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..nominal }.robot()?;
/// let mut samples = [Sample::default(); 30];
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
/// assert!((outcome.fit.robot.arms()[2].lb() - 479.1).abs() < 1e-6);
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
    let nominal_arms = nominal_arms(robot, settings);
    let work = places(work, samples.len())?;
    for (index, (place, sample)) in work.iter_mut().zip(samples).enumerate() {
        *place = WeighedSample::vacant();
        for ((weighed, nominal), (q, arm)) in place
            .arms
            .iter_mut()
            .zip(&nominal_arms)
            .zip(sample.joints.into_iter().zip(ArmIndex::ALL))
        {
            weighed.sample = nominal
                .sample(&sample.position, q, arm)
                .map_err(|error| RobustRefusal::Sample(index, error))?;
        }
    }
    let [first, second, third] = &nominal_arms;
    fit(settings, [first, second, third], loss, work)
}

pub(crate) fn places<T: Real>(
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

pub(crate) fn fit<T: Real>(
    settings: &Settings<T>,
    nominal_arms: [&NominalArm<T>; 3],
    loss: Loss,
    samples: &mut [WeighedSample<T>],
) -> Result<RobustOutcome<T>, RobustRefusal> {
    let arms = Arms {
        settings,
        nominal_arms,
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
    let fit = RobotCalibrator::of_arms(settings, problems).solve()?;
    if settings.noise.is_none() {
        in_sigmas(&fit, nominal_arms, samples);
    }
    Ok(RobustOutcome {
        fit,
        suspected,
        rounds,
        settled,
    })
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

/// Divides an arm's weights by κ of [`WeightNormalization`](super::loss::WeightNormalization); returns the
/// effective number of samples.
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
    let normalization = loss.normalization(sizes, T::ONE, T::ONE);
    for sample in samples.iter_mut() {
        let own = sample.of_mut(arm);
        own.root = (own.weight / normalization.divisor).square_root();
    }
    normalization.effective_samples
}

/// Residuals in σ, of the noise that each arm's residuals have.
fn in_sigmas<T: Real>(
    fit: &RobotOutcome<T>,
    nominal_arms: [&NominalArm<T>; 3],
    samples: &mut [WeighedSample<T>],
) {
    for ((outcome, nominal), arm) in fit.arms.iter().zip(nominal_arms).zip(ArmIndex::ALL) {
        let sigma = outcome.estimated_noise.unwrap_or(T::ONE);
        let factor = nominal.scale() / sigma;
        for sample in samples.iter_mut() {
            let own = sample.of_mut(arm);
            own.residual *= factor;
        }
    }
}
