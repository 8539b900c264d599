//! The prior of a robot whose parameters are known to a tolerance.

use super::problem::Prior;
use super::tolerance::Tolerance;
use crate::Real;
use crate::robot::{Arm, Robot};
use crate::samples::Triangle;

/// Of the robot, which come before any others.
#[cfg(feature = "linear")]
const OF_ROBOT: usize = 24;

/// What is known of N parameters beside the samples: one σ of each, and of towers one σ of their
/// [common radius](Tolerance::radius), which correlates where they stand. The first 24 are the robot's.
///
/// ```text
/// |U δ|² = δᵀ W (I − γ v vᵀ) W δ,   γ = ρ/(1 + ρ)      covariance   W⁻¹ (I + ρ v vᵀ) W⁻¹
/// ```
///
/// W holds 1/σ, v is the unit vector along W times the direction in which all towers move outwards, and
/// ρ = 3 (σ of the common radius/σ of a length)².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TolerancePrior<T, const N: usize> {
    weights: [T; N],
    #[cfg(feature = "linear")]
    radius: Option<CommonRadius<T>>,
}

#[cfg(feature = "linear")]
#[derive(Debug, Clone, Copy, PartialEq)]
struct CommonRadius<T> {
    /// v at Dx and Dy of each tower; 0 elsewhere.
    direction: [[T; 2]; 3],
    rho: T,
}

impl<T: Real> TolerancePrior<T, 24> {
    /// For a problem in which a correction of parameter j by 1 is `units[j]`. Without a tolerance nothing holds
    /// the parameters, but for the places that the arms leave empty.
    pub fn new(robot: &Robot<T>, units: &[T; 24], tolerance: Option<&Tolerance<T>>) -> Self {
        let mut weights = [T::ZERO; 24];
        let places = robot.drive().places();
        for ((weight, unit), parameter) in weights.iter_mut().zip(units).zip(places.iter().cycle())
        {
            *weight = match (parameter, tolerance) {
                (Some(parameter), Some(tolerance)) => *unit / tolerance.of(*parameter),
                (Some(_), None) => T::ZERO,
                // Nothing else holds a place that the arms leave empty.
                (None, _) => T::ONE,
            };
        }
        let [first, second, third] = robot.arms();
        Self::coupled(weights, [first, second, third], tolerance)
    }
}

impl<T: Real, const N: usize> TolerancePrior<T, N> {
    /// With 1/σ of each parameter in the problem's units.
    #[inline]
    #[cfg_attr(not(feature = "linear"), allow(unused_variables))]
    pub(crate) fn coupled(
        weights: [T; N],
        arms: [&Arm<T>; 3],
        tolerance: Option<&Tolerance<T>>,
    ) -> Self {
        Self {
            weights,
            #[cfg(feature = "linear")]
            radius: tolerance.and_then(|tolerance| CommonRadius::of(arms, tolerance)),
        }
    }

    /// 1/σ of each parameter by itself, in the problem's units.
    pub const fn weights(&self) -> &[T; N] {
        &self.weights
    }

    /// (UᵀU)ᵢⱼ: what is known beforehand, as information.
    pub fn information(&self, row: usize, column: usize) -> T {
        let (Some(one), Some(other)) = (self.weights.get(row), self.weights.get(column)) else {
            return T::ZERO;
        };
        let own = if row == column { T::ONE } else { T::ZERO };
        #[cfg(feature = "linear")]
        let own = match &self.radius {
            Some(radius) => own - radius.gamma() * radius.at(row) * radius.at(column),
            None => own,
        };
        *one * *other * own
    }

    /// v · W δ.
    #[cfg(feature = "linear")]
    fn along(&self, radius: &CommonRadius<T>, correction: &[T; N]) -> T {
        let mut sum = T::ZERO;
        for (index, (weight, delta)) in self.weights.iter().zip(correction).enumerate() {
            sum += radius.at(index) * *weight * *delta;
        }
        sum
    }
}

#[cfg(feature = "linear")]
impl<T: Real> CommonRadius<T> {
    /// `None` where there is none.
    fn of(arms: [&Arm<T>; 3], tolerance: &Tolerance<T>) -> Option<Self> {
        use crate::robot::{Drive, Parameter};
        let sigma = tolerance.radius();
        let [first, ..] = arms;
        if first.drive() != Drive::Linear || !(sigma > T::ZERO) {
            return None;
        }
        let three = T::from_f64(3.0);
        let part = T::ONE / three.square_root();
        let direction = arms.map(|arm| {
            let [x, y] = arm.outwards();
            [part * x, part * y]
        });
        let rho = three * (sigma / tolerance.of(Parameter::Dx)).squared();
        Some(Self { direction, rho })
    }

