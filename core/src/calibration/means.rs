use crate::Real;
use nalgebra::Vector3;

/// The mean sample of an arm.
#[allow(unreachable_pub)] // part of the seal
#[derive(Debug, Clone, Copy)]
pub struct Means<T: Real> {
    pub(crate) x: Vector3<T>,
    /// The rms distance of the samples from x.
    pub(crate) spread: T,
    /// Of the joint angle; of a linear drive the travel in internal units.
    pub(crate) sine: T,
    /// Of the joint angle; of a linear drive the square of its travel.
    pub(crate) cosine: T,
}

/// √(⟨x²⟩ − ⟨x⟩²): the rms distance from the mean.
pub(crate) fn spread<T: Real>(mean_square: T, mean: &Vector3<T>) -> T {
    (mean_square - mean.dot(mean)).larger(T::ZERO).square_root()
}
