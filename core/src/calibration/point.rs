//! A correction at which a problem is linearised, and the prior's share of the cost there.

use super::limits::{INDISTINGUISHABLE, NEARER, SAME_POINT, TIE};
use super::outcome::{Start, Termination};
use super::problem::{Extent, Judged};
use super::tolerance_prior::TolerancePrior;
use crate::Real;
use crate::samples::{Triangle, Unknowns, squares};

/// A correction, the problem linearised there, and its cost.
#[derive(Debug, Clone)]
pub(crate) struct Point<T: Unknowns<N>, const N: usize> {
    pub(crate) correction: [T; N],
    pub(crate) normal: Triangle<T, N>,
    /// Σ r² at the correction, and with the prior's share.
    pub(crate) sum_of_squares: T,
    pub(crate) cost: T,
}

impl<T: Unknowns<N>, const N: usize> Point<T, N> {
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

/// Rounds of noise estimation if a tolerance but no noise is stated.
const ROUNDS: u8 = 20;

/// The prior, and the noise against which it is weighted.
///
/// An unknown noise is estimated iteratively from the residuals so that samples and tolerance have the right weights
/// (`MacKay`'s evidence iteration, σ² = Σr²/(n − γ) with γ the number of parameters determined by the samples).
#[derive(Debug, Clone)]
pub(crate) struct Weighted<T: Real, const N: usize> {
    pub(crate) prior: TolerancePrior<T, N>,
    /// σ of the weighted residual; 1 with a stated noise.
    pub(crate) sigma: T,
    /// How often it was estimated.
    pub(super) rounds: u8,
}

impl<T: Unknowns<N>, const N: usize> Weighted<T, N> {
    pub(super) const fn new(prior: TolerancePrior<T, N>) -> Self {
        Self {
            prior,
            sigma: T::ONE,
            rounds: 0,
        }
    }

    pub(super) fn cost(&self, correction: &[T; N]) -> T {
        self.prior.cost(correction) * self.sigma.squared()
    }

    pub(super) fn add_gradient(&self, correction: &[T; N], to: &mut [T; N]) {
        for (sum, part) in to.iter_mut().zip(self.prior.gradient(correction)) {
            *sum += part * self.sigma.squared();
        }
    }

    /// Whether to solve once more, with the σ estimated here from the best end point and its covariance.
    pub(super) fn balance(
        &mut self,
        extent: &Extent<T>,
        best: Option<&EndPoint<T, N>>,
        covariance: &[T],
    ) -> bool {
        if self.rounds >= ROUNDS {
            return false;
        }
        let Some(best) = best else {
            // Too weak a tolerance leaves the problem without a well-defined minimum: start from a stronger one.
            self.rounds += 1;
            self.sigma *= T::from_f64(10.0);
            return true;
        };
        // γ = N − Σ σ² (UᵀU C)ⱼⱼ
        let mut determined = T::from_count(N as u64);
        for share in self.prior.shares(&best.point.correction, covariance) {
            determined -= share * best.residual_sigma.squared();
        }
        let spare = extent.residuals - determined;
        if !(spare > T::from_f64(1e-3)) {
            return false;
        }
        let least = T::from_f64(8.0) * T::EPSILON;
        let sigma = (best.point.sum_of_squares / spare)
            .square_root()
            .larger(least);
        let change = (sigma - best.residual_sigma).magnitude();
        if best.residual_sigma != self.sigma || !(change > T::from_f64(0.01) * self.sigma) {
            // Converged; or the last round failed, and the previous one stands.
            return false;
        }
        self.rounds += 1;
        self.sigma = sigma;
        true
    }
}

/// Where an iteration ended.
#[derive(Debug, Clone)]
pub(super) struct EndPoint<T: Unknowns<N>, const N: usize> {
    pub(super) point: Point<T, N>,
    pub(super) termination: Termination,
    pub(super) start: Start,
    /// σ of the residuals when samples and tolerance were balanced.
    pub(super) residual_sigma: T,
}

impl<T: Unknowns<N>, const N: usize> EndPoint<T, N> {
    /// Whether another end point is preferable: a clearly smaller cost, or, if the samples cannot distinguish the two,
    /// the solution nearer to nominal. Eight samples have several exact solutions.
    pub(super) fn is_improved_by(
        &self,
        end: &Point<T, N>,
        residual_sigma: T,
        has_tolerance: bool,
        problem: &impl Judged<T, N>,
    ) -> bool {
        // With a tolerance, the cost itself prefers the nearer solution.
        let tie = if problem.extent().unit.is_none() && !has_tolerance {
            T::from_f64(INDISTINGUISHABLE)
        } else {
            // If two starts reach the same point, the first is kept.
            T::from_f64(TIE) * self.point.cost
        } + problem.rounding_of_cost();
        let gained = self.point.cost - end.cost;
        if residual_sigma != self.residual_sigma {
            // Samples and tolerance were balanced differently: the later end counts.
            return true;
        }
        let same_place = self.point.is_at(&end.correction, tie);
        if gained.magnitude() <= tie && !same_place {
            squares(&end.correction) < T::from_f64(NEARER) * squares(&self.point.correction)
        } else {
            gained > T::ZERO
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_precision_loss, clippy::unwrap_used)]

    use super::EndPoint;
    use crate::calibration::outcome::{Start, Termination};
    use crate::calibration::point::Point;
    use crate::robot::Arm;
    use crate::samples::{ArmFactor, Noise, NominalArm, Triangle};
    use nalgebra::Vector3;

    /// An end point at a distance from nominal where a step of 1 raises the cost by 10,000.
    fn end(distance: f64, cost: f64) -> Point<f64, 8> {
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
            start: Start::Nominal,
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
