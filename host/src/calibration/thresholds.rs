//! From where on something is said of a calibration.

/// A parameter is the tolerance's rather than the samples' beyond this share.
pub const MOSTLY: f64 = 0.5;
/// Without a tolerance, fewer samples than this may have several solutions.
pub(crate) const FEW_SAMPLES: usize = 12;
/// Below it a condition is good. Above, the parameters are known a hundred times worse than each
/// alone would be.
pub const GOOD_CONDITION: f64 = 100.0;
