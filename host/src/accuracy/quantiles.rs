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

/// Of a normal distribution, within two standard deviations: the probability that k = 2 stands for.
const LEVEL: f64 = 0.9545;
/// Below, a Student distribution has no variance.
const LEAST_FREEDOM: f64 = 2.0;

/// By what a standard uncertainty is multiplied for the expanded uncertainty of 95 % (GUM, 6.2 and G.3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoverageFactor {
    /// k.
    pub factor: f64,
    /// With which the noise was estimated; `None` if it is stated.
    pub degrees_of_freedom: Option<f64>,
}

/// An uncertainty of the position, expanded: mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpandedUncertainty {
    /// By what the standard uncertainty was multiplied.
    pub coverage: CoverageFactor,
    /// The root mean square over the workspace.
    pub rms: f64,
    /// At the worst place.
    pub worst: f64,
}

/// A limit of the expanded uncertainty, and whether it is met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Acceptance {
    /// The largest rms that is accepted, mm.
    pub limit: f64,
    /// The expanded rms that was compared; `None` if the uncertainty is not known.
    pub expanded: Option<f64>,
    /// Whether it is the relative positions' and not that in the base frame.
    pub relative: bool,
}

impl Acceptance {
    /// An uncertainty that is not known meets no limit.
    pub fn passed(&self) -> bool {
        self.expanded.is_some_and(|expanded| expanded <= self.limit)
    }
}

impl CoverageFactor {
    /// Of a noise that is stated.
    pub const STATED: Self = Self {
        factor: 2.0,
        degrees_of_freedom: None,
    };

    /// Of a noise that was estimated with these degrees of freedom ν, from Student's distribution. The standard
    /// uncertainties of a calibration are that distribution's standard deviations, and contain √(ν/(ν − 2))
    /// already. `None` where it has none.
    pub fn estimated(freedom: f64) -> Option<Self> {
        if !(freedom > LEAST_FREEDOM) {
            return None;
        }
        let student = StudentsT::new(0.0, 1.0, freedom).ok()?;
        let quantile = student.inverse_cdf(f64::midpoint(1.0, LEVEL));
        let factor = quantile * ((freedom - LEAST_FREEDOM) / freedom).sqrt();
        factor.is_finite().then_some(Self {
            factor,
            degrees_of_freedom: Some(freedom),
        })
    }

    /// The expanded uncertainty of these standard uncertainties.
    pub const fn expanded(self, rms: f64, worst: f64) -> ExpandedUncertainty {
        ExpandedUncertainty {
            coverage: self,
            rms: self.factor * rms,
            worst: self.factor * worst,
        }
    }
}
