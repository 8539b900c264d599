//! The rms and the largest position error with confidence intervals, and whether they meet a limit.

use crate::accuracy::quantiles::quantile;
use nalgebra::Vector3;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// Probability outside either end of an interval: 5 % in total.
const TAIL: f64 = 0.025;
/// Prior knowledge of the variation (the variance of a squared deviation over its squared mean), relative to that of
/// independent normal numbers, 2 / (numbers per pose), and its weight as a number of poses. The variance of a few poses
/// alone is too often too small, which makes the interval too short. Determined by the simulation in docs/validate.md.
const VARIATION: f64 = 1.0;
const POSES: f64 = 15.0;
/// The error left after fitting a rigid motion or a plane is small mid-region and large at the edge.
const VARIATION_FITTED: f64 = 2.0;
const POSES_FITTED: f64 = 30.0;

/// Number of readings.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Read {
    /// Numbers per pose: 3 for a position, 1 for a height.
    pub(super) coordinates: f64,
    /// Total number used up by fitting the frame and the instruments.
    pub(super) taken_up: f64,
    /// The variance of the squared error over its squared mean that errors of the parameters lead to where the poses are, and
    /// the same of the noise: large at steep edges, of which the poses' own scatter tells too little.
    pub(super) variation: [f64; 2],
}

/// A figure with its 95 % confidence limits, mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bounded {
    /// The estimate.
    #[serde(rename = "estimate_mm")]
    pub value: f64,
    /// Lower limit, 0 if the noise is unknown, and upper limit, `None` if the noise is unknown and leaves none.
    #[serde(rename = "interval_mm")]
    pub interval: (f64, Option<f64>),
}

/// The rms position error over the region sampled by the poses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RmsError {
    /// The estimate with its 95 % limits.
    #[serde(flatten)]
    pub error: Bounded,
    /// Effective number, of the interval.
    pub degrees_of_freedom: f64,
    /// The limit.
    pub limit_mm: f64,
    /// The confidence that the error is below the limit: that of the one-sided interval ending at it, 0 to 1.
    pub confidence_below_limit: f64,
    /// Total number of poses that would decide an undecided verdict, if any would.
    pub poses_to_decide: Option<usize>,
}

/// The error and its limits from squared deviations, one per pose, and the mean square of the noise in them, mm²; compared
/// with a limit, mm.
///
/// The mean of the n squared deviations yₖ is M = E² + σ², where E is the unknown error and σ² the mean square of the noise.
/// M is distributed about its expectation as χ²(ν)/ν with ν = 2n/c, where c is the variance of y over its squared mean
/// (Satterthwaite). The estimate of c from the poses is averaged with the prior one.
pub(super) fn rms_error(squares: &[f64], noise: f64, read: Read, limit: f64) -> RmsError {
    let (variation, weight) = if read.taken_up > 0.0 {
        (VARIATION_FITTED, POSES_FITTED)
    } else {
        (VARIATION, POSES)
    };
    let poses = squares.len() as f64;
    let square = squares.iter().sum::<f64>() / poses;
    let expected = variation * 2.0 / read.coordinates;
    let scatter: f64 = squares.iter().map(|own| (own - square).powi(2)).sum();
    let measured = if square > 0.0 {
        scatter / square.powi(2)
    } else {
        0.0
    };
    let variation = (weight * expected + measured) / (weight + poses - 1.0);
    let of_error = (1.0 - noise / square).max(0.0);
    let [error, of_noise] = read.variation;
    let variation = variation.max(of_error * error + (1.0 - of_error) * of_noise);
    // Reduced in proportion to the readings used up by the frame and the instruments.
    let freedom_of = |poses: f64| 2.0 * (poses - read.taken_up / read.coordinates) / variation;
    // Deviations that are smaller than the noise by chance do not prove an error smaller than this many poses can show with
    // this noise.
    let at_least_noise = square.max(noise);
    let without_noise = |mean_square: f64| (mean_square - noise).max(0.0).sqrt();
    let bounded = |poses: f64| {
        let freedom = freedom_of(poses);
        let limit = |mean_square: f64, probability: f64| {
            let quantile = quantile(freedom, probability)?;
            Some(without_noise(freedom * mean_square / quantile))
        };
        let lower = (noise > 0.0).then(|| limit(square, 1.0 - TAIL));
        Bounded {
            value: without_noise(square),
            interval: (lower.flatten().unwrap_or(0.0), limit(at_least_noise, TAIL)),
        }
    };
    let freedom = freedom_of(poses);
    let ratio = at_least_noise / (limit * limit + noise);
    let confidence = ChiSquared::new(freedom).map(|own| own.sf(freedom * ratio));
    RmsError {
        error: bounded(poses),
        degrees_of_freedom: freedom,
        limit_mm: limit,
        confidence_below_limit: confidence.unwrap_or(0.0),
        poses_to_decide: least_deciding(poses, |poses| {
            Verdict::of(&bounded(poses), limit) != Verdict::Undecided
        }),
    }
}

/// Nobody measures more poses than this to decide a limit.
const MANY: f64 = 10_000.0;

