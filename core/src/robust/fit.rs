use super::loss::Loss;
use super::outcome::{RobustOutcome, RobustRefusal};
use super::robot::Fits;
use super::sample::WeighedSample;
use super::start::least_trimmed;
use crate::Real;
use crate::calibration::limits::{LARGEST_SUSPECTED, SAMPLES_FOR_ROBUST_FIT, SUSPECTED};
use crate::calibration::{JointCalibrator, Settings};
use crate::robot::Robot;
use crate::samples::Sample;

/// Rounds of reweighting at most; after half of them the scales stay, and what is rejected. Most fits
/// take 25 to 30.
const ROUNDS: u16 = 80;
/// The first round's scales are so many times as large, and each round's so much smaller than the one
/// before, down to what they are: the least trimmed squares' fit knows its own samples too well, and
/// with few of them good ones lie many scales off it. They come back as long as the scales are wide
/// (graduated non-convexity, Blake and Zisserman 1987).
const WIDENED: f64 = 20.0;
const NARROWED: f64 = 0.7;
/// Residuals of a sample, whose length is weighed.
const DIMENSIONS: f64 = 3.0;

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
    if samples.len() < SAMPLES_FOR_ROBUST_FIT {
        return Err(RobustRefusal::TooFewSamples {
            samples: samples.len(),
            needed: SAMPLES_FOR_ROBUST_FIT,
        });
    }
    let weighed = work.get_mut(..samples.len()).ok_or(RobustRefusal::NoRoom {
        samples: samples.len(),
    })?;
    let fits = Fits {
        settings,
        samples,
        empty: *JointCalibrator::new(robot, settings).factor(),
    };
    for (index, (place, sample)) in weighed.iter_mut().zip(samples).enumerate() {
        *place = WeighedSample::vacant();
        fits.empty
            .check(sample)
            .map_err(|error| RobustRefusal::Sample(index, error))?;
    }
    fit(&fits, loss, weighed)
}

fn fit<T: Real>(
    fits: &Fits<'_, T>,
    loss: Loss,
    samples: &mut [WeighedSample<T>],
) -> Result<RobustOutcome<T>, RobustRefusal> {
    let mut effective = T::from_count(samples.len() as u64);
    let (mut rounds, mut settled) = (0, false);
    if let Some(correction) = least_trimmed(fits, samples) {
        fits.measure(&correction, samples);
        let mut scale = T::ZERO;
        let mut width = T::from_f64(WIDENED);
        while rounds < ROUNDS && !settled {
            let late = rounds >= ROUNDS / 2;
            if !late {
                scale = fits.scale(samples) * width;
            }
            let change = weigh(loss, scale, late, samples);
            settled = width <= T::ONE && change <= T::EPSILON.square_root();
            rounds += 1;
            width = T::ONE.larger(width * T::from_f64(NARROWED));
            effective = normalise(loss, scale, samples);
            let Some(correction) = fits.fit(samples, effective) else {
                break;
            };
            fits.measure(&correction, samples);
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
    let fit = fits.outcome(samples, effective)?;
    if let Some(noise) = fit.estimate.estimated_noise {
        // Residuals in σ, of the noise that they have.
        let factor = fits.empty.unit() / noise;
        for sample in samples.iter_mut() {
            sample.distance *= factor;
        }
    }
    Ok(RobustOutcome {
        fit,
        effective_samples: effective,
        suspected,
        rounds,
        settled,
    })
}

/// Weighs every sample by its distance; returns the largest change of a weight. Late in the rounds what
/// was suspected stays so, for the rounds to come to an end.
fn weigh<T: Real>(loss: Loss, scale: T, late: bool, samples: &mut [WeighedSample<T>]) -> T {
    let unit = scale * stretch(loss);
    let mut largest = T::ZERO;
    for sample in samples {
        sample.suspected =
            (late && sample.suspected) || !(sample.distance < T::from_f64(SUSPECTED) * unit);
        let weight = if sample.suspected {
            T::ZERO
        } else {
            loss.weight(sample.distance / unit)
        };
        largest = largest.larger((weight - sample.weight).magnitude());
        sample.weight = weight;
    }
    largest
}

/// Divides the weights by κ of [`WeightNormalization`](super::loss::WeightNormalization); returns the
/// effective number of samples.
fn normalise<T: Real>(loss: Loss, scale: T, samples: &mut [WeighedSample<T>]) -> T {
    let sizes = samples
        .iter()
        .filter(|sample| sample.weight > T::ZERO)
        .map(|sample| sample.distance / scale);
    let normalization = loss.normalization(sizes, T::from_f64(DIMENSIONS), stretch(loss));
    for sample in samples.iter_mut() {
        sample.factor = sample.weight / normalization.divisor;
    }
    normalization.effective_samples
}

/// By how much a loss is wider for the length of three residuals than for one, so that it has 95 % of the
/// squared loss's efficiency here as well: k = 1.628, c = 5.490.
fn stretch<T: Real>(loss: Loss) -> T {
    T::from_f64(match loss {
        Loss::Huber => 1.210_396,
        Loss::Tukey => 1.171_878,
    })
}
