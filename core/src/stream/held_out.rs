//! Held-out validation: a calibration from some of the samples must agree with the others.
//!
//! ```text
//! e  = held-out residuals f/σf at the fitted parameters,   H their Jacobian
//! C  = covariance of the fitted parameters, prior included
//! E(eᵀe) = m + tr(H C Hᵀ)
//! eᵀ(I + H C Hᵀ)⁻¹e  ~  χ² with m degrees of freedom
//! ```
//!
//! The last is by how much the fit's sum of squares grows when the m held-out samples join it, which is
//! what their factor adds to the factor of the fit: the predictive test of Chow (1960). Without a stated
//! noise, over m and over the fit's own residual variance, it is distributed as F.

use crate::Real;
use crate::calibration::limits::{
    HELD_OUT_DEVIATION, NOISE_MARGIN, OVERFITTED, chi_square_bound, variance_ratio_bound,
};
use crate::calibration::{
    ArmOutcome, Calibrator, Identifiability, Normal, RobotOutcome, Tolerance,
};
use crate::robot::ArmIndex;
use crate::samples::{ArmFactor, Displacement, MergeError, Sample, SampleError};
use crate::snapshot::state;
use core::fmt;

/// Every k-th sample, in a second calibrator that is not calibrated.
///
/// ```
/// use delta_cal::{Calibrator, Noise, Sample, Settings, SymmetricRobot};
/// use delta_cal::stream::HeldOut;
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let truth = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..nominal }.robot()?;
/// let settings = Settings::default().with_noise(Noise::new(0.02, 0.0)?);
/// let mut calibrator = Calibrator::new(&nominal.robot()?, &settings);
/// let mut held_out = HeldOut::new(&calibrator, 4)?;
/// for k in 0..40 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     held_out.add(&mut calibrator, &Sample { joints, position: truth.forward(&joints)? })?;
/// }
/// let fitted = calibrator.solve()?;
/// let arms = held_out.validate(&mut calibrator, &fitted)?;
/// assert!(arms[0].samples == 10.0 && arms[0].residual_rms < 0.01);
/// // It passed: all samples together make the result.
/// held_out.merge_into(&mut calibrator)?;
/// assert_eq!(calibrator.solve()?.arms[0].samples, 40);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldOut<T: Real> {
    samples: Calibrator<T>,
    every: u64,
    came: u64,
}

state!(HeldOut<T>: samples: Calibrator<T>, came: u64);

/// How well an arm that was fitted to some samples agrees with the others.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Validation<T> {
    /// m: the effective number of held-out samples after forgetting.
    pub samples: T,
    /// √(eᵀe/m): in σ with a stated noise, otherwise along the forearm, in length.
    pub residual_rms: T,
    /// √((m + tr(H C Hᵀ))/m), of a calibration that is right, in the same unit.
    pub expected_rms: T,
    /// eᵀ(I + H C Hᵀ)⁻¹e, in units of the stated noise, or of the fit's estimate of it.
    pub statistic: T,
    /// The largest statistic with which the calibration passes.
    pub limit: T,
}

impl<T: Real> Validation<T> {
    /// The same in another scalar type.
    pub fn cast<U: Real>(&self) -> Validation<U> {
        let cast = |value: T| U::from_f64(value.to_f64());
        Validation {
            samples: cast(self.samples),
            residual_rms: cast(self.residual_rms),
            expected_rms: cast(self.expected_rms),
            statistic: cast(self.statistic),
            limit: cast(self.limit),
        }
    }
}

/// Why held-out samples contradict a calibration, or cannot test it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum HeldOutRefusal {
    /// One sample in so many cannot be held out: it must be one in two or fewer.
    Every,
    /// No sample is held out.
    NoSamples {
        /// Which arm.
        arm: ArmIndex,
    },
    /// The noise is not stated, and the fitted samples are too few to tell it.
    NoNoise {
        /// Which arm.
        arm: ArmIndex,
    },
    /// The held-out samples disagree with the fit by more than their noise and the uncertainty of the
    /// parameters explain.
    Contradicted {
        /// Which arm.
        arm: ArmIndex,
        /// rms of the held-out residuals over what is expected.
        ratio: f32,
    },
    /// The fitted samples determine the parameters so badly that the fit says next to nothing of
    /// samples that it did not see.
    Overfitted {
        /// Which arm.
        arm: ArmIndex,
        /// rms of the held-out residuals in σ of the noise.
        ratio: f32,
    },
}

