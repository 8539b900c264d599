//! The expanded uncertainty of a position: the length that its error in space exceeds with a probability of 5 %
//! (JCGM 102:2011, 7.2).
//!
//! The error at a pose is N(0, Σ), and its squared length Σ λᵢ χ²₁ with the eigenvalues of Σ: a shifted and scaled χ² of
//! the same first three moments (Hall 1983; Buckley and Eagleson 1988), which is exact for equal eigenvalues and for a
//! single one. Over the workspace the distributions of all poses are mixed.

use super::quantiles::noise_levels;
use super::uncertainty::Sensitivities;
use crate::files::Tool;
use crate::fit::solution::{OF_ROBOT, Solution};
use delta_cal::Sample;
use nalgebra::{Matrix3, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// The probability that the error is within the expanded uncertainty.
pub const COVERAGE: f64 = 0.95;
/// Poses whose distributions are mixed; more change nothing.
const MIXED: usize = 250;
/// Quantiles of an estimated noise: the midpoints of equally probable intervals.
const NOISE_LEVELS: u32 = 24;
/// A difference of probabilities that counts as none.
const CLOSE: f64 = 1e-7;

/// Covariances of positions over the workspace, mm².
pub(crate) struct Spread {
    /// At these poses of the calibrated robot.
    pub(crate) poses: Vec<Sample<f64>>,
    covariances: Vec<Matrix3<f64>>,
    /// Degrees of freedom of an estimated noise.
    freedom: Option<f64>,
}

impl Spread {
    /// In the frame of the base, or after the best rigid motion. `None` if the poses determine none.
    pub(crate) fn of(
        solution: &Solution,
        tool: &Tool,
        poses: &[Sample<f64>],
        absolute: bool,
    ) -> Option<Self> {
        let step = poses.len().div_ceil(MIXED).max(1);
        let all = Sensitivities::<OF_ROBOT>::of(&solution.robot, tool, poses.iter().copied());
        let all = if absolute { all } else { all.relative()? };
        let covariance = solution.of_robot();
        let some = all.0.into_iter().step_by(step);
        let (poses, covariances) = some
            .map(|(pose, jacobian)| (pose, jacobian * covariance * jacobian.transpose()))
            .unzip();
        Some(Self {
            poses,
            covariances,
            freedom: solution.estimated_freedom(),
        })
    }

    /// σ of x, y and z and of the length, rms over the workspace and at the worst pose, mm.
    pub(crate) fn sigmas(&self) -> [(f64, f64); 4] {
        let count = self.covariances.len().max(1) as f64;
        [0, 1, 2, 3].map(|axis| {
            let variance = |own: &Matrix3<f64>| match axis {
                3 => own.trace(),
                axis => own[(axis, axis)],
            };
            let (sum, most) = self
                .covariances
                .iter()
                .map(variance)
                .fold((0.0, 0.0), |(sum, most), own| {
                    (sum + own, f64::max(most, own))
                });
            (f64::sqrt(sum / count), most.sqrt())
        })
    }

    /// The length that 5 % of the errors over the workspace exceed, mm; `None` if the noise is estimated with two degrees of
    /// freedom or fewer.
    pub(crate) fn expanded(&self) -> Option<f64> {
        length(&self.covariances, self.freedom)
    }

    /// The same at the pose where σ is largest, in units of that σ.
    pub(crate) fn factor_at_worst(&self) -> Option<f64> {
        let by_size = |a: &&Matrix3<f64>, b: &&Matrix3<f64>| a.trace().total_cmp(&b.trace());
        let worst = self.covariances.iter().max_by(by_size)?;
        Some(length(&[*worst], self.freedom)? / worst.trace().sqrt())
    }
}

/// The squared length of N(0, Σ): a shifted and scaled χ².
struct SquaredLength {
    mean: f64,
    scale: f64,
    freedom: f64,
    chi_squared: ChiSquared,
}

impl SquaredLength {
    /// From the traces of Σ, Σ² and Σ³, the sums of the eigenvalues' powers. `None` if Σ is zero.
    fn of(covariance: &Matrix3<f64>) -> Option<Self> {
        let second = 2.0 * covariance.norm_squared();
        let third = 8.0 * (covariance * covariance).dot(covariance);
        let freedom = second * second * second * 8.0 / (third * third);
        Some(Self {
            mean: covariance.trace(),
            scale: (second / (2.0 * freedom)).sqrt(),
            freedom,
            chi_squared: ChiSquared::new(freedom).ok()?,
        })
    }

    /// The probability that it is at most this.
    fn within(&self, square: f64) -> f64 {
        let shifted = self.freedom + (square - self.mean) / self.scale;
        self.chi_squared.cdf(shifted.max(0.0))
    }
}

/// The length that errors with these covariances, equally probable, exceed with a probability of 5 %.
fn length(covariances: &[Matrix3<f64>], freedom: Option<f64>) -> Option<f64> {
    // The covariances have the variance of Student's distribution.
    let levels = match freedom {
        None => vec![1.0],
        Some(freedom) => noise_levels(freedom, NOISE_LEVELS)?,
    };
    let count = (covariances.len() * levels.len()) as f64;
    let lengths: Vec<_> = covariances.iter().map(SquaredLength::of).collect();
    let spare = |length: f64| {
        let square = length * length;
        let each = lengths.iter().flat_map(|own| {
            let within = move |level| own.as_ref().map_or(1.0, |own| own.within(square / level));
            levels.iter().map(within)
        });
        each.sum::<f64>() / count - COVERAGE
    };
    let variances = covariances.iter().map(Matrix3::trace);
    let mut high = variances.fold(0.0, f64::max).sqrt();
    while spare(high) < 0.0 {
        high *= 2.0;
    }
    let (mut low, mut below, mut above) = (0.0, -COVERAGE, spare(high));
    // Regula falsi (Illinois): an end that stays twice counts half.
    let mut last = 0.0;
    while above > CLOSE && below < -CLOSE {
        let length = (low * above - high * below) / (above - below);
        let found = spare(length);
        if found < 0.0 {
            above *= if last < 0.0 { 0.5 } else { 1.0 };
            (low, below) = (length, found);
        } else {
            below *= if last > 0.0 { 0.5 } else { 1.0 };
            (high, above) = (length, found);
        }
        last = found;
    }
    Some(if above > CLOSE { low } else { high }).filter(|own| own.is_finite())
}

/// Mean, rms and largest absolute value of each axis and of the length of vectors.
pub(crate) fn of_vectors(vectors: &[Vector3<f64>]) -> [[f64; 3]; 4] {
    let count = vectors.len().max(1) as f64;
    [0, 1, 2, 3].map(|axis| {
        let value = |own: &Vector3<f64>| if axis == 3 { own.norm() } else { own[axis] };
        let all = vectors.iter().map(value);
        let (sum, squares, most) = all.fold((0.0, 0.0, 0.0), |(sum, squares, most), own| {
            (sum + own, squares + own * own, f64::max(most, own.abs()))
        });
        let (mean, rms) = (sum / count, f64::sqrt(squares / count));
        // A mean that is rounding.
        let mean = if mean.abs() < 1e-9 * rms { 0.0 } else { mean };
        [mean, rms, most]
    })
}

#[cfg(test)]
mod tests {
    use super::length;
    use delta_cal_verify::check_figures;
    use nalgebra::{Matrix3, Vector3};

    /// Quantiles of the lengths: √7.8147 in space, √5.9915 in a plane and 1.95996 on a line (tables of χ² with 3, 2 and 1
    /// degrees of freedom); √(3 · 3.4105) with Student's noise of 10 degrees of freedom (F of 3 and 10), whose variance is
    /// larger by 10/8.
    #[test]
    fn lengths_are_quantiles_of_their_distribution() {
        for (axes, freedom, expected) in [
            ([1.0, 1.0, 1.0], None, 2.795_5),
            ([1.0, 1.0, 0.0], None, 2.447_7),
            ([1.0, 0.0, 0.0], None, 1.960_0),
            ([1.25, 1.25, 1.25], Some(10.0), 3.335_5),
        ] {
            let covariance = Matrix3::from_diagonal(&Vector3::from(axes));
            let found = length(&[covariance], freedom).unwrap();
            // Two equal eigenvalues and few levels of the noise are approximations.
            assert!((found / expected - 1.0).abs() < 0.01, "{axes:?}: {found}");
        }
        let page = [("k/space", 2.795_5 / 3_f64.sqrt()), ("k/line", 1.960_0)];
        check_figures("docs/accuracy.md", &page.map(|(name, k)| (name, k, 0.005)));
    }
}
