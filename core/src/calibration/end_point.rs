use super::limits::{INDISTINGUISHABLE, NEARER, TIE};
use super::outcome::{StartUsed, Termination};
use super::point::Point;
use super::problem::Problem;
use crate::Real;

/// Where an iteration ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndPoint<T: Real, const N: usize, const M: usize, const E: usize> {
    pub(super) point: Point<T, N, M, E>,
    pub(super) termination: Termination,
    pub(super) start: StartUsed,
    /// What the tolerance was balanced against.
    pub(super) residual_sigma: T,
}

impl<T: Real, const N: usize, const M: usize, const E: usize> EndPoint<T, N, M, E> {
    /// Whether the end of another iteration is to be preferred: a clearly smaller cost, or, where the
    /// samples cannot tell the two apart, the solution nearer to the nominal parameters. Eight samples
    /// have several exact solutions.
    #[inline(never)]
    pub(super) fn is_improved_by<P: Problem<T, N, M, E>>(
        &self,
        end: &Point<T, N, M, E>,
        residual_sigma: T,
        has_tolerance: bool,
        problem: &P,
    ) -> bool {
        // With a tolerance the cost itself prefers the nearer one.
        let tie = if problem.noise_stated() && !has_tolerance {
            T::from_f64(INDISTINGUISHABLE)
        } else {
            // Of two starts that end in the same point the first is kept.
            T::from_f64(TIE) * self.point.cost
        } + rounding_of_cost(problem);
        let gained = self.point.cost - end.cost;
        if residual_sigma != self.residual_sigma {
            // Another balance of samples and tolerance: the later one counts.
            return true;
        }
        let same_place = self.point.is_at(&end.correction, tie);
        if gained.magnitude() <= tie && !same_place {
            squared_length(&end.correction)
                < T::from_f64(NEARER) * squared_length(&self.point.correction)
        } else {
            gained > T::ZERO
        }
    }
}

/// A sum of squares below this is rounding: (32ε)² times the rows that the residuals come from.
pub(super) fn rounding_of_cost<
    T: Real,
    P: Problem<T, N, M, E>,
    const N: usize,
    const M: usize,
    const E: usize,
>(
    problem: &P,
) -> T {
    problem.rows_squared() * (T::from_f64(32.0) * T::EPSILON).squared()
}

#[inline(never)]
fn squared_length<T: Real>(values: &[T]) -> T {
    values
        .iter()
        .fold(T::ZERO, |sum, value| sum + value.squared())
}

#[cfg(test)]
mod tests;
