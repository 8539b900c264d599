use super::observation::{Observation, ObservationError};
use crate::Real;

/// Readings of an observation at most.
pub(super) const READINGS: usize = 5;

/// An observation with the weights of its readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservationRow<T: Real> {
    pub(super) observation: Observation<T>,
    /// L of the readings' covariance, row by row: 1 on the diagonal where nothing was read.
    pub(super) factor: [[T; READINGS]; READINGS],
    /// √ of what the row counts.
    pub(super) root_weight: T,
    /// Whether the nominal robot does not reach its joint angles.
    pub(super) left_out: bool,
    /// Whether the nominal robot is near a singularity there.
    pub(super) steep: bool,
}

impl<T: Real> ObservationRow<T> {
    /// Before it is [prepared](super::ObservationProblem::prepare).
    pub const fn new(observation: Observation<T>) -> Self {
        Self {
            observation,
            factor: [[T::ZERO; READINGS]; READINGS],
            root_weight: T::ONE,
            left_out: false,
            steep: false,
        }
    }

    /// What was measured.
    pub const fn observation(&self) -> &Observation<T> {
        &self.observation
    }

    /// The same row counted so many times in the sum of squares.
    pub fn set_weight(&mut self, weight: T) {
        self.root_weight = weight.square_root();
    }

    pub(super) fn check_weight(&self) -> Result<(), ObservationError> {
        if self.root_weight.finite() {
            Ok(())
        } else {
            Err(ObservationError::Weight)
        }
    }

    /// How many times the row counts.
    pub fn weight(&self) -> T {
        if self.left_out {
            T::ZERO
        } else {
            self.root_weight.squared()
        }
    }

    /// |L|, L Lᵀ being the covariance of the row's readings: the product of their σ, each given those before it.
    pub fn spread(&self) -> T {
        let diagonal = self.factor.iter().enumerate();
        diagonal.fold(T::ONE, |product, (index, row)| {
            product * row.get(index).copied().unwrap_or(T::ONE)
        })
    }

    /// Whether the row does not count because the nominal robot does not reach its joint angles: nothing tells
    /// then what its readings weigh.
    pub const fn is_left_out(&self) -> bool {
        self.left_out
    }

    /// Whether the nominal robot is near a singularity there, where its positions change fast with the
    /// parameters.
    pub(super) const fn is_steep(&self) -> bool {
        self.steep
    }
}
