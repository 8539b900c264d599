//! What the triangular factor of the Jacobian says about the parameters.

use super::problem::Normal;
use crate::Real;
use nalgebra::{SMatrix, SVector};

/// The inverse of the factor's 8 × 8 part and its condition.
pub(crate) struct Conditioning<T: Real> {
    /// (JᵀJ)⁻¹ in internal units.
    pub(crate) covariance: SMatrix<T, 8, 8>,
    /// ‖A‖‖A⁻¹‖/8 in Frobenius norms, A = J with columns of unit length.
    pub(crate) condition: T,
    /// Index of the parameter with the largest part in the weakest combination.
    pub(crate) weakest: usize,
}

/// Lengths of the Jacobian's columns.
pub(crate) fn column_norms<T: Real>(normal: &Normal<T>) -> [T; 8] {
    let mut squares = [T::ZERO; 8];
    for (index, row) in normal.rows().enumerate() {
        for (sum, entry) in squares.iter_mut().skip(index).zip(row) {
            *sum += *entry * *entry;
        }
    }
    squares.map(Real::square_root)
}

impl<T: Real> Conditioning<T> {
    /// γ = 8 − Σ priorⱼ² Cⱼⱼ: how many parameters the samples determine and not the prior.
    pub(crate) fn determined_parameters(&self, prior: &[T; 8]) -> T {
        let mut determined = T::from_f64(8.0);
        for (weight, variance) in prior.iter().zip(self.covariance.diagonal().iter()) {
            determined -= weight.squared() * *variance;
        }
        determined
    }

    /// The combination of parameters, of unit length in internal units, that the samples determine
    /// least: two steps of inverse iteration on JᵀJ.
    pub(crate) fn weakest_direction(&self) -> [T; 8] {
        let mut direction = SVector::<T, 8>::zeros();
        if let Some(entry) = direction.get_mut(self.weakest) {
            *entry = T::ONE;
        }
        for _ in 0..3 {
            direction = self.covariance * direction;
            let length = direction.dot(&direction).square_root();
            if !(length > T::ZERO && length.finite()) {
                return [T::ZERO; 8];
            }
            direction /= length;
        }
        direction.data.0[0]
    }

    /// An exactly singular or not finite factor gives an infinite condition.
    pub(crate) fn of(normal: &Normal<T>) -> Self {
        let norms = column_norms(normal);
        let full = normal.dense();
        // W = T⁻¹, column by column, by back-substitution.
        let mut inverse = [[T::ZERO; 8]; 8];
        for (index, column) in inverse.iter_mut().enumerate() {
            for (row, entries) in full.iter().enumerate().take(index + 1).rev() {
                let mut value = if row == index { T::ONE } else { T::ZERO };
                for (entry, known) in entries
                    .iter()
                    .zip(column.iter())
                    .take(index + 1)
                    .skip(row + 1)
                {
                    value -= *entry * *known;
                }
                if let (Some(target), Some(pivot)) = (column.get_mut(row), entries.get(row)) {
                    *target = value / *pivot;
                }
            }
        }
        // W Wᵀ, of which both halves are the same sums: symmetric to the bit.
        let mut covariance = [[T::ZERO; 8]; 8];
        for column in &inverse {
            for (sums, right) in covariance.iter_mut().zip(column) {
                for (sum, left) in sums.iter_mut().zip(column) {
                    *sum += *left * *right;
                }
            }
        }
        let covariance = SMatrix::<T, 8, 8>::from(covariance);
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
