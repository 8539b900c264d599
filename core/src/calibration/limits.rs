//! Where a calibration is refused: the limits that every method shares.

use crate::Real;

/// Parameters further from nominal than this many tolerances are refused.
pub const LARGEST_TOLERANCES: f64 = 6.0;
/// A stated noise is contradicted beyond this quantile of the normal distribution: one true
/// calibration in three million.
pub const LARGEST_DEVIATION: f64 = 5.0;
/// Variance by which a stated noise may be exceeded besides: it is rarely known to better than 40 %,
/// and the weights come from the arm before calibration.
pub const NOISE_MARGIN: f64 = 2.0;
/// A parameter known no better than this part of the upper arm (or this many radians) is not known.
pub const LARGEST_SIGMA: f64 = 0.1;
/// An iteration that fails at a worse condition than this fails because of its poses: eight random
/// poses have a condition of some 50, twenty of 9.
pub const CONDITION_OF_A_VALLEY: f64 = 1e4;
/// A noise estimated from ν spare samples leaves the parameters distributed as Student's t, whose
/// variance exists beyond two degrees of freedom.
pub const LEAST_FREEDOM: f64 = 2.0;
/// Two solutions that a stated noise cannot tell apart differ by less than this in Σ (f/σf)².
pub const INDISTINGUISHABLE: f64 = 4.0;
/// Costs of two end points that differ by less than this part of the better one are a tie: of two starts
/// that end in the same point the first is kept.
pub const TIE: f64 = 1e-3;
/// Two end points of a tie are the same point if the linear model's cost changes between them by at most
/// so many ties.
pub const SAME_POINT: f64 = 16.0;
/// Of two solutions that fit equally well the later one is taken only if the square of its distance from
/// nominal is below this part of the other's: nearer, by more than rounding.
pub const NEARER: f64 = 0.999;
/// A start without a guess is tried if the sum of squares is above its lower bound by more than so many
/// variances of a residual: the iteration may have ended in another minimum.
pub const EXCESS_OF_ANOTHER_MINIMUM: f64 = 50.0;
/// Without a guess so many samples are needed: they determine the twelve coefficients c(P). With
/// fewer there may be several solutions.
pub const SAMPLES_FOR_FREE_START: u64 = 12;

/// A residual of this many scales is no measurement's, whatever the loss: of normal residuals three
/// in a million are as large. It is c of Tukey's loss.
pub const SUSPECTED: f64 = 4.685;

/// So many samples in a row that the gate rejects are no accident. Where wrong samples come at random, a
/// share p of all, a run of m begins with probability (1 − p)pᵐ at any sample: with a fifth of them wrong
/// once in half a million samples, with two fifths once in 2,500; by the noise alone never. And so
/// many samples determine an arm: the next calibration can begin.
pub const REJECTIONS_OF_A_CHANGE: u64 = 8;
/// One sample in so many may be wrong by accident. Where the gate rejects more, it is the model that does not hold, or the
/// stated noise, and the samples that it took are those that happen to agree.
pub const MOST_REJECTED: u64 = 5;

/// The quantile of χ² with ν degrees of freedom at [`LARGEST_DEVIATION`].
pub fn chi_square_quantile<T: Real>(freedom: T) -> T {
    chi_square_bound(freedom, T::from_f64(LARGEST_DEVIATION))
}

/// The quantile of χ² with ν degrees of freedom that is as improbable as z is for the normal
/// distribution, by Wilson and Hilferty (1931): ν (1 − 2/(9ν) + z √(2/(9ν)))³.
///
/// ```
/// // 3.0902 is exceeded once in a thousand times.
/// let bound = delta_cal::calibration::limits::chi_square_bound(10.0, 3.0902_f64);
/// assert!((bound - 29.588).abs() < 0.2);
/// ```
pub fn chi_square_bound<T: Real>(freedom: T, deviations: T) -> T {
    let spread = T::from_f64(2.0 / 9.0) / freedom;
    let root = T::ONE - spread + deviations * spread.square_root();
    freedom * root * root * root
}

#[cfg(test)]
mod tests {
    use super::{LARGEST_DEVIATION, chi_square_quantile};

    /// P(χ² > x) with an even number of degrees of freedom: e^(−x/2) Σ (x/2)ᵏ/k!, k below half of it.
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
            // Wilson and Hilferty's approximation is a little too large this far out: by 3.3 % of the
            // quantile for 8 degrees of freedom, by less for more.
            assert!(
                (0.5..1.0).contains(&(probability / five_sigma)),
                "{freedom}: {probability:e}"
            );
        }
        // The next better approximation: ν + z √(2ν) + 2/3 (z² − 1), of large ν.
        let large = 1e6_f64;
        let expected = large + 5.0 * libm::sqrt(2.0 * large) + 16.0;
        assert!((chi_square_quantile(large) - expected).abs() < 0.1);
    }
}
