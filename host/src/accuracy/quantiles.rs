//! Quantiles of χ², and from a standard uncertainty to an expanded one.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};

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

/// Of a normal distribution, within two standard deviations: the probability that k = 2 stands for.
const LEVEL: f64 = 0.9545;
/// Below, a Student distribution has no variance.
const LEAST_FREEDOM: f64 = 2.0;

/// Of a noise that is stated.
const STATED: f64 = 2.0;

/// k, by which a standard uncertainty is multiplied for the expanded uncertainty of 95 % (GUM, 6.2 and G.3).
///
/// Of a noise that was estimated with these degrees of freedom ν it is Student's: the standard uncertainties of a
/// calibration are that distribution's standard deviations, and contain √(ν/(ν − 2)) already. `None` where it has none.
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
            // The error of the cube for a probability of 0.0001, at the fewest degrees of freedom.
            assert!((found / expected - 1.0).abs() < 2e-6, "{freedom}: {found}");
        }
        assert_eq!(quantile(0.0, 0.5), None);
    }
}