impl HeldOutRefusal {
    /// The arm at fault, if it is one.
    pub const fn arm(&self) -> Option<ArmIndex> {
        match self {
            Self::Every => None,
            Self::NoSamples { arm }
            | Self::NoNoise { arm }
            | Self::Contradicted { arm, .. }
            | Self::Overfitted { arm, .. } => Some(*arm),
        }
    }
}

impl fmt::Display for HeldOutRefusal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Every => formatter.write_str("at most one sample in two can be held out"),
            Self::NoSamples { arm } => write!(formatter, "no sample of {arm} is held out"),
            Self::NoNoise { arm } => write!(
                formatter,
                "the fitted samples of {arm} are too few to estimate the noise, without which the \
                 held-out samples cannot be judged"
            ),
            Self::Contradicted { arm, ratio } => write!(
                formatter,
                "the held-out samples of {arm} are off by {ratio:.1} times what noise and \
                 uncertainty explain"
            ),
            Self::Overfitted { arm, ratio } => write!(
                formatter,
                "the fit of {arm} leaves the held-out samples off by {ratio:.0} sigma of the \
                 noise: the fitted samples are too few or too much alike"
            ),
        }
    }
}

impl core::error::Error for HeldOutRefusal {}

impl<T: Real> HeldOut<T> {
    /// Of the samples that come, every `every`-th is held out of this calibrator.
    ///
    /// # Errors
    /// [`HeldOutRefusal::Every`] below 2.
    pub fn new(calibrator: &Calibrator<T>, every: u64) -> Result<Self, HeldOutRefusal> {
        if every < 2 {
            return Err(HeldOutRefusal::Every);
        }
        let [first, second, third] = calibrator.arms();
        Ok(Self {
            samples: Calibrator::of_arms(
                calibrator.settings(),
                [
                    ArmFactor::new(*first.nominal()),
                    ArmFactor::new(*second.nominal()),
                    ArmFactor::new(*third.nominal()),
                ],
            ),
            every,
            came: 0,
        })
    }

    /// Takes in one sample, here or into the calibrator; whether it is held out.
    ///
    /// # Errors
    /// As [`Calibrator::add`]; nothing has changed.
    pub fn add(
        &mut self,
        calibrator: &mut Calibrator<T>,
        sample: &Sample<T>,
    ) -> Result<bool, SampleError> {
        let held_out = (self.came + 1).is_multiple_of(self.every);
        if held_out {
            self.samples.add(sample)?;
        } else {
            calibrator.add(sample)?;
        }
        self.came = self.came.wrapping_add(1);
        Ok(held_out)
    }

    /// Whether a calibration agrees with the held-out samples. `calibrator` holds what it was fitted to.
    /// A calibration that is right, its noise as stated, is refused once in a thousand times.
    ///
    /// # Errors
    /// The first arm's [`HeldOutRefusal`].
    pub fn validate(
        &mut self,
        calibrator: &mut Calibrator<T>,
        fitted: &RobotOutcome<T>,
    ) -> Result<[Validation<T>; 3], HeldOutRefusal> {
        self.flush();
        calibrator.flush();
        let [first, second, third] = ArmIndex::ALL;
        Ok([
            self.validate_arm(calibrator, fitted, first)?,
            self.validate_arm(calibrator, fitted, second)?,
            self.validate_arm(calibrator, fitted, third)?,
        ])
    }

    /// Takes the waiting samples into the factors, before a validation.
    pub(crate) fn flush(&mut self) {
        self.samples.flush();
    }

