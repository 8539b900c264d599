//! How likely it is that a calibration makes a robot worse, although its parameters are noisy.
//!
//! The calibrated parameters differ by u from those before. With δ the robot's true difference and
//! the covariance C of the estimate, u = δ + ε, ε ~ N(0, C). With the mean M of JᵀJ over the
//! workspace, the mean squared position error falls by
//!
//! ```text
//! |δ|² − |ε|² = 2 uᵀM δ − uᵀM u        (norms with M)
//! ```
//!
//! u alone does not tell δ: of many robots those that u says to be far off are those with a large ε as
//! well. How large δ may be says the tolerance or, where none is stated, the robot itself: with all
//! parameters in mm (angles times the upper arm's length), δ ~ N(0, τ² I), and those combinations of
//! parameters that the samples determine well show τ. Along the eigenvectors of C
//!
//! ```text
//! uᵢ ~ N(0, τ² + λᵢ),   δᵢ | uᵢ ~ N(τ² uᵢ/(τ² + λᵢ), τ² λᵢ/(τ² + λᵢ))
//! ```
//!
//! and τ is integrated out with a prior that is even in log τ. It is an estimate of the kind that
//! Efron and Morris (1973) and MacKay (1992) use.
//!
//! Where the robot's place in space does not count, M is that of the positions less the rigid motion that explains most
//! of each parameter's effect. It has a kernel, the combinations of parameters that move the robot as a whole: u and C
//! are projected on what is orthogonal to them.

use crate::accuracy::chi_square::quantile;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal};

/// Sizes of τ that are tried, from the largest change down to this part of it.
const SIZES: u32 = 49;
const SMALLEST: f64 = 1e-4;
/// Quantiles of the noise where it is estimated: the middles of equal parts.
const NOISE_LEVELS: u32 = 5;

/// A change of the parameters, all in mm, and what is known of it.
#[derive(Debug, Clone)]
pub(crate) struct Change {
    /// u.
    pub(crate) difference: DVector<f64>,
    /// C. With an estimated noise that of Student's distribution.
    pub(crate) covariance: DMatrix<f64>,
    /// M.
    pub(crate) sensitivity: DMatrix<f64>,
    /// Whether C holds a tolerance about the parameters before.
    pub(crate) has_tolerance: bool,
    /// Of an estimated noise; `None` if it is stated.
    pub(crate) degrees_of_freedom: Option<f64>,
}

impl Change {
    /// Without the combinations of parameters that M's kernel holds, so many of them.
    pub(crate) fn without_kernel(self, dimensions: usize) -> Self {
        let eigen = self.sensitivity.clone().symmetric_eigen();
        let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        order.truncate(order.len().saturating_sub(dimensions));
        let columns: Vec<_> = order
            .iter()
            .map(|index| eigen.eigenvectors.column(*index))
            .collect();
        let kept = DMatrix::from_columns(&columns);
        let projected = |matrix: &DMatrix<f64>| kept.tr_mul(matrix) * &kept;
        Self {
            difference: kept.tr_mul(&self.difference),
            covariance: projected(&self.covariance),
            sensitivity: projected(&self.sensitivity),
            ..self
        }
    }

    /// The probability that the mean squared position error grows. `None` if too few samples are left
    /// over to say how noisy they are.
    pub(crate) fn chance_of_harm(&self) -> Option<f64> {
        if self.has_tolerance {
            Some(self.with_tolerance())
        } else {
            self.without_tolerance()
        }
    }

    /// The estimate is δ's mean already, and C its covariance.
    fn with_tolerance(&self) -> f64 {
        let weights = &self.sensitivity * &self.difference;
        let gain = weights.dot(&self.difference);
        let variance = weights.dot(&(&self.covariance * &weights));
        harm(gain, 4.0 * variance)
    }

    fn without_tolerance(&self) -> Option<f64> {
        let eigen = self.covariance.clone().symmetric_eigen();
        let least = f64::EPSILON * eigen.eigenvalues.amax();
        let variances = eigen.eigenvalues.map(|value| value.max(least));
        let change = eigen.eigenvectors.tr_mul(&self.difference);
        let weights = eigen
            .eigenvectors
            .tr_mul(&(&self.sensitivity * &self.difference));
        let squared = weights.dot(&change);
        let (mut total, mut harmed) = (0.0, 0.0);
        let mut best = f64::NEG_INFINITY;
        for level in self.noise_levels()? {
            for size in 0..SIZES {
                let part = f64::from(size) / f64::from(SIZES - 1);
                let tau = change.amax() * SMALLEST.powf(part);
                let (mut logarithm, mut gain, mut variance) = (0.0, -squared, 0.0);
                for index in 0..change.len() {
                    let (own, noise) = (tau * tau, level * variances[index]);
                    let sum = own + noise;
                    let (u, weight) = (change[index], weights[index]);
                    logarithm -= 0.5 * (sum.ln() + u * u / sum);
                    gain += 2.0 * weight * own / sum * u;
                    variance += 4.0 * weight * weight * own * noise / sum;
                }
                // Sums relative to the largest term so far.
                if logarithm > best {
                    let rescale = (best - logarithm).exp();
                    (total, harmed) = (total * rescale, harmed * rescale);
                    best = logarithm;
                }
                let likelihood = (logarithm - best).exp();
                total += likelihood;
                harmed += likelihood * harm(gain, variance);
            }
        }
        let chance: f64 = harmed / total;
        chance.is_finite().then_some(chance)
    }

