//! What a fit returns.

use crate::fit::outcome::Outcome;

/// What the samples count in a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    /// By what each sample's squared residuals are multiplied.
    pub factors: Vec<f64>,
    /// What all samples are worth together.
    pub effective_samples: f64,
}

impl Weights {
    /// Every sample counts alike.
    pub(crate) fn full(samples: usize) -> Self {
        Self::of(vec![1.0; samples])
    }

    /// As these factors say, and no other.
    pub(crate) fn of(factors: Vec<f64>) -> Self {
        Self {
            effective_samples: factors.iter().sum(),
            factors,
        }
    }

    /// Whether every sample counts alike.
    #[allow(clippy::float_cmp)] // as they were set
    pub(crate) fn is_full(&self) -> bool {
        self.factors.iter().all(|factor| *factor == 1.0)
    }

    /// The mean factor of the samples that count at all.
    pub(crate) fn mean_of_counted(&self) -> f64 {
        let (mut count, mut sum) = (0.0, 0.0);
        for factor in self.factors.iter().filter(|factor| **factor > 0.0) {
            count += 1.0;
            sum += factor;
        }
        if count > 0.0 { sum / count } else { 0.0 }
    }
}

/// What a fit makes of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleWeight {
    /// What it counts, 0 to 1. With forgetting, what the estimate remembers of it.
    pub weight: f64,
    /// What forgetting leaves of it, 0 to 1; 1 without.
    pub remembered: f64,
    /// Whether it disagrees so much with the others that it does not count at all.
    pub suspected: bool,
}

impl SampleWeight {
    /// A gate did not take it in.
    const REJECTED: Self = Self {
        weight: 0.0,
        remembered: 1.0,
        suspected: true,
    };

    /// As the squared loss counts every sample.
    pub(crate) const FULL: Self = Self {
        weight: 1.0,
        remembered: 1.0,
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
    /// Every sample counts as it was weighed.
    pub(crate) fn weighed(outcome: Outcome, weights: &Weights) -> Self {
        let factors = weights.factors.iter();
        Self {
            outcome,
            samples: factors
                .map(|factor| SampleWeight {
                    weight: *factor,
                    remembered: *factor,
                    suspected: false,
                })
                .collect(),
            settled: true,
        }
    }

    /// Marks the samples that a gate did not take in.
    pub(crate) fn reject(&mut self, rejected: &[bool]) {
        for (sample, rejected) in self.samples.iter_mut().zip(rejected) {
            if *rejected {
                *sample = SampleWeight::REJECTED;
            }
        }
    }

    /// Every sample counts alike.
    pub(crate) fn plain(outcome: Outcome, samples: usize) -> Self {
        Self {
            outcome,
            samples: vec![SampleWeight::FULL; samples],
            settled: true,
        }
    }
}
