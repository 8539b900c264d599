use crate::Real;
use crate::calibration::limits::SUSPECTED;

/// How a robust fit counts a residual, r in units of the residuals' scale. The squared loss, which
/// counts all alike, is the plain fit's. With either of these a sample that is [`SUSPECTED`] scales
/// off has no influence at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Loss {
    /// Huber's (1964): squared up to k = 1.345, linear beyond, and nothing from [`SUSPECTED`] on (a
    /// "Huber-type skipped" estimate, Hampel 1985). Huber's loss alone would leave every wrong sample the
    /// pull of one that is k off, all of them on the same side if the cause is the same.
    Huber,
    /// Tukey's biweight (Beaton and Tukey 1974): the influence falls off smoothly, to nothing at
    /// c = 4.685.
    Tukey,
}

/// k of Huber's loss and c of Tukey's: of normal residuals either has 95 % of the efficiency of the squared
/// loss (Holland and Welsch 1977).
const HUBER: f64 = 1.345;
const TUKEY: f64 = SUSPECTED;

impl Loss {
    /// ψ(r)/r: what a residual counts, 1 for a small one.
    ///
    /// Huber: min(1, k/|r|); Tukey: (1 − (r/c)²)²; 0 beyond c, and for NaN.
    ///
    /// ```
    /// use delta_cal::robust::Loss;
    /// assert_eq!(Loss::Huber.weight(2.69), 0.5);
    /// assert_eq!(Loss::Tukey.weight(5.0), 0.0);
    /// ```
    pub fn weight<T: Real>(self, r: T) -> T {
        let size = r.magnitude();
        match self {
            Self::Huber if size <= T::from_f64(HUBER) => T::ONE,
            Self::Huber if size < T::from_f64(SUSPECTED) => T::from_f64(HUBER) / size,
            Self::Tukey if size < T::from_f64(TUKEY) => {
                (T::ONE - (size / T::from_f64(TUKEY)).squared()).squared()
            }
            Self::Huber | Self::Tukey => T::ZERO,
        }
    }

    /// ψ′(r): how much the residual's influence grows with it.
    pub fn slope<T: Real>(self, r: T) -> T {
        let size = r.magnitude();
        match self {
            Self::Huber if size <= T::from_f64(HUBER) => T::ONE,
            Self::Tukey if size < T::from_f64(TUKEY) => {
                let square = (size / T::from_f64(TUKEY)).squared();
                (T::ONE - square) * (T::ONE - T::from_f64(5.0) * square)
            }
            Self::Huber | Self::Tukey => T::ZERO,
        }
    }

    /// By how much the loss is wider for the length of a vector of so many residuals than for one, so that it has
    /// 95 % of the squared loss's efficiency there as well.
    ///
    /// ```
    /// use delta_cal::robust::Loss;
    /// // Of three residuals Huber's k is 1.628.
    /// assert!((Loss::Huber.stretch::<f64>(3) * 1.345 - 1.628).abs() < 5e-4);
    /// ```
    pub fn stretch<T: Real>(self, dimensions: u8) -> T {
        let wider = match self {
            Self::Huber => [1.0, 1.116_090, 1.210_396, 1.287_043, 1.347_226],
            Self::Tukey => [1.0, 1.093_487, 1.171_878, 1.240_195, 1.301_231],
        };
        let index = usize::from(dimensions).saturating_sub(1);
        let [.., widest] = wider;
        T::from_f64(wider.get(index).copied().unwrap_or(widest))
    }

    /// How the weights of these residuals enter a sum of squares (see [`WeightNormalization`]). Each is the
    /// length of a residual in scales, the number of its dimensions, and by how much the loss is wider for it.
    /// Samples without a weight are left out of it.
    pub fn normalization<T: Real>(
        self,
        residuals: impl Iterator<Item = (T, T, T)>,
    ) -> WeightNormalization<T> {
        let (mut count, mut weights, mut slopes) = (T::ZERO, T::ZERO, T::ZERO);
        let (mut influences, mut moments) = (T::ZERO, T::ZERO);
        for (size, dimensions, stretch) in residuals {
            let weight = self.weight(size / stretch);
            if weight > T::ZERO {
                count += T::ONE;
                weights += weight;
                influences += (weight * size).squared() / dimensions;
                moments += weight * size.squared() / dimensions;
                slopes +=
                    ((dimensions - T::ONE) * weight + self.slope(size / stretch)) / dimensions;
            }
        }
        let divisor = influences * weights / (moments * slopes);
        // Samples that fit exactly say nothing of it.
        let divisor = if divisor > T::HALF && divisor.finite() {
            divisor
        } else {
            T::ONE
        };
        let samples = slopes / divisor;
        WeightNormalization {
            divisor,
            effective_samples: if samples > T::ONE { samples } else { count },
        }
    }
}

/// How a robust fit's weights are to enter a sum of squares.
///
/// ```text
/// κ = mean ψ² · mean w / (mean ψ r · mean ψ′),   n mean ψ′ / κ
/// ```
///
/// The covariance of an M-estimate is mean ψ² / (mean ψ′)² · (JᵀJ)⁻¹ (Huber 1981, section 7.6). Of
/// normal residuals mean ψ r = σ² mean ψ′ (Stein 1981), so that with the weights w/κ the inverse of the
/// weighted JᵀJ, times σ², is that covariance, and the weighted sum of squares over n mean ψ′/κ
/// estimates σ². κ itself does not depend on σ: it is 1 if all samples count alike, and of normal
/// residuals 0.96 for Tukey's loss and 1.01 for Huber's.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct WeightNormalization<T> {
    /// κ.
    pub divisor: T,
    /// n mean ψ′/κ: the effective number of samples, by which the weighted sum of squares is divided.
    pub effective_samples: T,
}

#[cfg(test)]
mod tests;
