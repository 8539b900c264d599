//! Distances that stand out among the others.

/// A sample this many times as far off as the median sample is an outlier. The distances scatter with
/// the noise and with the pose, by less than this.
pub const OUTLIER: f64 = 6.0;

/// A sample this many times as far off as the median sample is tried without: leaving out a good one
/// does no harm.
pub(crate) const SUSPECT: f64 = 4.0;
