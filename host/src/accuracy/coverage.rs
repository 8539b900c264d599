//! From a standard uncertainty to an expanded one.

use statrs::distribution::{ContinuousCDF, StudentsT};

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