/// The least number of poses that would decide, assuming the same scatter; `None` if these do, if it takes too many, or no
/// number would.
fn least_deciding(poses: f64, decide: impl Fn(f64) -> bool) -> Option<usize> {
    let (mut too_few, mut enough) = (poses, MANY);
    if decide(too_few) || too_few >= enough || !decide(enough) {
        return None;
    }
    while enough - too_few > 1.0 {
        let middle = f64::midpoint(too_few, enough).floor();
        if decide(middle) {
            enough = middle;
        } else {
            too_few = middle;
        }
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // at most 10,000
    Some(enough as usize)
}

/// The largest position error at the measured poses.
///
/// A deviation d is the error e plus noise n, whose standard deviation along any direction is at most s. Along e the
/// deviation is at least |e| + n·e/|e|, so |e| is below d + 1.96 s with 97.5 % probability; this holds for the row of
/// the largest error, as for any single row. And |e| is above d − |n|, for all rows at once with 97.5 %.
pub(super) fn largest(rows: &[Deviation]) -> Bounded {
    let along = Normal::standard().inverse_cdf(1.0 - TAIL);
    let anywhere = quantile(3.0, 1.0 - TAIL / rows.len() as f64).map(f64::sqrt);
    let known: Option<Vec<_>> = rows.iter().map(|row| Some((row, row.noise?))).collect();
    let (Some(known), Some(anywhere)) = (known, anywhere) else {
        return Bounded {
            value: rows.iter().map(|row| row.deviation_mm).fold(0.0, f64::max),
            interval: (0.0, None),
        };
    };
    let over = |of: &dyn Fn(f64, &RowNoise) -> f64| {
        let values = known.iter().map(|(row, noise)| of(row.deviation_mm, noise));
        values.fold(0.0, f64::max)
    };
    // Not that of the largest deviation, which may be mere noise near a singularity.
    let square = over(&|deviation, noise| deviation.powi(2) - noise.mean_square);
    Bounded {
        value: square.sqrt(),
        interval: (
            over(&|deviation, noise| deviation - anywhere * noise.largest),
            Some(over(&|deviation, noise| deviation + along * noise.largest)),
        ),
    }
}

/// Whether the robot meets a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The upper confidence limit is not above the limit.
    Pass,
    /// The limit lies within the confidence interval.
    Undecided,
    /// The lower confidence limit is above the limit.
    Fail,
    /// Something happened during the measurement; the figures are of the rows before it.
    NotJudged,
}

impl Verdict {
    /// As in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Undecided => "undecided",
            Self::Fail => "fail",
            Self::NotJudged => "not_judged",
        }
    }

    pub(super) fn of(figure: &Bounded, limit: f64) -> Self {
        if figure.interval.1.is_some_and(|upper| upper <= limit) {
            Self::Pass
        } else if figure.interval.0 > limit {
            Self::Fail
        } else {
            Self::Undecided
        }
    }
}

/// The instrument's and the joints' noise in a deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowNoise {
    /// The trace of its covariance, mm².
    pub(super) mean_square: f64,
    /// The largest standard deviation along any direction, mm.
    pub(super) largest: f64,
    /// |L⁻¹ d|² of the deviation d, with L Lᵀ the covariance.
    pub(super) squares: f64,
}

/// The deviation of one row.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Deviation {
    /// Line in the samples file.
    pub line: u64,
    /// Distance between measured and computed position, including the instrument's noise.
    pub deviation_mm: f64,
    /// Radians, or mm of travel.
    #[serde(skip)]
    pub(super) joints: [f64; 3],
    /// In the robot's frame, mm.
    #[serde(skip)]
    pub(super) position: Vector3<f64>,
    /// Fraction of the row's own deviation absorbed by fitting a frame, 0 to 1.
    #[serde(skip)]
    pub(super) leverage: f64,
    /// `None` if no noise is stated.
    #[serde(skip)]
    pub(super) noise: Option<RowNoise>,
}

impl Deviation {
    /// Whether the stated noise explains the deviation: with no error of the robot, only one file in a hundred has a
    /// row that deviates more.
    pub(super) fn is_noise(&self, rows: usize) -> bool {
        let limit = quantile(3.0, 1.0 - 0.01 / rows as f64);
        let noise = self.noise.zip(limit);
        noise.is_some_and(|(noise, limit)| noise.squares < limit)
    }

    /// The squared deviation that the row would have without the fitted frame, mm².
    pub(super) fn square(&self) -> f64 {
        self.deviation_mm.powi(2) / (1.0 - self.leverage).max(f64::EPSILON)
    }
}

#[cfg(test)]
mod tests {
    use super::{Read, rms_error};

    /// Deviations smaller than the noise are chance: the upper limit is the same as for deviations equal to the noise.
    #[test]
    fn deviations_below_the_noise_do_not_prove_that_there_is_no_error() {
        let noise = 4e-4;
        let read = Read {
            coordinates: 3.0,
            ..Read::default()
        };
        let of = |square: f64| rms_error(&[square; 20], noise, read, 0.005);
        let (less, expected) = (of(0.25 * noise), of(noise));
        let upper = less.error.interval.1;
        assert!(upper > Some(0.1 * f64::sqrt(noise)), "{upper:?}");
        assert_eq!(upper, expected.error.interval.1);
        assert!((less.error.interval.0, less.error.value) == (0.0, 0.0));
        let confidence = [less, expected].map(|own| own.confidence_below_limit.to_bits());
        assert_eq!(confidence[0], confidence[1]);
        assert!(of(2.0 * noise).error.interval.1 > upper);
    }
}
