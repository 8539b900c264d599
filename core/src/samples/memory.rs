use crate::Real;
use core::fmt;

/// How long an estimate remembers: a sample that came k samples ago counts λᵏ, λ = N/(N + 1).
///
/// ```text
/// Σ λᵏ = N + 1,   Σ k λᵏ / Σ λᵏ = λ/(1 − λ) = N,   (Σ λᵏ)² / Σ λ²ᵏ = (1 + λ)/(1 − λ) = 2N + 1
/// ```
///
/// The mean sample is N samples old, and by so much the estimate of a parameter that changes at a constant
/// rate lags behind. Of a robot that does not change its variance is that of 2N + 1 samples
/// (exponentially weighted least squares; Ljung, System Identification, 1999, section 11.2). With a memory
/// of less than a hundred samples the eight parameters of an arm share few: the newest fix the combinations
/// that are seldom seen, and less is left of them for the rest. The lag of Lb is twice N at N = 20.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Memory<T> {
    samples: T,
    factor: T,
}

/// Why a number of samples is not a memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MemoryError {
    /// NaN, or less than one sample.
    TooShort,
    /// λ would be known to less than a hundredth of 1 − λ: above 65,536 samples in single precision.
    TooLong,
}

impl fmt::Display for MemoryError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::TooShort => "the memory must be one sample or more",
            Self::TooLong => {
                "the memory is too long for this arithmetic: add the samples without forgetting"
            }
        })
    }
}

impl core::error::Error for MemoryError {}

impl<T: Real> Memory<T> {
    /// A memory of N `samples`: the mean age of what it holds.
    ///
    /// # Errors
    /// A number below one, NaN, or too large for the scalar type.
    ///
    /// ```
    /// use delta_cal::Memory;
    /// assert_eq!(Memory::new(49.0)?.forgetting_factor(), 0.98);
    /// assert!(Memory::new(0.5).is_err() && Memory::new(1e6_f32).is_err());
    /// # Ok::<(), delta_cal::MemoryError>(())
    /// ```
    pub fn new(samples: T) -> Result<Self, MemoryError> {
        if !(samples >= T::ONE) {
            return Err(MemoryError::TooShort);
        }
        if !(samples * T::EPSILON <= T::from_f64(1.0 / 128.0)) {
            return Err(MemoryError::TooLong);
        }
        Ok(Self {
            samples,
            factor: samples / (samples + T::ONE),
        })
    }

    /// N.
    pub fn samples(&self) -> T {
        self.samples
    }

    /// λ, the forgetting factor.
    pub fn forgetting_factor(&self) -> T {
        self.factor
    }

    /// λ to the power of a count.
    pub(crate) fn after(&self, samples: u64) -> T {
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

#[cfg(test)]
mod tests;