    /// The same of one arm, once no samples wait here or in the calibrator.
    #[inline(never)]
    pub(crate) fn validate_arm(
        &self,
        calibrator: &Calibrator<T>,
        fitted: &RobotOutcome<T>,
        arm: ArmIndex,
    ) -> Result<Validation<T>, HeldOutRefusal> {
        let index = arm.index();
        let (Some(seen), Some(held_out), Some(outcome)) = (
            calibrator.arms().get(index),
            self.samples.arms().get(index),
            fitted.arms.get(index),
        ) else {
            return Err(HeldOutRefusal::NoSamples { arm });
        };
        let samples = held_out.effective_samples();
        if !(samples > T::ZERO) {
            return Err(HeldOutRefusal::NoSamples { arm });
        }
        let nominal = seen.nominal();
        let settings = calibrator.settings();
        let noise = ResidualNoise::of(outcome, settings.noise.is_some(), nominal.scale());
        let Some(unit) = noise.unit else {
            return Err(HeldOutRefusal::NoNoise { arm });
        };

        let at = Displacement::new(nominal, &nominal.correction_to(&outcome.arm));
        let prior = Tolerance::weights(settings.tolerance.as_ref(), nominal);
        let prior = prior.map(|weight| weight * unit);
        let mut fit = Normal::from_diagonal(&prior, &[T::ZERO; 8]);
        seen.linearize(&at, &mut fit);
        fit.clear_last_column();
        let mut apart = Normal::zero();
        let sum = held_out.linearize(&at, &mut apart);
        let spread = spread(&fit, &apart);
        held_out.linearize(&at, &mut fit);
        let grown = fit.row(8).first().copied().unwrap_or(T::INFINITY).squared()
            + held_out.least_sum_of_squares();

        let variance = unit.squared();
        let statistic = grown / variance;
        let length = if settings.noise.is_some() {
            T::ONE
        } else {
            nominal.scale()
        };
        let limit = noise.limit(samples);
        let Some(limit) = limit else {
            return Err(HeldOutRefusal::NoNoise { arm });
        };
        let expected = (samples + spread) * variance;
        if !(statistic <= limit) {
            let ratio = to_single((sum / expected).square_root());
            return Err(HeldOutRefusal::Contradicted { arm, ratio });
        }
        let over_noise = sum / (samples * variance);
        if settings.tolerance.is_none() && !(over_noise <= T::from_f64(OVERFITTED).squared()) {
            let ratio = to_single(over_noise.square_root());
            return Err(HeldOutRefusal::Overfitted { arm, ratio });
        }
        Ok(Validation {
            samples,
            residual_rms: (sum / samples).square_root() * length,
            expected_rms: (expected / samples).square_root() * length,
            statistic,
            limit,
        })
    }

    /// How many samples are held out.
    pub fn samples(&self) -> u64 {
        self.samples.samples()
    }

    /// Adds the held-out samples to the others, for the final result.
    ///
    /// # Errors
    /// [`MergeError`] if the calibrator is not the one that they were held out of.
    pub fn merge_into(&self, calibrator: &mut Calibrator<T>) -> Result<(), MergeError> {
        calibrator.merge(&self.samples)
    }
}

/// What the held-out residuals are measured by.
struct ResidualNoise<T> {
    /// One σ of a weighted residual: 1 with a stated noise, otherwise as the fit estimates it.
    unit: Option<T>,
    stated: bool,
    /// The fit's residual variance in that unit squared, and its degrees of freedom.
    variance: T,
    freedom: T,
}

impl<T: Real> ResidualNoise<T> {
    fn of(outcome: &ArmOutcome<T>, stated: bool, scale: T) -> Self {
        let freedom = outcome.degrees_of_freedom;
        let samples = T::from_count(outcome.samples);
        Self {
            unit: if stated {
                Some(T::ONE)
            } else {
                outcome.estimated_noise.map(|noise| noise / scale)
            },
            stated,
            variance: if stated {
                outcome.residual_rms.squared() * samples / freedom
            } else {
                T::ONE
            },
            freedom,
        }
    }

    /// The largest statistic that passes. A stated noise may be too small: where the fit has residuals
    /// enough to tell, these count too, otherwise it is given a margin.
    fn limit(&self, samples: T) -> Option<T> {
        let deviation = T::from_f64(HELD_OUT_DEVIATION);
        let found = variance_ratio_bound(samples, self.freedom, deviation)
            .map(|bound| bound * samples * self.variance);
        if !self.stated {
            return found;
        }
        let stated = chi_square_bound(samples, deviation);
        Some(match found {
            Some(found) => stated.larger(found),
            None => stated * T::from_f64(NOISE_MARGIN),
        })
    }
}

/// tr(H C Hᵀ) in units of the residuals' variance, H a triangular factor of the held-out Jacobian.
#[inline(never)]
fn spread<T: Real>(fit: &Normal<T>, held_out: &Normal<T>) -> T {
    let covariance = Identifiability::<T, 8>::of(fit).covariance;
    let mut sum = T::ZERO;
    for (index, row) in held_out.rows().take(8).enumerate() {
        for (i, left) in (index..8).zip(row) {
            for (j, right) in (index..8).zip(row) {
                let entry = covariance.get((i, j)).copied().unwrap_or(T::ZERO);
                sum += *left * entry * *right;
            }
        }
    }
    sum
}

/// A figure for a message.
fn to_single<T: Real>(value: T) -> f32 {
    <f32 as Real>::from_f64(value.to_f64())
}
