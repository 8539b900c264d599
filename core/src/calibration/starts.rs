//! From where a minimisation begins again, once one has ended.

use super::end_point::{EndPoint, rounding_of_cost};
use super::identifiability::Identifiability;
use super::limits::{EXCESS_OF_ANOTHER_MINIMUM, SAMPLES_FOR_FREE_START};
use super::outcome::StartUsed;
use super::point::Point;
use super::problem::{Problem, sum_of_squares};
use super::search::Search;
use super::settings::Start;
use crate::Real;

/// The starts that were used, and which is next: without a guess, or along what the samples determine least.
#[derive(Debug, Clone, Copy)]
pub(super) struct Starts<T, const N: usize> {
    /// The first of all.
    first: Start,
    /// How many starts without a guess were tried.
    free: u8,
    /// For other solutions, once there is a first end point.
    search: Option<Search<T, N>>,
}

impl<T: Real, const N: usize> Starts<T, N> {
    pub(super) const fn new(first: Start) -> Self {
        Self {
            first,
            free: 0,
            search: None,
        }
    }

    /// The next without a guess.
    pub(super) fn next_free<P, const M: usize, const E: usize>(
        &mut self,
        problem: &P,
    ) -> Option<[T; N]>
    where
        P: Problem<T, N, M, E>,
    {
        while self.free < P::FREE_STARTS {
            self.free += 1;
            if let Some(correction) = problem.free_start(self.free - 1) {
                return Some(correction);
            }
        }
        None
    }

    /// A start without a guess if the samples allow a clearly better fit than was found.
    ///
    /// The free fit of the coefficients leaves ρ², which no parameters undercut; the parameters of the
    /// right solution leave four residual variances an arm more, a false minimum far more than that.
    pub(super) fn better_free<P, const M: usize, const E: usize>(
        &mut self,
        problem: &P,
        ended: StartUsed,
        best: Option<&EndPoint<T, N, M, E>>,
    ) -> Option<[T; N]>
    where
        P: Problem<T, N, M, E>,
    {
        let enough = T::from_count(SAMPLES_FOR_FREE_START);
        let spare = problem.effective_samples() - enough;
        let from_nominal = self.first == Start::Nominal;
        if from_nominal && (ended != StartUsed::Nominal || spare < T::ZERO) {
            return None;
        }
        if let Some(best) = best {
            let least = problem.least_sum_of_squares();
            let variance = if problem.noise_stated() {
                T::ONE
            } else {
                let residuals = spare * T::from_count(u64::from(P::RESIDUALS));
                least / residuals.larger(T::ONE)
            };
            let excess = best.point.sum_of_squares - least;
            let limit = T::from_f64(EXCESS_OF_ANOTHER_MINIMUM) * variance;
            if !(excess > limit + rounding_of_cost(problem)) {
                return None;
            }
        }
        if from_nominal {
            problem.free_start(0)
        } else {
            self.next_free(problem)
        }
    }

    /// Begins to look for other solutions on both sides of an end point, if the samples are so few that there
    /// may be several, and no linear fit can tell a false one.
    pub(super) fn search<P, const M: usize, const E: usize>(
        &mut self,
        problem: &P,
        from: &Point<T, N, M, E>,
        there: &Identifiability<T, N>,
    ) where
        P: Problem<T, N, M, E>,
    {
        let few = problem.effective_samples() < T::from_count(SAMPLES_FOR_FREE_START);
        if few && self.search.is_none() {
            let direction = there.weakest_direction();
            self.search = Some(Search::new(from.correction, direction));
        }
    }

    /// Notes where the iteration from a start converged.
    pub(super) fn converged<P, const M: usize, const E: usize>(
        &mut self,
        start: StartUsed,
        to: &Point<T, N, M, E>,
        problem: &P,
    ) where
        P: Problem<T, N, M, E>,
    {
        if start == StartUsed::Search
            && let Some(search) = &mut self.search
        {
            search.converged(to, problem);
        }
    }

    /// The next of a search that has begun.
    pub(super) fn next_searched<P, const M: usize, const E: usize>(
        &mut self,
        problem: &P,
    ) -> Option<(StartUsed, [T; N])>
    where
        P: Problem<T, N, M, E>,
    {
        let search = self.search.as_mut()?;
        while let Some(correction) = search.next() {
            // Where there is no such robot nothing can start.
            if sum_of_squares(problem, &problem.displaced(&correction)).finite() {
                return Some((StartUsed::Search, correction));
            }
        }
        // Few samples may determine a start without a guess all the same.
        if self.free > 0 {
            return None;
        }
        self.free = 1;
        Some((StartUsed::Free, problem.free_start(0)?))
    }
}

#[cfg(test)]
mod tests;
