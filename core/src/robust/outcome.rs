use crate::Real;
use crate::calibration::{JointOutcome, Refusal};
use crate::samples::SampleError;
use core::fmt;

/// A robot calibrated by a robust fit, of which `F` is the outcome.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct RobustOutcome<T: Real, F = JointOutcome<T>> {
    /// As of the plain fit, with the samples' weights: their number is that of the samples with a
    /// weight above 0, and the covariance is the M-estimate's, mean ψ² / (mean ψ′)² · (JᵀJ)⁻¹, with the
    /// noise as stated or as estimated from the weighted residuals (see [`WeightNormalization`](crate::robust::WeightNormalization)).
    pub fit: F,
    /// What the samples are worth together, by which the weighted sum of squares is divided.
    pub effective_samples: T,
    /// s of the last round: by it the residuals are divided before they are weighed.
    pub scale: T,
    /// κ of the last round, by which the weights are divided (see
    /// [`WeightNormalization`](crate::robust::WeightNormalization)).
    pub divisor: T,
    /// How many samples are [suspected](crate::robust::WeighedSample::suspected).
    pub suspected: usize,
    /// Rounds of reweighting.
    pub rounds: u16,
    /// Whether the weights settled before the last round.
    pub settled: bool,
}

/// Why there is no robust fit.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum RobustRefusal {
    /// Half of the samples must determine the robot.
    TooFewSamples {
        /// How many there are.
        samples: usize,
        /// How many are needed.
        needed: usize,
    },
    /// So many samples disagree with the others that it is not known which are right.
    TooManySuspected {
        /// How many disagree.
        suspected: usize,
        /// How many there are.
        samples: usize,
    },
    /// The work space has fewer places than there are samples.
    NoRoom {
        /// How many places are needed.
        samples: usize,
    },
    /// A faulty sample and its position in the sequence.
    Sample(usize, SampleError),
    /// What is left of the samples does not calibrate the robot.
    Fit(Refusal),
}

impl fmt::Display for RobustRefusal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewSamples { samples, needed } => {
                write!(
                    formatter,
                    "{samples} samples are too few for a robust fit: it needs {needed}"
                )
            }
            Self::TooManySuspected { suspected, samples } => write!(
                formatter,
                "{suspected} of {samples} samples disagree with the others"
            ),
            Self::NoRoom { samples } => {
                write!(
                    formatter,
                    "the work space has no room for {samples} samples"
                )
            }
            Self::Sample(index, error) => write!(formatter, "sample {index}: {error}"),
            Self::Fit(refusal) => refusal.fmt(formatter),
        }
    }
}

impl core::error::Error for RobustRefusal {}

impl From<Refusal> for RobustRefusal {
    fn from(refusal: Refusal) -> Self {
        Self::Fit(refusal)
    }
}
