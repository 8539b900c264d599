//! Further starts of a minimisation once one has ended.

use super::limits::{EXCESS_OF_ANOTHER_MINIMUM, SAMPLES_FOR_FREE_START, TIE};
use super::outcome::StartUsed;
use super::point::{EndPoint, Point, rounding_of_cost};
use super::problem::{Problem, sum_of_squares};
use super::settings::Start;
use crate::Real;

/// The starts used so far, and the next: free, or along the combination that the samples determine least.
#[derive(Debug, Clone, Copy)]
pub(super) struct Starts<T, const N: usize> {
    /// The first start.
    first: Start,
    /// Number of free starts tried.
    free: u8,
    /// The search for other solutions, once there is a first end point.
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

    /// The next free start.
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

    /// A free start if the samples allow a clearly better fit than found so far.
    ///
    /// The free fit of the coefficients leaves ρ², a lower bound for any parameters; the right solution leaves four
    /// residual variances per arm more, a false minimum far more.
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

    /// Starts to search for other solutions on both sides of an end point, if the samples are so few that there may be
    /// several, and no linear fit can identify a false one.
    pub(super) fn search<P, const M: usize, const E: usize>(
        &mut self,
        problem: &P,
        from: &Point<T, N, M, E>,
        direction: impl FnOnce() -> [T; N],
    ) where
        P: Problem<T, N, M, E>,
    {
        let few = problem.effective_samples() < T::from_count(SAMPLES_FOR_FREE_START);
        if few && self.search.is_none() {
            self.search = Some(Search::new(from.correction, direction()));
        }
    }

    /// Records where the iteration from a start converged.
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

    /// The next start of a search in progress.
    pub(super) fn next_searched<P, const M: usize, const E: usize>(
        &mut self,
        problem: &P,
    ) -> Option<(StartUsed, [T; N])>
    where
        P: Problem<T, N, M, E>,
    {
        let search = self.search.as_mut()?;
        while let Some(correction) = search.next() {
            // There is no such robot, so nothing can start.
            if sum_of_squares(problem, &problem.displaced(&correction)).finite() {
                return Some((StartUsed::Search, correction));
            }
        }
        // Even few samples may determine a free start.
        if self.free > 0 {
            return None;
        }
        self.free = 1;
        Some((StartUsed::Free, problem.free_start(0)?))
    }
}

/// Distances of the starts from the first end point, in units of the scale and radians, on either side, farthest first.
/// Single precision: converting `f64` at run time would link its software arithmetic.
const DISTANCES: [f32; 4] = [0.12, 0.06, 0.03, 0.01];

/// Starts along the combination of parameters that the samples determine least.
///
/// If the iteration from a start returns to the first end point, starts between the two do too and are skipped: in
/// 259,200 simulated calibrations of six geometries with eight to eleven samples this changed 168 accepted results, as
/// often for the better as for the worse.
#[derive(Debug, Clone, Copy)]
pub(super) struct Search<T, const N: usize> {
    origin: [T; N],
    direction: [T; N],
    tried: usize,
    /// Whether a start returned, on either side.
    returned: [bool; 2],
}

impl<T: Real, const N: usize> Search<T, N> {
    /// A search on both sides of an end point.
    pub(super) const fn new(origin: [T; N], direction: [T; N]) -> Self {
        Self {
            origin,
            direction,
            tried: 0,
            returned: [false; 2],
        }
    }

    /// The next start; `None` after the last.
    pub(super) fn next(&mut self) -> Option<[T; N]> {
        loop {
            let distance = T::from_f64(f64::from(*DISTANCES.get(self.tried / 2)?));
            let [one, other] = self.returned;
            let (returned, step) = match self.tried % 2 {
                0 => (one, -distance),
                _ => (other, distance),
            };
            self.tried += 1;
            if returned {
                continue;
            }
            let mut start = self.origin;
            for (value, part) in start.iter_mut().zip(self.direction) {
                *value += part * step;
            }
            return Some(start);
        }
    }