    /// By what the variances are to be multiplied, in equally probable cases.
    fn noise_levels(&self) -> Option<Vec<f64>> {
        let Some(freedom) = self.degrees_of_freedom else {
            return Some(vec![1.0]);
        };
        let spare = freedom - 2.0;
        if !(spare > 0.0) {
            return None;
        }
        let levels = (0..NOISE_LEVELS).map(|level| {
            let probability = (f64::from(level) + 0.5) / f64::from(NOISE_LEVELS);
            Some(spare / quantile(freedom, probability)?)
        });
        levels.collect()
    }
}

/// The probability that a normally distributed gain is negative.
fn harm(gain: f64, variance: f64) -> f64 {
    if variance > 0.0
        && let Ok(normal) = Normal::new(gain, variance.sqrt())
    {
        normal.cdf(0.0)
    } else if gain > 0.0 {
        0.0
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::Change;
    use delta_cal::simulate::standard_normal;
    use nalgebra::{DMatrix, DVector};
    use rand_core::SeedableRng;
    use rand_pcg::Pcg32;

    /// Robots whose differences have the size 0.7 in every parameter, which is not told, measured well
    /// along some combinations and badly along others: as many become worse as the chances add up to.
    #[test]
    fn as_many_become_worse_as_the_chances_say() {
        for spread in [1.0, 2.0, 3.0] {
            let (mut said, mut variance, mut harmed) = (0.0, 0.0, 0.0);
            let mut rng = Pcg32::seed_from_u64(1);
            for _ in 0..1000 {
                let mut normal = || standard_normal::<f64, _>(&mut rng);
                let sigma = DVector::from_fn(24, |_, _| 0.1 * 10_f64.powf(0.5 * spread * normal()));
                let own = DVector::from_fn(24, |_, _| 0.7 * normal());
                let noise = DVector::from_fn(24, |index, _| sigma[index] * normal());
                let change = Change {
                    difference: &own + &noise,
                    covariance: DMatrix::from_diagonal(&sigma.component_mul(&sigma)),
                    sensitivity: DMatrix::identity(24, 24),
                    has_tolerance: false,
                    degrees_of_freedom: None,
                };
                let chance = change.chance_of_harm().unwrap_or(f64::NAN);
                said += chance;
                variance += chance * (1.0 - chance);
                harmed += f64::from(u8::from(noise.norm() > own.norm()));
            }
            // Four standard deviations; 1 % more because τ is not known exactly.
            let limit = 4.0 * f64::sqrt(variance) + 0.01 * said;
            assert!(f64::abs(harmed - said) < limit, "{spread}: {harmed} {said}");
        }
    }

    /// Six of 24 combinations move the robot as a whole, by whatever the search for the sensor's frame left of that: the
    /// chance is that of the 18 others by themselves.
    #[test]
    fn motions_of_the_whole_robot_do_not_count() {
        let mut rng = Pcg32::seed_from_u64(2);
        for number in 0..100 {
            let mut normal = || standard_normal::<f64, _>(&mut rng);
            let sigma = DVector::from_fn(18, |_, _| 0.3 * 10_f64.powf(normal()));
            let own = DVector::from_fn(18, |index, _| 0.5 * normal() + sigma[index] * normal());
            let motion = DVector::from_fn(6, |_, _| 30.0 * normal());
            // Any orthogonal axes.
            let axes = DMatrix::from_fn(24, 24, |_, _| normal()).qr().q();
            let turned = |diagonal: DVector<f64>| {
                &axes * DMatrix::from_diagonal(&diagonal) * axes.transpose()
            };
            let with = |others: f64, rest: &DVector<f64>| {
                DVector::from_fn(24, |index, _| if index < 18 { rest[index] } else { others })
            };
            let variances = sigma.component_mul(&sigma);
            let weights =
                DVector::from_fn(18, |index, _| 1.0 + f64::from(u8::from(index % 2 == 0)));
            let alone = Change {
                difference: own.clone(),
                covariance: DMatrix::from_diagonal(&variances),
                sensitivity: DMatrix::from_diagonal(&weights),
                has_tolerance: number % 2 == 0,
                degrees_of_freedom: None,
            };
            let joined = DVector::from_fn(24, |index, _| {
                if index < 18 {
                    own[index]
                } else {
                    motion[index - 18]
                }
            });
            let whole = Change {
                difference: &axes * joined,
                covariance: turned(with(1e-4, &variances)),
                sensitivity: turned(with(0.0, &weights)),
                ..alone.clone()
            };
            let expected = alone.chance_of_harm().unwrap_or(f64::NAN);
            let found = whole.without_kernel(6).chance_of_harm().unwrap_or(f64::NAN);
            // Roundings of numbers up to 1e3, squared.
            assert!((found - expected).abs() < 1e-8, "{found} {expected}");
        }
    }
}
