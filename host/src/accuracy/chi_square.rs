//! Quantiles of χ², also of millions of degrees of freedom.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// Above it the library's search for a quantile is less exact, and above some millions it does not end.
const MANY_DEGREES: f64 = 1e4;

/// What χ² is below with this probability; `None` without degrees of freedom.
///
/// Of many degrees of freedom by the cube of a normal quantile (Wilson and Hilferty 1931), within 2e-6 of itself.
pub(crate) fn quantile(freedom: f64, probability: f64) -> Option<f64> {
    if freedom > MANY_DEGREES {
        let part = 2.0 / (9.0 * freedom);
        let normal = Normal::standard().inverse_cdf(probability);
        return Some(freedom * (1.0 - part + normal * part.sqrt()).powi(3));
    }
    Some(ChiSquared::new(freedom).ok()?.inverse_cdf(probability))
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
            // The error of the cube for a probability of 0.0001, at the fewest degrees of freedom.
            assert!((found / expected - 1.0).abs() < 2e-6, "{freedom}: {found}");
        }
        assert_eq!(quantile(0.0, 0.5), None);
    }
}
