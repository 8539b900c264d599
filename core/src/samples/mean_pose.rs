use crate::Real;
use crate::snapshot::state;
use nalgebra::Vector3;

/// The mean of the samples, each arm's in its own units. Rows of the factor cannot tell it: near a
/// singularity W is large, and by another amount for each arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MeanPose<T: Real> {
    pub(super) weight: T,
    /// X in units of the third arm.
    pub(crate) position: Vector3<T>,
    pub(crate) cosines: [T; 3],
    pub(crate) sines: [T; 3],
}

state!(MeanPose<T>: weight: T, position: Vector3<T>, cosines: [T; 3], sines: [T; 3]);

impl<T: Real> MeanPose<T> {
    pub(super) fn none() -> Self {
        Self {
            weight: T::ZERO,
            position: Vector3::zeros(),
            cosines: [T::ZERO; 3],
            sines: [T::ZERO; 3],
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        if !(other.weight > T::ZERO) {
            return;
        }
        self.weight += other.weight;
        let share = other.weight / self.weight;
        self.position += (other.position - self.position) * share;
        let own = self.cosines.iter_mut().chain(&mut self.sines);
        for (mean, value) in own.zip(other.cosines.iter().chain(&other.sines)) {
            *mean += (*value - *mean) * share;
        }
    }
}
