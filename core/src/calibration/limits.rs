//! When a calibration is refused: limits common to all methods.

use crate::Real;

/// Parameters further from nominal than this many tolerances cause a refusal.
pub(crate) const LARGEST_TOLERANCES: f64 = 6.0;
/// Residuals beyond this quantile of the normal distribution contradict the stated noise: one valid calibration in
/// three million.
pub(crate) const LARGEST_DEVIATION: f64 = 5.0;
/// Additional margin on the stated variance: the noise is rarely known to better than 40 %, and the weights are
/// computed from the uncalibrated arm.
pub(crate) const NOISE_MARGIN: f64 = 2.0;
/// A parameter whose σ exceeds this fraction of the upper arm (or this many radians) counts as unknown.
pub const LARGEST_SIGMA: f64 = 0.1;
/// An iteration that fails with a condition number above this fails because of its poses: eight random poses have a
/// condition number of about 50, twenty of 9.
pub(crate) const CONDITION_OF_A_VALLEY: f64 = 1e4;
/// With the noise estimated from ν redundant samples, the parameters follow Student's t, whose variance exists above
/// two degrees of freedom.
pub const LEAST_FREEDOM: f64 = 2.0;
/// Two solutions are indistinguishable under a stated noise if they differ by less than this in Σ (f/σf)².
pub(crate) const INDISTINGUISHABLE: f64 = 4.0;
/// End points whose costs differ by less than this fraction of the better one tie: if two starts reach the same point,
/// the first is kept.
pub(crate) const TIE: f64 = 1e-3;
/// Two tied end points are the same point if the linear model's cost changes between them by at most this many ties.
pub(crate) const SAME_POINT: f64 = 16.0;
/// Of two solutions that fit equally well, the later is taken only if its squared distance from nominal is below this
/// fraction of the other's, so that rounding does not decide.
pub(crate) const NEARER: f64 = 0.999;
/// A free start is tried if the sum of squares exceeds its lower bound by more than this many residual variances: the
/// iteration may have ended in another minimum.
pub(crate) const EXCESS_OF_ANOTHER_MINIMUM: f64 = 50.0;
/// Samples needed for a free start: they determine the twelve coefficients c(P). With fewer there may be several
/// solutions.
pub(crate) const SAMPLES_FOR_FREE_START: u64 = 12;

/// A residual of this many scales is an outlier for any loss function: three in a million normal residuals are as
/// large. It is c of Tukey's loss.
pub const SUSPECTED: f64 = 4.685;

/// This many consecutive rejections by the gate are not a coincidence. If a share p of samples is wrong at random, a
/// run of m starts at any sample with probability (1 − p)pᵐ: once in half a million samples for a fifth, once in 2,500
/// for two fifths; noise alone never causes one. This many samples also determine an arm, so the next calibration can
/// start.
pub(crate) const REJECTIONS_OF_A_CHANGE: u64 = 8;
/// Up to one sample in this many may be wrong by accident. If the gate rejects more, the model or the stated noise is
/// wrong, and the accepted samples are merely those that happen to agree.
pub(crate) const MOST_REJECTED: u64 = 5;

/// The quantile of χ² with ν degrees of freedom at z = 5 standard deviations of the normal distribution, by Wilson and Hilferty (1931): ν (1 − 2/(9ν) + z √(2/(9ν)))³.
pub fn chi_square_quantile<T: Real>(freedom: T) -> T {
    let spread = T::from_f64(2.0 / 9.0) / freedom;
    let root = T::ONE - spread + T::from_f64(LARGEST_DEVIATION) * spread.square_root();
    freedom * root * root * root
}

#[cfg(test)]
mod tests {
    use super::{LARGEST_DEVIATION, chi_square_quantile};

    /// P(χ² > x) for an even number of degrees of freedom: e^(−x/2) Σ (x/2)ᵏ/k!, k below half of it.
    fn beyond(x: f64, freedom: u32) -> f64 {
        let half = x / 2.0;
        let (mut term, mut sum) = (libm::exp(-half), 0.0);
        for k in 1..=freedom / 2 {
            sum += term;
            term *= half / f64::from(k);
        }
        sum
    }

    #[test]
    fn the_quantile_is_where_a_normal_number_exceeds_five() {
        let five_sigma = 0.5 * libm::erfc(LARGEST_DEVIATION / core::f64::consts::SQRT_2);
        for freedom in [8, 12, 20, 52, 100, 300] {
            let quantile = chi_square_quantile(f64::from(freedom));
            let probability = beyond(quantile, freedom);
            // Wilson and Hilferty's approximation is slightly too large in this tail: by 3.3 % of the quantile for 8
            // degrees of freedom, less for more.
            assert!(
                (0.5..1.0).contains(&(probability / five_sigma)),
                "{freedom}: {probability:e}"
            );
        }
        // The next-order approximation for large ν: ν + z √(2ν) + 2/3 (z² − 1).
        let large = 1e6_f64;
        let expected = large + 5.0 * libm::sqrt(2.0 * large) + 16.0;
        assert!((chi_square_quantile(large) - expected).abs() < 0.1);
    }
}
