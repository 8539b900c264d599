//! Medians, quantiles of χ², and coverage factors.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};

/// The median, the upper of two; `None` of nothing.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
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

/// Probability of a normal distribution within two standard deviations, for which k = 2.
const LEVEL: f64 = 0.9545;
/// Up to this, Student's distribution has no variance.
const LEAST_FREEDOM: f64 = 2.0;

/// k for a stated noise.
const STATED: f64 = 2.0;

/// The coverage factor k for an expanded uncertainty of 95 % (GUM, 6.2 and G.3).
///
/// For a noise estimated with ν degrees of freedom, k is Student's: the standard uncertainties of a calibration are
/// that distribution's standard deviations and already include √(ν/(ν − 2)). `None` where it has none.
pub(crate) fn coverage_factor(estimated_freedom: Option<f64>) -> Option<f64> {
    let Some(freedom) = estimated_freedom else {
        return Some(STATED);
    };
    if !(freedom > LEAST_FREEDOM) {
        return None;
    }
    let student = StudentsT::new(0.0, 1.0, freedom).ok()?;
    let quantile = student.inverse_cdf(f64::midpoint(1.0, LEVEL));
    let factor = quantile * ((freedom - LEAST_FREEDOM) / freedom).sqrt();
    factor.is_finite().then_some(factor)
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
