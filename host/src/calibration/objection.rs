//! What speaks against a calibration, before it is put into words.

use super::noise_test::NoiseTest;
use super::prior_test::PriorTest;
use crate::accuracy::position_error::PositionError;
use crate::accuracy::workspace_comparison::WorkspaceComparison;
use crate::fit::stream::Unweighed;
use delta_cal::Refusal;
use delta_cal::robust::RobustRefusal;
use delta_cal::samples::SampleError;
use delta_cal::stream::{Alarm, HeldOutRefusal, StreamRefusal};

/// What speaks against a calibration.
#[derive(Debug, Clone)]
pub(crate) enum Objection {
    /// The sample at this index is impossible.
    Sample(usize, SampleError),
    /// The fit is refused.
    Fit(Refusal),
    /// The robust fit is refused.
    Robust(RobustRefusal),
    /// The held-out samples disagree with the fit, or cannot judge it.
    HeldOut(HeldOutRefusal),
    /// The gate rejected so many of all samples.
    TooManyRejected { rejected: u64, samples: u64 },
    /// The gate rejected a run of samples; so many were taken in before.
    Alarm { alarm: Alarm, before: u64, run: u64 },
    /// Without a tolerance, a change that is no error of manufacture, in words.
    Implausible(String),
    /// The calibrated robot does not come to the measured points.
    NotReproduced(PositionError),
    /// The calibration would make the robot worse.
    Worse(WorkspaceComparison, PositionError),
    /// Neither a tolerance nor enough samples, so that nobody knows how good the result is.
    UnknownError,
    /// Without a stated noise, residuals that the tolerance does not explain.
    NoiseBeyondTolerance(NoiseTest),
    /// Parameters that are further from nominal than the tolerance allows.
    BeyondTolerance(PriorTest),
}

impl Objection {
    /// Whether wrong samples may be behind it, so that they are worth looking for.
    pub(crate) fn may_be_wrong_samples(&self) -> bool {
        match self {
            Self::Sample(..)
            | Self::HeldOut(_)
            | Self::Alarm { .. }
            | Self::TooManyRejected { .. }
            | Self::UnknownError => false,
            Self::Fit(refusal) => !matches!(refusal, Refusal::TooFewSamples { .. }),
            Self::Robust(refusal) => !matches!(refusal, RobustRefusal::TooFewSamples { .. }),
            Self::Implausible(_)
            | Self::NotReproduced(_)
            | Self::Worse(..)
            | Self::NoiseBeyondTolerance(_)
            | Self::BeyondTolerance(_) => true,
        }
    }

    /// How many times the stated noise the residuals are, if they are too large to be noise; 1 if none
    /// is stated.
    pub(crate) fn times_the_noise(&self) -> Option<f64> {
        match self {
            Self::Fit(Refusal::ResidualContradictsNoise { ratio, .. }) => Some(f64::from(*ratio)),
            Self::NoiseBeyondTolerance(_) => Some(1.0),
            _ => None,
        }
    }
}

impl From<Refusal> for Objection {
    fn from(refusal: Refusal) -> Self {
        Self::Fit(refusal)
    }
}

impl From<RobustRefusal> for Objection {
    fn from(refusal: RobustRefusal) -> Self {
        match refusal {
            RobustRefusal::Fit(refusal) => Self::Fit(refusal),
            RobustRefusal::Sample(index, error) => Self::Sample(index, error),
            other => Self::Robust(other),
        }
    }
}

impl From<Unweighed> for Objection {
    fn from(unweighed: Unweighed) -> Self {
        match unweighed {
            Unweighed::Sample(index, error) => Self::Sample(index, error),
            Unweighed::Refused {
                refusal,
                before,
                run,
            } => Self::of_stream(refusal, before, run),
        }
    }
}

impl Objection {
    /// A stream's refusal; how many samples were taken in before an alarm, and the length of its run.
    pub(crate) const fn of_stream(refusal: StreamRefusal, before: u64, run: u64) -> Self {
        match refusal {
            StreamRefusal::HeldOut(refusal) => Self::HeldOut(refusal),
            StreamRefusal::TooManyRejected { rejected, samples } => {
                Self::TooManyRejected { rejected, samples }
            }
            StreamRefusal::Alarm(alarm) => Self::Alarm { alarm, before, run },
            StreamRefusal::Calibration(refusal) => Self::Fit(refusal),
            _ => Self::Fit(Refusal::Unfinished),
        }
    }
}
