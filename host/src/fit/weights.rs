//! What a fit returns.

use crate::fit::outcome::Outcome;

/// What a fit makes of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleWeight {
    /// What it counts, 0 to 1; of the IKM method the least of the three arms' weights.
    pub weight: f64,
    /// Whether it disagrees so much with the others that it does not count at all.
    pub suspected: bool,
}

impl SampleWeight {
    /// As the squared loss counts every sample.
    pub(crate) const FULL: Self = Self {
        weight: 1.0,
        suspected: false,
    };
}

/// What a fit returns: the robot, and what it made of each sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The robot.
    pub outcome: Outcome,
    /// Every sample by itself, in their order.
    pub samples: Vec<SampleWeight>,
    /// Whether the weights of a robust fit settled; other fits have none that could change.
    pub settled: bool,
}

impl Fit {
    /// Every sample counts alike.
    pub(crate) fn plain(outcome: Outcome, samples: usize) -> Self {
        Self {
            outcome,
            samples: vec![SampleWeight::FULL; samples],
            settled: true,
        }
    }
}
