//! What the triangular factor of the Jacobian says about the parameters.

use super::problem::Normal;
use crate::Real;
use core::hint::black_box;
use nalgebra::SMatrix;

/// The inverse of the factor's 8 × 8 part and its condition.
pub(crate) struct Identifiability<T: Real> {
    /// (JᵀJ)⁻¹ in internal units.
    pub(crate) covariance: SMatrix<T, 8, 8>,
    /// ‖A‖‖A⁻¹‖/8 in Frobenius norms, A = J with columns of unit length.
    pub(crate) condition: T,
    /// Index of the parameter with the largest part in the weakest combination.
    pub(crate) weakest: usize,
}

impl<T: Real> Identifiability<T> {
    /// γ = 8 − Σ priorⱼ² Cⱼⱼ: how many parameters the samples determine and not the prior.
    pub(crate) fn determined_parameters(&self, prior: &[T; 8]) -> T {
        let mut determined = T::from_f64(8.0);
        for (weight, variance) in prior.iter().zip(self.covariance.diagonal().iter()) {
            determined -= weight.squared() * *variance;
        }
        determined
    }

    /// The combination of parameters, of unit length in internal units, that the samples determine
    /// least: three steps of inverse iteration on JᵀJ.
    #[inline(never)]
    pub(crate) fn weakest_direction(&self) -> [T; 8] {
        let mut direction = [T::ZERO; 8];
        if let Some(entry) = direction.get_mut(self.weakest) {
            *entry = T::ONE;
        }
        // Hidden from the optimiser, which would write the step out three times.
        for _ in 0..black_box(3) {
            let mut product = [T::ZERO; 8];
            for (column, part) in self.covariance.as_slice().chunks_exact(8).zip(direction) {
                add_multiple(column, part, &mut product);
            }
            let squared = product
                .iter()
                .fold(T::ZERO, |sum, part| sum + part.squared());
            let length = squared.square_root();
            if !(length > T::ZERO && length.finite()) {
                return [T::ZERO; 8];
            }
            direction = product.map(|part| part / length);
        }
        direction
    }

    /// An exactly singular or not finite factor gives an infinite condition.
    #[inline(never)]
    pub(crate) fn of(normal: &Normal<T>) -> Self {
        // The parameters' columns; the ninth is the residual, which may well be zero.
        let [norms @ .., _] = normal.column_norms();
        let mut covariance = SMatrix::<T, 8, 8>::zeros();
        // W = T⁻¹ column by column, and W Wᵀ as the sum of its columns' products, of which both halves are
        // the same sums: symmetric to the bit.
        for length in 1..=8 {
            let mut column = [T::ZERO; 8];
            let column = column.get_mut(..length).unwrap_or_default();
            normal.inverse_column(column);
            add_square(column, covariance.as_mut_slice());
        }
        let mut total = T::ZERO;
        let mut weakest = (0, T::ZERO);
        for ((j, norm), variance) in norms.iter().enumerate().zip(&covariance.diagonal()) {
            let scaled = *variance * norm.squared();
            total += scaled;
            if !(scaled <= weakest.1) {
                weakest = (j, scaled);
            }
        }
        let condition = if total.finite() && norms.iter().all(|norm| *norm > T::ZERO) {
            (total / T::from_f64(8.0)).square_root()
        } else {
            T::INFINITY
        };
        Self {
            covariance,
            condition,
            weakest: weakest.0,
        }
    }
}

/// Adds v vᵀ to a matrix given by columns; v may be shorter, zeros behind it.
#[inline(never)]
fn add_square<T: Real>(vector: &[T], matrix: &mut [T]) {
    for (column, part) in matrix.chunks_exact_mut(8).zip(vector) {
        add_multiple(vector, *part, column);
    }
}

/// Adds a multiple of one vector to another.
#[inline(never)]
fn add_multiple<T: Real>(vector: &[T], factor: T, to: &mut [T]) {
    for (sum, entry) in to.iter_mut().zip(vector) {
        *sum += *entry * factor;
    }
}

#[cfg(test)]
mod tests;
