//! Exponential forgetting of older samples.

use crate::{Real, SettingError};

/// Exponential forgetting: a sample that is k samples old has weight λᵏ. The forgetting factor λ = N/(N + 1) is
/// specified by N, the mean age of the samples in the estimate.
///
/// ```text
/// Σ λᵏ = N + 1,   Σ k λᵏ / Σ λᵏ = λ/(1 − λ) = N,   (Σ λᵏ)² / Σ λ²ᵏ = (1 + λ)/(1 − λ) = 2N + 1
/// ```
///
/// The estimate of a parameter that changes at a constant rate lags by N samples. For a robot that does not change, the
/// variance of the estimate is that of 2N + 1 samples (exponentially weighted least squares; Ljung, System
/// Identification, 1999, section 11.2). With a mean age below a hundred samples, the eight parameters of an arm share
/// few samples: the newest determine the rarely observed combinations, which leaves less for the rest. At N = 20 the
/// lag of Lb is twice N.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Forgetting<T> {
    mean_age: T,
    factor: T,
}

impl<T: Real> Forgetting<T> {
    /// Exponential forgetting with mean age N, in samples.
    ///
    /// # Errors
    /// A number below one, NaN, or too large for the scalar type.
    ///
    /// ```
    /// use delta_cal::stream::Forgetting;
    /// assert_eq!(Forgetting::new(49.0)?.factor(), 0.98);
    /// assert!(Forgetting::new(0.5).is_err() && Forgetting::new(1e6_f32).is_err());
    /// # Ok::<(), delta_cal::SettingError>(())
    /// ```
    pub fn new(mean_age: T) -> Result<Self, SettingError> {
        if !(mean_age >= T::ONE) {
            return Err(SettingError::AgeTooShort);
        }
        if !(mean_age * T::EPSILON <= T::from_f64(1.0 / 128.0)) {
            return Err(SettingError::AgeTooLong);
        }
        Ok(Self {
            mean_age,
            factor: mean_age / (mean_age + T::ONE),
        })
    }

    /// N, the mean age of the samples in the estimate, in samples.
    pub fn mean_age(&self) -> T {
        self.mean_age
    }

    /// λ, the forgetting factor.
    pub fn factor(&self) -> T {
        self.factor
    }

    /// λ to the power of a count.
    pub(super) fn after(&self, samples: u64) -> T {
        let (mut power, mut square, mut rest) = (T::ONE, self.factor, samples);
        while rest > 0 {
            if rest & 1 == 1 {
                power *= square;
            }
            square *= square;
            rest >>= 1;
        }
        power
    }
}
