//! A sample of all arms, whitened by the shared covariance of their closures.

use super::displacement::Displacement;
use super::nominal_arm::{ArmSample, COLUMNS, FEATURES};
use super::triangle::put_row;
use crate::Real;
use crate::robot::{OF_ARM, OF_ROBOT};
use crate::state::state;
use nalgebra::Vector3;

/// The three arms displaced by their corrections, as [`JointFactor`](super::JointFactor) needs them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JointDisplacement<T: Real> {
    pub(crate) arms: [Displacement<T>; 3],
}

impl<T: Real> JointDisplacement<T> {
    /// The coefficients of one arm after the other.
    pub(super) fn coefficients(&self) -> [T; 3 * FEATURES] {
        let mut coefficients = [T::ZERO; 3 * FEATURES];
        let (of_arms, _) = coefficients.as_chunks_mut();
        for (own, arm) in of_arms.iter_mut().zip(&self.arms) {
            *own = arm.coefficients;
        }
        coefficients
    }

    /// Features times ∂c/∂P, arm by arm.
    pub(super) fn gradient_of(&self, features: &[T; 3 * FEATURES]) -> [T; OF_ROBOT] {
        let mut gradient = [T::ZERO; OF_ROBOT];
        let features = features.as_chunks::<FEATURES>().0;
        let (of_arms, _) = gradient.as_chunks_mut::<OF_ARM>();
        for ((own, arm), features) in of_arms.iter_mut().zip(&self.arms).zip(features) {
            *own = arm.gradient_of(features);
        }
        gradient
    }
}

/// A sample of all arms, and the rows of W: the first spans all arms, the second the second and third arm, the third
/// only the third arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WhitenedSample<T: Real> {
    pub(super) arms: [ArmSample<T>; 3],
    pub(super) rows: [[T; 3]; 3],
    /// The sample's weight.
    pub(super) weight: T,
}

state!(WhitenedSample<T>: arms: [ArmSample<T>; 3], rows: [[T; 3]; 3], weight: T);

impl<T: Real> WhitenedSample<T> {
    /// A placeholder.
    #[inline(always)]
    pub(crate) fn vacant() -> Self {
        Self {
            arms: [
                ArmSample::vacant(),
                ArmSample::vacant(),
                ArmSample::vacant(),
            ],
            rows: [[T::ZERO; 3]; 3],
            weight: T::ZERO,
        }
    }

    /// Writes the sample's row for an arm and those after it into a block that begins at that arm's columns.
    pub(super) fn put<const K: usize>(&self, first: usize, columns: &mut [[T; K]], index: usize) {
        let Some(weights) = self.rows.get(first) else {
            return;
        };
        let mut right = T::ZERO;
        let mut start = 0;
        for (sample, weight) in self.arms.iter().zip(weights).skip(first) {
            let weighted = ArmSample {
                weight: *weight,
                ..*sample
            };
            let [features @ .., constraint]: [T; COLUMNS] = weighted.row();
            put_row(columns, index, start, &features);
            right += constraint;
            start += FEATURES;
        }
        put_row(columns, index, start, &[right]);
    }

    pub(super) fn pose(&self) -> MeanPose<T> {
        let [.., third] = &self.arms;
        MeanPose {
            weight: self.weight,
            position: third.x,
            cosines: self.arms.each_ref().map(|arm| arm.cosine),
            sines: self.arms.each_ref().map(|arm| arm.sine),
        }
    }
}

/// The mean of the samples, in each arm's units. It cannot be derived from rows of the factor: near a singularity W is
/// large, by a different amount for each arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MeanPose<T: Real> {
    pub(super) weight: T,
    /// X in the third arm's unit.
    pub(crate) position: Vector3<T>,
    pub(crate) cosines: [T; 3],
    pub(crate) sines: [T; 3],
}

state!(MeanPose<T>: weight: T, position: Vector3<T>, cosines: [T; 3], sines: [T; 3]);

impl<T: Real> MeanPose<T> {
    #[inline(always)]
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