    /// Records where the iteration from the last start converged.
    pub(super) fn converged<P, const M: usize, const E: usize>(
        &mut self,
        to: &Point<T, N, M, E>,
        problem: &P,
    ) where
        P: Problem<T, N, M, E>,
    {
        let tie = T::from_f64(TIE) * to.cost + rounding_of_cost(problem);
        if to.is_at(&self.origin, tie) {
            let [one, other] = &mut self.returned;
            match self.tried % 2 {
                1 => *one = true,
                _ => *other = true,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp, clippy::unwrap_used)] // of figures that are copied or rounded

    use super::{Search, Starts};
    use crate::calibration::curve::Curve;
    use crate::calibration::outcome::{StartUsed, Termination};
    use crate::calibration::point::{EndPoint, Point};
    use crate::calibration::settings::Start;
    use crate::robot::Arm;
    use crate::samples::{ArmFactor, NominalArm, Triangle};
    use nalgebra::Vector3;

    /// An end at p = 0, known to 1.
    fn end(sum_of_squares: f64) -> Point<f64, 1, 2, 3> {
        Point {
            correction: [0.0],
            normal: Triangle::from_diagonal(&[1.0], &[0.0]),
            sum_of_squares,
            cost: sum_of_squares,
        }
    }

    /// Whether a free start is tried after the one from nominal has ended.
    fn another_is_tried(problem: &Curve, sum_of_squares: f64) -> bool {
        let best = EndPoint {
            point: end(sum_of_squares),
            termination: Termination::GradientVanished,
            start: StartUsed::Nominal,
            residual_sigma: 1.0,
        };
        let mut starts = Starts::<f64, 1>::new(Start::Nominal);
        let found = starts.better_free(problem, StartUsed::Nominal, Some(&best));
        assert!(found.is_none() || found == Some([7.0]));
        found.is_some()
    }

    /// n samples with three residuals each leave 3 (n − 12) redundant ones after the fit of the twelve coefficients,
    /// and a sum of squares of 48; that of the end may be larger by 50 residual variances. With twelve samples nothing
    /// is redundant, and that sum serves as the variance.
    #[test]
    fn an_end_that_is_worse_than_the_coefficients_by_fifty_variances_is_not_the_last() {
        for (samples, noise_stated, variance) in [
            (20, false, 2.0),
            (28, false, 1.0),
            (12, false, 48.0),
            (20, true, 1.0),
            (12, true, 1.0),
        ] {
            let problem = Curve {
                free_start: Some(7.0),
                least_sum_of_squares: 48.0,
                samples,
                noise_stated,
                ..Curve::straight()
            };
            let limit = 48.0 + 50.0 * variance;
            assert!(!another_is_tried(&problem, 0.999 * limit), "{problem:?}");
            assert!(another_is_tried(&problem, 1.001 * limit), "{problem:?}");
        }
    }

    /// With exact samples the coefficients leave nothing, an end only rounding: (32 ε)² times the rows' squares.
    #[test]
    fn what_rounding_leaves_is_no_reason_to_start_again() {
        let rounding = f64::powi(32.0 * f64::EPSILON, 2) * 1e6;
        let problem = Curve {
            free_start: Some(7.0),
            rows_squared: 1e6,
            ..Curve::straight()
        };
        assert!(!another_is_tried(&problem, 0.9 * rounding));
        assert!(another_is_tried(&problem, 1.1 * rounding));
    }

    /// Starts of a search about p = 0, where eleven samples may have several solutions.
    fn searching(first: Start, problem: &Curve) -> Starts<f64, 1> {
        let mut starts = Starts::new(first);
        if first == Start::Free {
            assert_eq!(starts.next_free(problem), problem.free_start.map(|p| [p]));
        }
        starts.search(problem, &end(1e-6), || [1.0]);
        starts
    }

    fn few() -> Curve {
        Curve {
            free_start: Some(7.0),
            samples: 11,
            ..Curve::straight()
        }
    }

    /// Distances of the next starts of the search from p = 0, in hundredths, the first side positive; and what follows
    /// the last.
    fn searched(starts: &mut Starts<f64, 1>, problem: &Curve) -> ([i32; 8], Option<[f64; 1]>) {
        let mut steps = [0; 8];
        let mut side = 1.0;
        for index in 0..9 {
            match starts.next_searched(problem) {
                Some((StartUsed::Search, [p])) => {
                    if index == 0 {
                        side = p.signum();
                    }
                    #[allow(clippy::cast_possible_truncation)]
                    {
                        steps[index] = libm::round(100.0 * side * p) as i32;
                    }
                }
                Some((StartUsed::Free, start)) => return (steps, Some(start)),
                other => {
                    assert_eq!(other, None);
                    break;
                }
            }
        }
        (steps, None)
    }

    /// A free start follows the last start of a search, once, unless the first start was free.
    #[test]
    fn behind_a_search_comes_the_start_without_a_guess_if_none_was() {
        let mut starts = searching(Start::Nominal, &few());
        let all = [12, -12, 6, -6, 3, -3, 1, -1];
        assert_eq!(searched(&mut starts, &few()), (all, Some([7.0])));
        assert_eq!(starts.next_searched(&few()), None);
        let mut starts = searching(Start::Free, &few());
        assert_eq!(searched(&mut starts, &few()), (all, None));
        assert_eq!(starts.next_searched(&few()), None);
    }

    /// If one of the search's own starts returns to p = 0, those in between are skipped. Another start that ends there
    /// says nothing about them.
    #[test]
    fn only_a_start_of_the_search_can_come_back() {
        for (start, rest) in [
            (StartUsed::Search, [12, 6, 3, 1, 0, 0, 0, 0]),
            (StartUsed::Free, [12, -6, 6, -3, 3, -1, 1, 0]),
            (StartUsed::Nominal, [12, -6, 6, -3, 3, -1, 1, 0]),
        ] {
            let mut starts = searching(Start::Free, &few());
            assert!(starts.next_searched(&few()).is_some());
            starts.converged(start, &end(1e-6), &few());
            assert_eq!(searched(&mut starts, &few()).0, rest, "{start:?}");
        }
    }

    /// Starts without a valid robot are skipped.
    #[test]
    fn starts_without_a_robot_are_passed_over() {
        let problem = Curve {
            residuals: |p| [(if p < 0.0 { f64::INFINITY } else { p }, 1.0), (0.0, 0.0)],
            ..few()
        };
        let mut starts = searching(Start::Free, &problem);
        assert_eq!(searched(&mut starts, &problem).0, [12, 6, 3, 1, 0, 0, 0, 0]);
    }

    /// Twelve samples determine the twelve coefficients, and those one arm: there is nothing to search for.
    #[test]
    fn twelve_samples_need_no_search() {
        let problem = Curve {
            samples: 12,
            ..few()
        };
        let mut starts = searching(Start::Nominal, &problem);
        assert_eq!(starts.next_searched(&problem), None);
    }

    const ORIGIN: [f64; 8] = [0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.25];

    fn search() -> Search<f64, 8> {
        let mut direction = [0.0; 8];
        direction[7] = 1.0;
        Search::new(ORIGIN, direction)
    }

    /// The end of an iteration: every parameter known to 1, the cost to a fraction of a thousandth.
    fn end_at(correction: [f64; 8]) -> Point<f64, 8, 9, 45> {
        Point {
            correction,
            normal: Triangle::from_diagonal(&[1.0; 8], &[0.0; 8]),
            sum_of_squares: 1e-6,
            cost: 1e-6,
        }
    }

    /// Distances of the starts from the origin, in hundredths, padded with zeros, if the iteration from start number
    /// `which` ends there.
    fn steps(which: Option<usize>, end: &Point<f64, 8, 9, 45>) -> [f64; 9] {
        let arm = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0]).unwrap();
        let problem = ArmFactor::new(NominalArm::new(&arm, &Vector3::new(0.0, 0.0, -450.0), None));
        let (mut search, mut steps) = (search(), [0.0; 9]);
        for (index, step) in steps.iter_mut().enumerate() {
            let Some(start) = search.next() else {
                break;
            };
            assert_eq!(start[..7], ORIGIN[..7]);
            // The distances are single-precision constants.
            *step = libm::round(1e4 * (start[7] - ORIGIN[7])) / 100.0;
            if which == Some(index + 1) {
                search.converged(end, &problem);
            }
        }
        steps
    }

    #[test]
    fn starts_are_on_both_sides_and_the_farthest_first() {
        let all = [-12.0, 12.0, -6.0, 6.0, -3.0, 3.0, -1.0, 1.0, 0.0];
        assert_eq!(steps(None, &end_at(ORIGIN)), all);
        // A tie is 1e-3 of the cost, and sixteen ties are the same point: beyond √(16 · 1e-9) it is another.
        let mut another = ORIGIN;
        another[2] = 1.3e-4;
        assert_eq!(steps(Some(1), &end_at(another)), all);
    }

    #[test]
    fn between_the_origin_and_a_start_that_came_back_nothing_is_tried() {
        let mut near = ORIGIN;
        near[2] = 1.2e-4;
        for (start, expected) in [
            (1, [-12.0, 12.0, 6.0, 3.0, 1.0, 0.0]),
            (2, [-12.0, 12.0, -6.0, -3.0, -1.0, 0.0]),
            (4, [-12.0, 12.0, -6.0, 6.0, -3.0, -1.0]),
        ] {
            assert_eq!(steps(Some(start), &end_at(near))[..6], expected);
        }
    }
}
