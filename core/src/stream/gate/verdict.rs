//! The gate's verdicts and statistics.

use crate::Real;
use crate::calibration::Refusal;
use crate::robot::ArmIndex;
use crate::state::{Reader, State, Writer, state};

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

/// The fate of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict<T> {
    /// Added; there is no gate.
    Ungated,
    /// Added untested: there is neither a prior (a stated tolerance and a stated noise to weight it) nor a solved
    /// estimate: the stream solves one at the twelfth sample, and each time the number of samples has doubled.
    NoEstimate,
    /// Added untested: the noise is not stated, and too few redundant samples exist to estimate it.
    NoNoise,
    /// It agrees, and was added.
    Taken(Innovation<T>),
    /// It disagrees, and was not added.
    Rejected(Innovation<T>),
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

/// The alarm of a gate.
impl<T: Real> State<T> for Option<Refusal> {
    const BYTES: usize = 9;

    fn save(&self, to: &mut Writer<'_>) {
        let (kind, first): (usize, u64) = match self {
            Some(Refusal::RobotChanged { first }) => (1, *first),
            Some(Refusal::EarlySamplesWrong { first }) => (2, *first),
            _ => (0, 0),
        };
        State::<T>::save(&kind, to);
        State::<T>::save(&first, to);
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        let (mut kind, mut first) = (0_usize, 0_u64);
        State::<T>::load(&mut kind, from);
        State::<T>::load(&mut first, from);
        *self = match kind {
            1 => Some(Refusal::RobotChanged { first }),
            2 => Some(Refusal::EarlySamplesWrong { first }),
            _ => None,
        };
    }

    fn accepts(&self, bytes: &[u8]) -> bool {
        matches!(bytes, [0..=2, first @ ..] if first.len() == 8)
    }
}
