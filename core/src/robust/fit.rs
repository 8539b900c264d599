use super::fits::{Fits, scale};
use super::loss::{Loss, WeightNormalization};
use super::outcome::{RobustOutcome, RobustRefusal};
use super::positions::Positions;
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
/// The first rounds' scales are wider, and each round's so much smaller than the one before, down to what they are:
/// the least trimmed squares' fit knows its own samples too well (graduated non-convexity, Blake and Zisserman
/// 1987).
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
    if samples.len() < SAMPLES_FOR_ROBUST_FIT {
        return Err(RobustRefusal::TooFewSamples {
            samples: samples.len(),
            needed: SAMPLES_FOR_ROBUST_FIT,
        });
    }
    let weighed = work.get_mut(..samples.len()).ok_or(RobustRefusal::NoRoom {
        samples: samples.len(),
    })?;
    let mut fits = Positions {
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
    let outcome = fit(&mut fits, loss, weighed)?;
    if let Some(noise) = outcome.fit.estimate.estimated_noise {
        // Residuals in σ, of the noise that they have.
        let factor = fits.empty.unit() / noise;
        for sample in weighed.iter_mut() {
            sample.distance *= factor;
        }
    }
    Ok(outcome)
}

/// The fit of samples whose places are vacant but for their dimensions.
pub(crate) fn fit<T: Real, F: Fits<T>>(
    fits: &mut F,
    loss: Loss,
    samples: &mut [WeighedSample<T>],
) -> Result<RobustOutcome<T, F::Outcome>, RobustRefusal> {
    let counted = samples
        .iter()
        .filter(|sample| sample.dimensions > 0)
        .count();
    let mut normalization = WeightNormalization {
        divisor: T::ONE,
        effective_samples: T::from_count(counted as u64),
    };
    let mut scale_of_all = T::ZERO;
    let (mut rounds, mut settled) = (0, false);
    if let Some(correction) = least_trimmed(fits, samples) {
        fits.measure(&correction, samples);
        let mut width = fits.widened();
        while rounds < ROUNDS && !settled {
            let late = rounds >= ROUNDS / 2;
            if !late {
                scale_of_all = scale(fits, samples) * width;
            }
            let change = weigh(loss, scale_of_all, late, samples);
            settled = width <= T::ONE && change <= T::EPSILON.square_root();
            rounds += 1;
            width = T::ONE.larger(width * T::from_f64(NARROWED));
            normalization = normalise(loss, scale_of_all, samples);
            let settings = *fits.settings();
            let effective = normalization.effective_samples;
            let Some(correction) = fits.fit(&settings, samples, effective) else {
                break;
            };
            fits.measure(&correction, samples);
        }
    }
    let suspected = samples.iter().filter(|sample| sample.suspected).count();
    if T::from_count(suspected as u64)
        > T::from_f64(LARGEST_SUSPECTED) * T::from_count(counted as u64)
    {
        return Err(RobustRefusal::TooManySuspected {
            suspected,
            samples: counted,
        });
    }
    let fit = fits.outcome(samples, normalization.effective_samples)?;
    Ok(RobustOutcome {
        fit,
        effective_samples: normalization.effective_samples,
        scale: scale_of_all,
        divisor: normalization.divisor,
        suspected,
        rounds,
        settled,
    })
}

/// Weighs every sample by its distance; returns the largest change of a weight. Late in the rounds what
/// was suspected stays so, for the rounds to come to an end.
fn weigh<T: Real>(loss: Loss, scale: T, late: bool, samples: &mut [WeighedSample<T>]) -> T {
    let mut largest = T::ZERO;
    for sample in samples {
        let unit = scale * loss.stretch(sample.dimensions);
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

/// Divides the weights by κ.
fn normalise<T: Real>(
    loss: Loss,
    scale: T,
    samples: &mut [WeighedSample<T>],
) -> WeightNormalization<T> {
    let counted = samples
        .iter()
        .filter(|sample| sample.weight > T::ZERO && sample.dimensions > 0);
    let residuals = counted.map(|sample| {
        let dimensions = T::from_count(u64::from(sample.dimensions));
        (
            sample.distance / scale,
            dimensions,
            loss.stretch(sample.dimensions),
        )
    });
    let normalization = loss.normalization(residuals);
    for sample in samples.iter_mut() {
        sample.factor = sample.weight / normalization.divisor;
    }
    normalization
}
