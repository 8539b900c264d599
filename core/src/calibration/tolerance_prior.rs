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
/// [common radius](Tolerance::radius) and of their [common forearm](Tolerance::forearm), which correlate where
/// they stand and how long the forearms are. The first 24 are the robot's.
///
/// ```text
/// |U δ|² = δᵀ W (I − Σ γ v vᵀ) W δ,   γ = ρ/(1 + ρ)      covariance   W⁻¹ (I + Σ ρ v vᵀ) W⁻¹
/// ```
///
/// W holds 1/σ, v is the unit vector along W times the direction in which all towers move outwards, or all
/// forearms lengthen, and ρ = 3 (σ of what is common/σ of a length)². No parameter is in both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TolerancePrior<T, const N: usize> {
    weights: [T; N],
    #[cfg(feature = "linear")]
    common: [Option<Common<T>>; 2],
}

#[cfg(feature = "linear")]
#[derive(Debug, Clone, Copy, PartialEq)]
struct Common<T> {
    /// v at Dx, Dy and Lb of each tower; 0 elsewhere.
    direction: [[T; 3]; 3],
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
            common: tolerance.map_or([None; 2], |tolerance| Common::of(arms, tolerance)),
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
        let own = self.common.iter().flatten().fold(own, |own, common| {
            own - common.gamma() * common.at(row) * common.at(column)
        });
        *one * *other * own
    }

    /// v · W δ.
    #[cfg(feature = "linear")]
    fn along(&self, common: &Common<T>, correction: &[T; N]) -> T {
        let mut sum = T::ZERO;
        for (index, (weight, delta)) in self.weights.iter().zip(correction).enumerate() {
            sum += common.at(index) * *weight * *delta;
        }
        sum
    }
}

#[cfg(feature = "linear")]
impl<T: Real> Common<T> {
    /// Of the towers' radius and of their forearms, where there is one.
    fn of(arms: [&Arm<T>; 3], tolerance: &Tolerance<T>) -> [Option<Self>; 2] {
        use crate::robot::{Drive, Parameter};
        let [first, ..] = arms;
        let three = T::from_f64(3.0);
        let part = T::ONE / three.square_root();
        let outwards = arms.map(|arm| {
            let [x, y] = arm.outwards();
            [part * x, part * y, T::ZERO]
        });
        let longer = [[T::ZERO, T::ZERO, part]; 3];
        let common = |direction, sigma: T| {
            let rho = three * (sigma / tolerance.of(Parameter::Lb)).squared();
            (first.drive() == Drive::Linear && sigma > T::ZERO).then_some(Self { direction, rho })
        };
        [
            common(outwards, tolerance.radius()),
            common(longer, tolerance.forearm()),
        ]
    }

    fn gamma(&self) -> T {
        self.rho / (T::ONE + self.rho)
    }

    /// v at a parameter.
    fn at(&self, index: usize) -> T {
        use crate::robot::Parameter;
        const LB: usize = Parameter::Lb.index();
        let [x, y, forearm] = match self.direction.get(index / 8) {
            Some(arm) => *arm,
            None => return T::ZERO,
        };
        match index % 8 {
            0 => x,
            1 => y,
            LB => forearm,
            _ => T::ZERO,
        }
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
        {
            let weights = self.weights.map(|weight| weight * sigma);
            let mut rows = Prior::<T, N, M, E>::rows(&self.weights, sigma, correction);
            for common in self.common.iter().flatten() {
                common.couple(&mut rows, &weights, correction);
            }
            rows
        }
        #[cfg(not(feature = "linear"))]
        Prior::<T, N, M, E>::rows(&self.weights, sigma, correction)
    }

    fn cost(&self, correction: &[T; N]) -> T {
        let own = Prior::<T, N, M, E>::cost(&self.weights, correction);
        #[cfg(feature = "linear")]
        let own = self.common.iter().flatten().fold(own, |own, common| {
            let less = common.gamma() * self.along(common, correction).squared();
            (own - less).larger(T::ZERO)
        });
        own
    }

    fn gradient(&self, correction: &[T; N]) -> [T; N] {
        #[allow(unused_mut)] // without linear drives
        let mut gradient = Prior::<T, N, M, E>::gradient(&self.weights, correction);
        #[cfg(feature = "linear")]
        for common in self.common.iter().flatten() {
            let along = common.gamma() * self.along(common, correction);
            for (index, (entry, weight)) in gradient.iter_mut().zip(&self.weights).enumerate() {
                *entry -= along * common.at(index) * *weight;
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
        let own = self.common.iter().flatten().fold(own, |own, common| {
            let variance = T::ONE + common.rho * common.at(parameter).squared();
            own / variance.square_root()
        });
        own
    }

    fn share(&self, covariance: &[T], parameter: usize) -> T {
        let own = Prior::<T, N, M, E>::share(&self.weights, covariance, parameter);
        #[cfg(feature = "linear")]
        let own = self.common.iter().flatten().fold(own, |own, common| {
            let column = covariance.chunks_exact(N.max(1)).nth(parameter);
            let (Some(column), Some(weight)) = (column, self.weights.get(parameter)) else {
                return own;
            };
            let mut along = T::ZERO;
            for (index, (entry, other)) in column.iter().zip(&self.weights).enumerate() {
                along += common.at(index) * *other * *entry;
            }
            own - common.gamma() * common.at(parameter) * *weight * along
        });
        own
    }
}
