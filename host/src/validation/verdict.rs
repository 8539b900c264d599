//! What the figures say of the limits.

use super::interval::{Bounded, RmsError};

/// More poses than this nobody measures to decide a limit.
const MANY: f64 = 10_000.0;

/// Whether the robot meets a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// The upper confidence limit is not above the limit.
    Pass,
    /// The limit lies within the confidence interval.
    Undecided,
    /// The lower confidence limit is above the limit.
    Fail,
}

impl Verdict {
    /// As it is written: `pass`, `undecided` or `fail`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Undecided => "undecided",
            Self::Fail => "fail",
        }
    }

    pub(super) fn of(figure: &Bounded, limit: f64) -> Self {
        if figure.upper.is_some_and(|upper| upper <= limit) {
            Self::Pass
        } else if figure.lower > limit {
            Self::Fail
        } else {
            Self::Undecided
        }
    }
}

/// How many poses would decide an rms error that is undecided, if they scatter as those measured; `None` if too
/// many, or if none would.
pub(super) fn poses_to_decide(error: &RmsError, measured: usize, limit: f64) -> Option<usize> {
    #[allow(clippy::cast_precision_loss)] // poses
    let decided = |poses: f64| Verdict::of(&error.bounded_by(poses), limit) != Verdict::Undecided;
    #[allow(clippy::cast_precision_loss)] // poses
    let (mut too_few, mut enough) = (measured as f64, MANY);
    if too_few >= enough || !decided(enough) {
        return None;
    }
    while enough - too_few > 1.0 {
        let middle = f64::midpoint(too_few, enough).floor();
        if decided(middle) {
            enough = middle;
        } else {
            too_few = middle;
        }
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // at most 10,000
    Some(enough as usize)
}
