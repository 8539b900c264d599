//! The largest position error at the measured poses.

use super::deviations::RowDeviation;
use super::interval::{Bounded, TAIL};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// Of the rows, which are not none.
///
/// A deviation d is the error e plus noise n, whose standard deviation along any direction is at most s.
/// Along e the deviation is at least |e| + n·e/|e|, so that |e| is below d + 1.96 s in 97.5 % of all cases; the row
/// of the largest error is one row, whichever it is. And |e| is above d − |n|, for all rows at once with 97.5 %.
pub(super) fn largest(rows: &[RowDeviation]) -> Option<Bounded> {
    let number = rows.iter().fold(0.0, |count, _| count + 1.0);
    let worst = rows
        .iter()
        .max_by(|a, b| a.length().total_cmp(&b.length()))?;
    let known: Option<Vec<_>> = rows.iter().map(|row| Some((row, row.noise?))).collect();
    let Some(known) = known else {
        return Some(Bounded {
            value: worst.length(),
            lower: 0.0,
            upper: None,
        });
    };
    let along = Normal::standard().inverse_cdf(1.0 - TAIL);
    let anywhere = ChiSquared::new(3.0)
        .ok()?
        .inverse_cdf(1.0 - TAIL / number)
        .sqrt();
    let over = |of: &dyn Fn(f64, f64) -> f64| {
        let values = known
            .iter()
            .map(|(row, noise)| of(row.length(), noise.largest));
        values.fold(0.0, f64::max)
    };
    // Not of the largest deviation: near a singularity that may be noise alone.
    let value = known
        .iter()
        .map(|(row, noise)| row.deviation.norm_squared() - noise.mean_square)
        .fold(0.0, f64::max);
    Some(Bounded {
        value: value.sqrt(),
        lower: over(&|length, sigma| length - anywhere * sigma),
        upper: Some(over(&|length, sigma| length + along * sigma)),
    })
}
