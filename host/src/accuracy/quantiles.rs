//! Medians and quantiles of χ².

use crate::order;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// The median, the upper of two; `None` of nothing.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    order::sort(&mut values);
    values.get(values.len() / 2).copied()
}

/// Above this the library's quantile search loses precision, and above some millions it does not terminate.
const MANY_DEGREES: f64 = 1e4;

/// Quantile of χ² at this probability; `None` without degrees of freedom.
///
/// For many degrees of freedom, the cube of a normal quantile (Wilson and Hilferty 1931), within 2e-6 of its value.
pub(crate) fn quantile(freedom: f64, probability: f64) -> Option<f64> {
    if freedom > MANY_DEGREES {
        let part = 2.0 / (9.0 * freedom);
        let normal = Normal::standard().inverse_cdf(probability);
        return Some(freedom * (1.0 - part + normal * part.sqrt()).powi(3));
    }
    let found = ChiSquared::new(freedom).ok()?.inverse_cdf(probability);
    // The library's search fails for some degrees of freedom near 1.
    (found > 0.0).then_some(found)
}

/// Factors of the variances of Student's distribution in this many equally probable cases of an estimated noise; `None` with
/// two degrees of freedom or fewer, which have no variance.
pub(crate) fn noise_levels(freedom: f64, count: u32) -> Option<Vec<f64>> {
    let spare = freedom - 2.0;
    if !(spare > 0.0) {
        return None;
    }
    let level = |level: u32| {
        let probability = (f64::from(level) + 0.5) / f64::from(count);
        Some(spare / quantile(freedom, probability)?)
    };
    (0..count).map(level).collect()
}

#[cfg(test)]
mod tests {
    use super::quantile;

    /// SciPy 1.17: `chi2.ppf(p, f)`.
    #[test]
    fn quantiles_of_few_and_of_many_degrees_of_freedom_are_those_of_scipy() {
        for (freedom, probability, expected) in [
            (1e4, 0.025, 9_724.718_377_389_798),
            (1.000_01e4, 0.0001, 9_482.682_784_948_587),
            (1e5, 0.975, 100_878.415_305_665_58),
            (1.000_001e5, 0.0001, 98_345.452_145_652_26),
            (3e6, 0.025, 2_995_200.982_910_247),
            (3e6, 0.975, 3_004_802.805_701_332_6),
        ] {
            let found = quantile(freedom, probability).unwrap_or(f64::NAN);
            // Error of the approximation for a probability of 0.0001, at its fewest degrees of freedom.
            assert!((found / expected - 1.0).abs() < 2e-6, "{freedom}: {found}");
        }
        assert_eq!(quantile(0.0, 0.5), None);
    }
}
