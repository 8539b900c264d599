//! The gate's verdicts, alarms and statistics.

use crate::Real;
use crate::robot::ArmIndex;
use crate::state::{Reader, State, Writer, state};
use core::fmt;

/// A sample compared to the prediction for one arm.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Innovation<T> {
    /// The arm with the largest deviation.
    pub arm: ArmIndex,
    /// Deviation of the sample along the forearm, f/(2 Lb). Length.
    pub distance: T,
    /// The innovation divided by its σ, which includes that of the prediction. Without a stated noise, the innovation
    /// over its estimated σ follows Student's t; this is then the equally improbable value of a normal distribution.
    pub normalized: T,
}

/// Why a sample was not tested.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Untested {
    /// There is neither a prior (a stated tolerance and a stated noise to weight it) nor a solved estimate: the stream
    /// solves one at the twelfth sample, and each time the number of samples has doubled.
    NoEstimate,
    /// The noise is not stated, and too few redundant samples exist to estimate it.
    NoNoise,
}

/// The gate's decision on a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict<T> {
    /// It agrees, and was added.
    Taken(Innovation<T>),
    /// It could not be tested, and was added.
    Untested(Untested),
    /// It disagrees, and was not added.
    Rejected(Innovation<T>),
}

/// Meaning of [`REJECTIONS_OF_A_CHANGE`](crate::calibration::limits::REJECTIONS_OF_A_CHANGE) consecutive rejections.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Alarm {
    /// The robot or its measuring frame has changed: enough consistent samples came before the run to determine an arm
    /// and to outnumber the run.
    RobotChanged {
        /// Index of the run's first sample, from 0, counting all samples received.
        first: u64,
    },
    /// Too few samples came before the run to decide which are wrong: those samples, together with the stated robot and
    /// tolerance, or the samples of the run.
    EarlySamplesWrong {
        /// Index of the run's first sample, from 0, counting all samples received.
        first: u64,
    },
}

impl Alarm {
    /// Index of the run's first sample, from 0, counting all samples received.
    pub const fn first(&self) -> u64 {
        match self {
            Self::RobotChanged { first } | Self::EarlySamplesWrong { first } => *first,
        }
    }

    /// A number that never changes, as of a [`Refusal`](crate::Refusal).
    pub const fn code(&self) -> u8 {
        match self {
            Self::RobotChanged { .. } => 92,
            Self::EarlySamplesWrong { .. } => 93,
        }
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::RobotChanged { first } => write!(
                formatter,
                "the robot, or its measuring frame, has changed before sample {first}"
            ),
            Self::EarlySamplesWrong { first } => write!(
                formatter,
                "the samples before sample {first}, or the stated robot and tolerance, are wrong, \
                 or the robot has changed since"
            ),
        }
    }
}

/// The gate's statistics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct GateCounts {
    /// Samples added, including untested ones.
    pub taken: u64,
    /// Samples added untested.
    pub untested: u64,
    /// Samples rejected.
    pub rejected: u64,
    /// Samples rejected by each arm; a sample rejected by several counts for each.
    pub rejected_by_arm: [u64; 3],
    /// Samples rejected since the last one added.
    pub run: u64,
    /// The longest such run.
    pub longest_run: u64,
}

state!(
    GateCounts:
    taken: u64,
    untested: u64,
    rejected: u64,
    rejected_by_arm: [u64; 3],
    run: u64,
    longest_run: u64,
);

impl<T: Real> State<T> for Option<Alarm> {
    const BYTES: usize = 9;

    fn save(&self, to: &mut Writer<'_>) {
        let kind: usize = match self {
            None => 0,
            Some(Alarm::RobotChanged { .. }) => 1,
            Some(Alarm::EarlySamplesWrong { .. }) => 2,
        };
        State::<T>::save(&kind, to);
        State::<T>::save(&self.map_or(0, |alarm| alarm.first()), to);
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        let (mut kind, mut first) = (0_usize, 0_u64);
        State::<T>::load(&mut kind, from);
        State::<T>::load(&mut first, from);
        *self = match kind {
            1 => Some(Alarm::RobotChanged { first }),
            2 => Some(Alarm::EarlySamplesWrong { first }),
            _ => None,
        };
    }

    fn accepts(&self, bytes: &[u8]) -> bool {
        matches!(bytes, [0..=2, first @ ..] if first.len() == 8)
    }
}

/// Why a number is not a valid gate width.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum GateError {
    /// The gate must be a finite number of σ greater than 0.
    #[error("the gate must be a finite number of sigma greater than 0")]
    Sigmas,
}
