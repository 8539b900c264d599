//! What a fit returns.

use crate::fit::outcome::Outcome;
use crate::fit::samples::Samples;

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

/// What a fit makes of samples that are too many for the memory.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightsOnDisk {
    /// Of each sample by what its squared residuals are multiplied; 1 if there are none.
    pub(super) factors: Vec<f64>,
    /// By what the weights were divided for that.
    pub(super) divisor: f64,
    /// What forgetting leaves of each; 1 if there are none.
    pub(super) remembered: Vec<f64>,
    /// Which do not count; none if there are none.
    pub(super) suspected: Vec<bool>,
}

impl WeightsOnDisk {
    const FULL: Self = Self {
        factors: Vec::new(),
        divisor: 1.0,
        remembered: Vec::new(),
        suspected: Vec::new(),
    };

    /// Of the sample at an index.
    pub(crate) fn get(&self, index: usize) -> SampleWeight {
        let weight = self
            .factors
            .get(index)
            .map_or(1.0, |own| own * self.divisor);
        SampleWeight {
            weight,
            remembered: self.remembered.get(index).copied().unwrap_or(1.0),
            suspected: self.suspected.get(index).copied().unwrap_or(false),
        }
    }
}

/// What a fit returns: the robot, and what it made of each sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The robot.
    pub outcome: Outcome,
    /// Every sample in memory by itself, in their order.
    pub samples: Vec<SampleWeight>,
    /// Every sample, if they are too many for the memory.
    pub all: Option<WeightsOnDisk>,
    /// Whether the weights of a robust fit settled; other fits have none that could change.
    pub settled: bool,
}

impl Fit {
    /// Every sample counts as it was weighed.
    pub(crate) fn weighed(outcome: Outcome, samples: Samples<'_>, weights: &Weights) -> Self {
        let all = WeightsOnDisk {
            factors: weights.factors.clone(),
            remembered: weights.factors.clone(),
            ..WeightsOnDisk::FULL
        };
        Self::on_disk(outcome, samples, all, true)
    }

    /// Every sample counts alike.
    pub(crate) fn plain(outcome: Outcome, samples: Samples<'_>) -> Self {
        Self::on_disk(outcome, samples, WeightsOnDisk::FULL, true)
    }

    /// As all samples count, of which some may be on disk.
    pub(super) fn on_disk(
        outcome: Outcome,
        samples: Samples<'_>,
        all: WeightsOnDisk,
        settled: bool,
    ) -> Self {
        let places = samples.places_in_memory();
        Self {
            outcome,
            samples: places.map(|index| all.get(index)).collect(),
            all: samples.is_on_disk().then_some(all),
            settled,
        }
    }

    /// What it made of the sample at an index.
    pub(crate) fn weight(&self, index: usize) -> SampleWeight {
        match &self.all {
            Some(all) => all.get(index),
            None => self
                .samples
                .get(index)
                .copied()
                .unwrap_or(SampleWeight::FULL),
        }
    }

    /// Marks the samples that a gate did not take in.
    pub(crate) fn reject(&mut self, samples: Samples<'_>, rejected: &[bool]) {
        for (sample, index) in self.samples.iter_mut().zip(samples.places_in_memory()) {
            if rejected.get(index) == Some(&true) {
                *sample = SampleWeight::REJECTED;
            }
        }
        if let Some(all) = &mut self.all {
            all.suspected.resize(rejected.len(), false);
            for (own, rejected) in all.suspected.iter_mut().zip(rejected) {
                *own |= *rejected;
            }
        }
    }
}
