//! Where a calibration is refused: the limits that every method shares.

pub use super::loss::SUSPECTED;
pub use super::robust::{LARGEST_SUSPECTED, SAMPLES_FOR_ROBUST_FIT};

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
/// Without a guess so many samples are needed: they determine the twelve coefficients c(P). With
/// fewer there may be several solutions.
pub const SAMPLES_FOR_FREE_START: u64 = 12;

/// The quantile of χ² with ν degrees of freedom at [`LARGEST_DEVIATION`], by Wilson and Hilferty:
/// ν (1 − 2/(9ν) + z √(2/(9ν)))³.
pub fn chi_square_quantile<T: Real>(freedom: T) -> T {
    let spread = T::from_f64(2.0 / 9.0) / freedom;
    let root = T::ONE - spread + T::from_f64(LARGEST_DEVIATION) * spread.square_root();
    freedom * root * root * root
}

/// How many samples a calibration with these settings needs: 8, 12 without a guess, 1 with a
/// tolerance.
pub fn samples_needed<T: Real>(settings: &super::Settings<T>) -> u64 {
    match (settings.start, settings.tolerance) {
        (super::Start::Free, _) => SAMPLES_FOR_FREE_START,
        (super::Start::Reference, None) => 8,
        (super::Start::Reference, Some(_)) => 1,
    }
}

#[cfg(test)]
mod tests;
