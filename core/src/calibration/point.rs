//! A correction at which a problem is linearised, and the prior's share of the cost there.

use super::limits::{INDISTINGUISHABLE, NEARER, SAME_POINT, TIE};
use super::outcome::{StartUsed, Termination};
use super::problem::{Prior, Problem};
use crate::Real;
use crate::samples::Triangle;

/// A correction, the problem linearised there, and its cost.
#[derive(Debug, Clone)]
pub(crate) struct Point<T: Real, const N: usize, const M: usize, const E: usize> {
    pub(crate) correction: [T; N],
    pub(crate) normal: Triangle<T, M, E>,
    /// Σ r² at the correction, and with the prior's share.
    pub(crate) sum_of_squares: T,
    pub(crate) cost: T,
}

impl<T: Real, const N: usize, const M: usize, const E: usize> Point<T, N, M, E> {
    #[allow(clippy::inline_always)] // in its place at every optimisation level: it is large
    #[inline(always)]
    pub(super) const fn unstarted() -> Self {
        Self {
            correction: [T::ZERO; N],
            normal: Triangle::zero(),
            sum_of_squares: T::ZERO,
            cost: T::ZERO,
        }
    }

    /// Whether a correction is the same point, if costs are known to within a tie.
    pub(super) fn is_at(&self, correction: &[T; N], tie: T) -> bool {
        let mut apart = *correction;
        for (difference, other) in apart.iter_mut().zip(self.correction) {
            *difference -= other;
        }
        self.length_squared(&apart) <= T::from_f64(SAME_POINT) * tie
    }

    /// |T δ|²: the increase of the cost for a displacement from a minimum.
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

/// The weighted prior: its rows, and σ of the residuals.
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

/// Where an iteration ended.
#[derive(Debug, Clone)]
pub(super) struct EndPoint<T: Real, const N: usize, const M: usize, const E: usize> {
    pub(super) point: Point<T, N, M, E>,
    pub(super) termination: Termination,
    pub(super) start: StartUsed,
    /// σ of the residuals when samples and tolerance were balanced.
    pub(super) residual_sigma: T,
}

impl<T: Real, const N: usize, const M: usize, const E: usize> EndPoint<T, N, M, E> {
    /// Whether another end point is preferable: a clearly smaller cost, or, if the samples cannot distinguish the two,
    /// the solution nearer to nominal. Eight samples have several exact solutions.
    #[inline(never)]
    pub(super) fn is_improved_by<P: Problem<T, N, M, E>>(
        &self,
        end: &Point<T, N, M, E>,
        residual_sigma: T,
        has_tolerance: bool,
        problem: &P,
    ) -> bool {
        // With a tolerance, the cost itself prefers the nearer solution.
        let tie = if problem.noise_stated() && !has_tolerance {
            T::from_f64(INDISTINGUISHABLE)
        } else {
            // If two starts reach the same point, the first is kept.
            T::from_f64(TIE) * self.point.cost
        } + rounding_of_cost(problem);
        let gained = self.point.cost - end.cost;
        if residual_sigma != self.residual_sigma {
            // Samples and tolerance were balanced differently: the later end counts.
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
mod tests {
    #![allow(clippy::cast_precision_loss)]
    #![allow(clippy::unwrap_used)]

    use super::{EndPoint, Weighted};
    use crate::calibration::outcome::{StartUsed, Termination};
    use crate::calibration::point::Point;
    use crate::calibration::problem::Prior;
    use crate::robot::Arm;
    use crate::samples::{ArmFactor, Noise, NominalArm, Triangle};
    use nalgebra::Vector3;

    /// Half the derivative of the weighted cost: exact by central differences of any step, since the cost is quadratic.
    #[test]
    fn the_gradient_of_the_prior_is_that_of_its_weighted_cost() {
        let prior: [f64; 8] = [3.0, 0.5, 0.0, 2.0, 1.0, 4.0, 0.2, 1.5];
        let weighted = Weighted {
            prior: &prior,
            sigma: 0.4,
        };
        let cost = |correction: &[f64; 8]| {
            let squares = prior.iter().zip(correction);
            squares
                .map(|(weight, delta)| (weight * delta * 0.4).powi(2))
                .sum::<f64>()
        };
        let correction: [f64; 8] = core::array::from_fn(|index| 0.3 * index as f64 - 1.0);
        assert!((weighted.cost::<8, 9, 45>(&correction) - cost(&correction)).abs() < 1e-14);
        let before: [f64; 8] = core::array::from_fn(|index| 0.1 * index as f64 + 0.2);
        let mut gradient = before;
        weighted.add_gradient::<8, 9, 45>(&correction, &mut gradient);
        for parameter in 0..8 {
            let [above, below] = [0.5, -0.5].map(|by| {
                let mut moved = correction;
                moved[parameter] += by;
                cost(&moved)
            });
            let expected = before[parameter] + (above - below) / 2.0;
            assert!((gradient[parameter] - expected).abs() < 1e-14);
        }
        let unheld = Prior::<f64, 8, 9, 45>::unheld(&prior);
        assert_eq!(unheld, 1);
    }

    /// An end point at a distance from nominal where a step of 1 raises the cost by 10,000.
    fn end(distance: f64, cost: f64) -> Point<f64, 8, 9, 45> {
        let mut correction = [0.0; 8];
        correction[2] = distance;
        Point {
            correction,
            normal: Triangle::from_diagonal(&[100.0; 8], &[0.0; 8]),
            sum_of_squares: cost,
            cost,
        }
    }

    /// Costs tie within 4 with a stated noise and no tolerance, otherwise within a thousandth. A tie goes to the nearer
    /// end, otherwise the lower cost wins. An end with a different balance is always taken.
    #[test]
    fn the_better_of_two_ends_is_taken_and_of_a_tie_the_nearer() {
        let arm = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0]).unwrap();
        let problem = |noise| {
            let centre = Vector3::new(0.0, 0.0, -450.0);
            ArmFactor::new(NominalArm::new(&arm, &centre, noise))
        };
        let (stated, unknown) = (problem(Noise::new(0.02, 0.0).ok()), problem(None));
        let best = EndPoint {
            point: end(2.0, 10.0),
            termination: Termination::GradientVanished,
            start: StartUsed::Nominal,
            residual_sigma: 1.0,
        };
        let (nearer, farther) = (1.0, 3.0);
        for (distance, cost, of_noise, otherwise) in [
            (nearer, 12.0, true, false),
            (nearer, 15.0, false, false),
            (farther, 7.0, false, true),
            (farther, 5.0, true, true),
            (nearer, 10.005, true, true),
            (farther, 9.995, false, false),
            (farther, 9.9, false, true),
            // The same place: only the cost counts.
            (1.999, 10.005, false, false),
            (2.001, 9.995, true, true),
        ] {
            let end = end(distance, cost);
            let improved = |problem, sigma, has_tolerance| {
                best.is_improved_by(&end, sigma, has_tolerance, problem)
            };
            assert_eq!(improved(&stated, 1.0, false), of_noise, "{distance} {cost}");
            assert_eq!(improved(&stated, 1.0, true), otherwise, "{distance} {cost}");
            assert_eq!(
                improved(&unknown, 1.0, false),
                otherwise,
                "{distance} {cost}"
            );
            assert_eq!(
                improved(&unknown, 1.0, true),
                otherwise,
                "{distance} {cost}"
            );
            assert!(improved(&unknown, 0.9, true));
        }
    }
}
