//! A correction at which a problem is linearised, and the prior's share of its cost.

use super::limits::SAME_POINT;
use super::problem::Prior;
use crate::Real;
use crate::samples::Triangle;

/// A correction, the problem linearised there, and its cost.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point<T: Real, const N: usize, const M: usize, const E: usize> {
    pub(crate) correction: [T; N],
    pub(crate) normal: Triangle<T, M, E>,
    /// Σ r² at the correction, and with the prior's share.
    pub(crate) sum_of_squares: T,
    pub(crate) cost: T,
}

impl<T: Real, const N: usize, const M: usize, const E: usize> Point<T, N, M, E> {
    pub(super) const fn unstarted() -> Self {
        Self {
            correction: [T::ZERO; N],
            normal: Triangle::zero(),
            sum_of_squares: T::ZERO,
            cost: T::ZERO,
        }
    }

    /// Whether a correction is the same point, where a cost is known to a tie.
    pub(super) fn is_at(&self, correction: &[T; N], tie: T) -> bool {
        let mut apart = *correction;
        for (difference, other) in apart.iter_mut().zip(self.correction) {
            *difference -= other;
        }
        self.length_squared(&apart) <= T::from_f64(SAME_POINT) * tie
    }

    /// |T δ|²: by how much a displacement from a minimum raises the cost.
    #[inline(never)]
    pub(super) fn length_squared(&self, displacement: &[T; N]) -> T {
        let mut sum = T::ZERO;
        for (index, row) in self.normal.rows().take(N).enumerate() {
            let mut entry = T::ZERO;
            let below = displacement.get(index..).unwrap_or_default();
            for (factor, delta) in row.iter().zip(below) {
                entry += *factor * *delta;
            }
            sum += entry.squared();
        }
        sum
    }
}

/// The weight of the prior: σ of the residuals, and its rows.
pub(crate) struct Weighted<'a, T, R> {
    pub(crate) prior: &'a R,
    pub(crate) sigma: T,
}

impl<T: Real, R> Weighted<'_, T, R> {
    pub(super) fn cost<const N: usize, const M: usize, const E: usize>(
        &self,
        correction: &[T; N],
    ) -> T
    where
        R: Prior<T, N, M, E>,
    {
        self.prior.cost(correction) * self.sigma.squared()
    }

    pub(super) fn add_gradient<const N: usize, const M: usize, const E: usize>(
        &self,
        correction: &[T; N],
        to: &mut [T; N],
    ) where
        R: Prior<T, N, M, E>,
    {
        for (sum, part) in to.iter_mut().zip(self.prior.gradient(correction)) {
            *sum += part * self.sigma.squared();
        }
    }
}

#[cfg(test)]
mod tests;