    fn gamma(&self) -> T {
        self.rho / (T::ONE + self.rho)
    }

    /// v at a parameter.
    fn at(&self, index: usize) -> T {
        let arm = self.direction.get(index / 8);
        let entry = arm.and_then(|arm| arm.get(index % 8));
        entry.copied().unwrap_or(T::ZERO)
    }

    /// Puts the rows of σ U beside a diagonal σ W: the Cholesky factor of I − γ v vᵀ is
    ///
    /// ```text
    /// Rᵢᵢ = √(tᵢ/tᵢ₋₁),   Rᵢⱼ = −γ vᵢ vⱼ/√(tᵢ tᵢ₋₁),   tᵢ = 1 − γ (v₁² + … + vᵢ²)
    /// ```
    fn couple<const M: usize, const E: usize>(
        &self,
        rows: &mut Triangle<T, M, E>,
        weights: &[T],
        correction: &[T],
    ) {
        let gamma = self.gamma();
        let mut before = T::ONE;
        for index in 0..OF_ROBOT.min(weights.len()) {
            let own = self.at(index);
            if own == T::ZERO {
                continue;
            }
            let after = before - gamma * own.squared();
            let pivot = (after / before).square_root();
            let factor = -(gamma * own) / (after * before).square_root();
            let mut right = T::ZERO;
            let coupled = weights.iter().zip(correction).enumerate().skip(index);
            for ((column, (weight, delta)), entry) in coupled.zip(rows.row_mut(index)) {
                let part = if column == index {
                    pivot
                } else {
                    factor * self.at(column)
                };
                *entry = part * *weight;
                right += *entry * *delta;
            }
            if let Some(entry) = rows.row_mut(index).last_mut() {
                *entry = right;
            }
            before = after;
        }
    }
}

impl<T: Real, const N: usize, const M: usize, const E: usize> Prior<T, N, M, E>
    for TolerancePrior<T, N>
{
    fn rows(&self, sigma: T, correction: &[T; N]) -> Triangle<T, M, E> {
        #[cfg(feature = "linear")]
        if let Some(radius) = &self.radius {
            let weights = self.weights.map(|weight| weight * sigma);
            let mut rows = Prior::<T, N, M, E>::rows(&self.weights, sigma, correction);
            radius.couple(&mut rows, &weights, correction);
            return rows;
        }
        Prior::<T, N, M, E>::rows(&self.weights, sigma, correction)
    }

    fn cost(&self, correction: &[T; N]) -> T {
        let own = Prior::<T, N, M, E>::cost(&self.weights, correction);
        #[cfg(feature = "linear")]
        if let Some(radius) = &self.radius {
            let common = radius.gamma() * self.along(radius, correction).squared();
            return (own - common).larger(T::ZERO);
        }
        own
    }

    fn gradient(&self, correction: &[T; N]) -> [T; N] {
        #[allow(unused_mut)] // without linear drives
        let mut gradient = Prior::<T, N, M, E>::gradient(&self.weights, correction);
        #[cfg(feature = "linear")]
        if let Some(radius) = &self.radius {
            let common = radius.gamma() * self.along(radius, correction);
            for (index, (entry, weight)) in gradient.iter_mut().zip(&self.weights).enumerate() {
                *entry -= common * radius.at(index) * *weight;
            }
        }
        gradient
    }

    fn unheld(&self) -> usize {
        Prior::<T, N, M, E>::unheld(&self.weights)
    }

    fn distance(&self, correction: &[T; N], parameter: usize) -> T {
        let own = Prior::<T, N, M, E>::distance(&self.weights, correction, parameter);
        #[cfg(feature = "linear")]
        if let Some(radius) = &self.radius {
            let variance = T::ONE + radius.rho * radius.at(parameter).squared();
            return own / variance.square_root();
        }
        own
    }

    fn share(&self, covariance: &[T], parameter: usize) -> T {
        let own = Prior::<T, N, M, E>::share(&self.weights, covariance, parameter);
        #[cfg(feature = "linear")]
        if let (Some(radius), Some(column), Some(weight)) = (
            &self.radius,
            covariance.chunks_exact(N.max(1)).nth(parameter),
            self.weights.get(parameter),
        ) {
            let mut common = T::ZERO;
            for (index, (entry, other)) in column.iter().zip(&self.weights).enumerate() {
                common += radius.at(index) * *other * *entry;
            }
            return own - radius.gamma() * radius.at(parameter) * *weight * common;
        }
        own
    }
}
