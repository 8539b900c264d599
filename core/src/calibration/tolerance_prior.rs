//! The prior of a robot with toleranced parameters.

use super::tolerance::Tolerance;
use super::upper_arm::UpperArm;
use crate::Real;
#[cfg(feature = "linear")]
use crate::robot::OF_ROBOT;
use crate::robot::{Arm, Drive, OF_ARM, Parameter};
use crate::samples::{Triangle, Unknowns, part, put_row};

/// Indices of the upper arm among an arm's parameters.
const LA_X: usize = Parameter::LaX.index();
const LA_Y: usize = Parameter::LaY.index();

/// Prior knowledge of N parameters. The first 24 are the robot's; if N = 8, all belong to one arm.
///
/// Each parameter has its own σ. If the tolerance of the [joint zeros](Tolerance::with_joint_zero) is stated, upper
/// arms instead have a σ of their direction and one of their length. This prior is not quadratic: its
/// [rows](Self::rows) are those of its linearisation. In figures per parameter, such as
/// distances and shares, the length takes the place of `La_x` and the
/// direction that of `La_y`.
///
/// Towers also have a σ of their [common radius](Tolerance::radius) and one of their [common
/// forearm](Tolerance::forearm), which correlate their positions and their forearm lengths:
///
/// ```text
/// |U δ|² = δᵀ W (I − Σ γ w wᵀ) W δ,   γ = 1/(1 + |w|²)      covariance   W⁻¹ (I + Σ w wᵀ) W⁻¹
/// ```
///
/// W holds 1/σ, and w is W times the change of the parameters if all towers move outwards by their common σ, or all
/// forearms lengthen by theirs. No parameter is in both.
#[derive(Debug, Clone, PartialEq)]
pub struct TolerancePrior<T, const N: usize> {
    weights: [T; N],
    upper_arms: Option<[UpperArm<T>; 3]>,
    #[cfg(feature = "linear")]
    common: [Option<Common<T>>; 2],
}

#[cfg(feature = "linear")]
#[derive(Debug, Clone, Copy, PartialEq)]
struct Common<T> {
    /// w at Dx, Dy and Lb of each tower; 0 elsewhere.
    direction: [[T; 3]; 3],
    gamma: T,
}

impl<T: Real> TolerancePrior<T, 8> {
    /// The prior of an arm calibrated separately. A correction of parameter j by 1 is `units[j]`.
    pub fn of_arm(arm: &Arm<T>, units: &[T; 8], tolerance: Option<&Tolerance<T>>) -> Self {
        let mut weights = [T::ZERO; 8];
        let places = arm.drive().places();
        for ((weight, unit), place) in weights.iter_mut().zip(units).zip(places) {
            *weight = weight_of(*unit, place, tolerance.map(|own| |of| own.of_arm(arm, of)));
        }
        let mut prior = Self {
            weights,
            upper_arms: None,
            #[cfg(feature = "linear")]
            common: [None; 2],
        };
        prior.hold_upper_arms([arm; 3], [units; 3], tolerance);
        prior
    }
}

/// 1/σ of a parameter in the problem's unit: 0 without a tolerance, 1 at an empty place, which nothing else holds.
fn weight_of<T: Real>(
    unit: T,
    place: Option<Parameter>,
    sigma: Option<impl Fn(Parameter) -> T>,
) -> T {
    match (place, sigma) {
        (Some(parameter), Some(sigma)) => unit / sigma(parameter),
        (Some(_), None) => T::ZERO,
        (None, _) => T::ONE,
    }
}

impl<T: Real, const N: usize> TolerancePrior<T, N> {
    /// The prior of a problem in which a correction of parameter j by 1 is `units[j]`. Without a tolerance only the
    /// empty places are held. Parameters after the robot's 24 are not held.
    pub fn new(arms: [&Arm<T>; 3], units: &[T; N], tolerance: Option<&Tolerance<T>>) -> Self {
        let mut weights = [T::ZERO; N];
        let places = arms.into_iter().flat_map(|arm| arm.drive().places());
        for ((weight, unit), place) in weights.iter_mut().zip(units).zip(places) {
            *weight = weight_of(*unit, place, tolerance.map(|own| |of| own.of(of)));
        }
        let mut prior = Self {
            weights,
            upper_arms: None,
            #[cfg(feature = "linear")]
            common: tolerance.map_or([None; 2], |tolerance| Common::of(arms, tolerance)),
        };
        let mut of_arms = units.as_chunks().0.iter();
        if let (Some(one), Some(two), Some(three)) =
            (of_arms.next(), of_arms.next(), of_arms.next())
        {
            prior.hold_upper_arms(arms, [one, two, three], tolerance);
        }
        prior
    }

    fn hold_upper_arms(
        &mut self,
        arms: [&Arm<T>; 3],
        units: [&[T; OF_ARM]; 3],
        tolerance: Option<&Tolerance<T>>,
    ) {
        let [first, ..] = arms;
        let Some(tolerance) = tolerance.filter(|_| first.drive() == Drive::Rotary) else {
            return;
        };
        let Some(zero) = tolerance.joint_zero() else {
            return;
        };
        let mut units = units.into_iter();
        self.upper_arms = Some(arms.map(|arm| {
            let (x, y) = arm.la();
            let unit = units.next().map_or(T::ONE, |[.., unit, _, _]| *unit);
            let weights = [T::ONE / zero, unit / tolerance.of(Parameter::LaX)];
            UpperArm::new([x / unit, y / unit], weights)
        }));
    }

    #[cfg(test)]
    pub(crate) const fn of_weights(weights: [T; N]) -> Self {
        Self {
            weights,
            upper_arms: None,
            #[cfg(feature = "linear")]
            common: [None; 2],
        }
    }

    /// 1/σ of each parameter with its own σ, in the problem's units. Excludes upper arms with known direction and
    /// length.
    pub const fn weights(&self) -> &[T; N] {
        &self.weights
    }

    /// Mutable, to set the prior of the unknowns after the robot's.
    pub(crate) const fn weights_mut(&mut self) -> &mut [T; N] {
        &mut self.weights
    }

    /// (UᵀU)ᵢⱼ at nominal: the prior information.
    pub fn information(&self, row: usize, column: usize) -> T {
        let (Some(one), Some(other)) = (self.weights.get(row), self.weights.get(column)) else {
            return T::ZERO;
        };
        if let Some(arm) = self.upper_arm(row) {
            let [turn, stretch] = arm.jacobian([T::ZERO; 2]);
            let at = |[x, y]: [T; 2], index: usize| match index % OF_ARM {
                LA_X => x,
                LA_Y => y,
                _ => T::ZERO,
            };
            return if row / OF_ARM == column / OF_ARM {
                at(turn, row) * at(turn, column) + at(stretch, row) * at(stretch, column)
            } else {
                T::ZERO
            };
        }
        let own = if row == column { T::ONE } else { T::ZERO };
        #[cfg(feature = "linear")]
        let own = self.common.iter().flatten().fold(own, |own, common| {
            own - common.gamma * common.at(row) * common.at(column)
        });
        *one * *other * own
    }

    /// The upper arm of which a parameter is a component.
    fn upper_arm(&self, parameter: usize) -> Option<&UpperArm<T>> {
        let arms = self.upper_arms.as_ref()?;
        let arm = arms.get(parameter / OF_ARM)?;
        matches!(parameter % OF_ARM, LA_X | LA_Y).then_some(arm)
    }

    /// The upper arms with known direction and length, with the index of their `La_x`.
    fn held_arms(&self) -> impl Iterator<Item = (usize, &UpperArm<T>)> {
        let arms = self.upper_arms.as_ref().map_or(&[][..], |arms| arms);
        let own = arms.iter().take(N / OF_ARM).enumerate();
        own.map(|(arm, held)| (OF_ARM * arm + LA_X, held))
    }

    /// The weights of the parameters that have their own σ.
    fn own_weights(&self) -> [T; N] {
        let mut weights = self.weights;
        for (place, _) in self.held_arms() {
            put_pair(&mut weights, place, [T::ZERO; 2]);
        }
        weights
    }

    /// w · W δ.
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
    /// For the towers' radius and their forearms, if stated.
    fn of(arms: [&Arm<T>; 3], tolerance: &Tolerance<T>) -> [Option<Self>; 2] {
        let [first, ..] = arms;
        let [dx, dy, lb] = [Parameter::Dx, Parameter::Dy, Parameter::Lb].map(|of| tolerance.of(of));
        let common = |changes: [[T; 3]; 3], sigma: T| {
            let direction =
                changes.map(|[x, y, z]| [sigma * x / dx, sigma * y / dy, sigma * z / lb]);
            let squares = direction.as_flattened().iter().map(|own| own.squared());
            let gamma = T::ONE / squares.fold(T::ONE, |sum, own| sum + own);
            (first.drive() == Drive::Linear && sigma > T::ZERO).then_some(Self { direction, gamma })
        };
        let outwards = arms.map(Arm::outwards).map(|[x, y]| [x, y, T::ZERO]);
        let longer = [[T::ZERO, T::ZERO, T::ONE]; 3];
        [
            common(outwards, tolerance.radius()),
            common(longer, tolerance.forearm()),
        ]
    }

    /// w at a parameter.
    fn at(&self, index: usize) -> T {
        const LB: usize = Parameter::Lb.index();
        let [x, y, forearm] = match self.direction.get(index / OF_ARM) {
            Some(arm) => *arm,
            None => return T::ZERO,
        };
        match index % OF_ARM {
            0 => x,
            1 => y,
            LB => forearm,
            _ => T::ZERO,
        }
    }

    /// Writes the rows of σ U next to a diagonal σ W: the Cholesky factor of I − γ w wᵀ is
    ///
    /// ```text
    /// Rᵢᵢ = √(tᵢ/tᵢ₋₁),   Rᵢⱼ = −γ wᵢ wⱼ/√(tᵢ tᵢ₋₁),   tᵢ = 1 − γ (w₁² + … + wᵢ²)
    /// ```
    fn couple<const N: usize>(&self, rows: &mut Triangle<T, N>, weights: &[T], correction: &[T])
    where
        T: Unknowns<N>,
    {
        let gamma = self.gamma;
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

/// Replaces two neighbouring values.
fn put_pair<T>(values: &mut [T], place: usize, pair: [T; 2]) {
    let places = values.get_mut(place..).unwrap_or_default();
    if let Some(places) = places.first_chunk_mut() {
        *places = pair;
    }
}

impl<T: Unknowns<N>, const N: usize> TolerancePrior<T, N> {
    /// Overwrites a triangle with the rows (σ U, σ r) at a correction; U = ∂r/∂δ.
    pub(crate) fn put_rows(&self, sigma: T, correction: &[T; N], rows: &mut Triangle<T, N>) {
        let weights = self.own_weights().map(|weight| weight * sigma);
        let mut rights = [T::ZERO; N];
        for ((right, weight), delta) in rights.iter_mut().zip(&weights).zip(correction) {
            *right = *weight * *delta;
        }
        rows.set_diagonal(&weights, &rights);
        for (place, arm) in self.held_arms() {
            let by = part(correction, place);
            let mut block = T::columns([T::ZERO; 4]);
            let columns = block.as_mut().get_mut(place..).unwrap_or_default();
            for (index, ([x, y], r)) in arm.jacobian(by).iter().zip(arm.residuals(by)).enumerate() {
                put_row(columns, index, 0, &[sigma * *x, sigma * *y]);
                put_row(columns, index, N - place, &[sigma * r]);
            }
            rows.absorb_four(columns);
        }
        #[cfg(feature = "linear")]
        for common in self.common.iter().flatten() {
            common.couple(rows, &weights, correction);
        }
    }

    /// The same, as a new triangle.
    pub fn rows(&self, sigma: T, correction: &[T; N]) -> Triangle<T, N> {
        let mut rows = Triangle::zero();
        self.put_rows(sigma, correction, &mut rows);
        rows
    }

    /// |r|².
    pub fn cost(&self, correction: &[T; N]) -> T {
        let mut own = T::ZERO;
        for (weight, delta) in self.own_weights().iter().zip(correction) {
            own += (*weight * *delta).squared();
        }
        let own = self.held_arms().fold(own, |own, (place, arm)| {
            let [direction, length] = arm.residuals(part(correction, place));
            own + direction.squared() + length.squared()
        });
        #[cfg(feature = "linear")]
        let own = self.common.iter().flatten().fold(own, |own, common| {
            let less = common.gamma * self.along(common, correction).squared();
            (own - less).larger(T::ZERO)
        });
        own
    }

    /// Uᵀr.
    pub(crate) fn gradient(&self, correction: &[T; N]) -> [T; N] {
        let mut gradient = self.weights;
        for (weight, delta) in gradient.iter_mut().zip(correction) {
            *weight = *weight * *weight * *delta;
        }
        for (place, arm) in self.held_arms() {
            let by = part(correction, place);
            let ([[a, b], [c, d]], [r, s]) = (arm.jacobian(by), arm.residuals(by));
            put_pair(&mut gradient, place, [a * r + c * s, b * r + d * s]);
        }
        #[cfg(feature = "linear")]
        for common in self.common.iter().flatten() {
            let along = common.gamma * self.along(common, correction);
            for (index, (entry, weight)) in gradient.iter_mut().zip(&self.weights).enumerate() {
                *entry -= along * common.at(index) * *weight;
            }
        }
        gradient
    }

    /// The correction after a step; an upper arm of known direction follows its circle.
    pub(crate) fn advanced(&self, correction: &[T; N], step: &[T; N]) -> [T; N] {
        let mut advanced = *correction;
        for (value, delta) in advanced.iter_mut().zip(step) {
            *value += *delta;
        }
        for (place, arm) in self.held_arms() {
            let moved = arm.advanced(part(correction, place), part(step, place));
            put_pair(&mut advanced, place, moved);
        }
        advanced
    }

    /// Number of parameter combinations it does not constrain.
    pub(crate) fn unheld(&self) -> usize {
        let weights = self.weights.iter();
        weights.filter(|weight| **weight == T::ZERO).count()
    }

    /// Each parameter's distance from nominal, in tolerances.
    pub(crate) fn distances(&self, correction: &[T; N]) -> [T; N] {
        let mut distances = self.weights;
        for (weight, delta) in distances.iter_mut().zip(correction) {
            *weight = (*weight * *delta).magnitude();
        }
        for (place, arm) in self.held_arms() {
            let [direction, length] = arm.residuals(part(correction, place));
            let pair = [length.magnitude(), direction.magnitude()];
            put_pair(&mut distances, place, pair);
        }
        #[cfg(feature = "linear")]
        for common in self.common.iter().flatten() {
            for (index, distance) in distances.iter_mut().enumerate() {
                let variance = T::ONE + common.at(index).squared();
                *distance /= variance.square_root();
            }
        }
        distances
    }

    /// (UᵀU C)ⱼⱼ: the share of each parameter decided by the prior at a correction. `covariance`: C, by columns.
    pub(crate) fn shares(&self, correction: &[T; N], covariance: &[T]) -> [T; N] {
        let mut shares = self.weights;
        for (weight, variance) in shares.iter_mut().zip(covariance.iter().step_by(N + 1)) {
            *weight = weight.squared() * *variance;
        }
        for (place, arm) in self.held_arms() {
            let [turn, stretch] = arm.jacobian(part(correction, place));
            let block = [0, 1].map(|next| part(covariance, (N + 1) * place + N * next));
            let pair = [stretch, turn].map(|[x, y]| {
                let [[xx, xy], [yx, yy]] = block;
                x * (x * xx + y * xy) + y * (x * yx + y * yy)
            });
            put_pair(&mut shares, place, pair);
        }
        #[cfg(feature = "linear")]
        for common in self.common.iter().flatten() {
            let (columns, _) = covariance.as_chunks::<N>();
            let own = shares.iter_mut().zip(columns).zip(&self.weights);
            for (index, ((share, column), weight)) in own.enumerate() {
                let mut along = T::ZERO;
                for (index, (entry, other)) in column.iter().zip(&self.weights).enumerate() {
                    along += common.at(index) * *other * *entry;
                }
                *share -= common.gamma * common.at(index) * *weight * along;
            }
        }
        shares
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_precision_loss, clippy::float_cmp, clippy::unwrap_used)]

    use super::TolerancePrior;
    use crate::calibration::tolerance::Tolerance;
    use crate::fixtures::paper;
    use crate::robot::{Arm, Parameter};

    const UNITS: [f64; 26] = {
        let mut units = [200.0; 26];
        let mut arm = 0;
        while arm < 3 {
            (units[8 * arm + 3], units[8 * arm + 4]) = (1.0, 1.0);
            arm += 1;
        }
        units
    };

    fn tolerance() -> Tolerance<f64> {
        let tolerance = Tolerance::new(0.5, 0.004).unwrap();
        tolerance.with_joint_zero(0.1).unwrap()
    }

    /// A robot and two more unknowns, one of them known to 1/3.
    fn prior(tolerance: Option<&Tolerance<f64>>) -> TolerancePrior<f64, 26> {
        let robot = paper();
        let mut prior = TolerancePrior::new(robot.arms().each_ref(), &UNITS, tolerance);
        prior.weights_mut()[25] = 3.0;
        prior
    }

    /// Upper arms turned by a few degrees, everything else off by about a tolerance.
    fn correction() -> [f64; 26] {
        core::array::from_fn(|index| {
            let part = libm::sin(1.7 * index as f64);
            match index % 8 {
                5 | 6 => 0.15 * part,
                _ => 0.003 * part,
            }
        })
    }

    fn cost(correction: &[f64; 26]) -> f64 {
        prior(Some(&tolerance())).cost(correction)
    }

    /// Σ (p/σ)², but for an upper arm the squares of its rotation and its change of length.
    #[test]
    fn upper_arms_cost_their_turn_and_length() {
        let at = correction();
        let mut expected = (3.0 * at[25]).powi(2);
        let robot = paper();
        for (number, arm) in robot.arms().iter().enumerate() {
            let own = &at[8 * number..];
            let sigmas = [0.5, 0.5, 0.5, 0.004, 0.004, 0.0, 0.0, 0.5];
            for (index, sigma) in sigmas.into_iter().enumerate() {
                if sigma > 0.0 {
                    expected += (own[index] * UNITS[index] / sigma).powi(2);
                }
            }
            let (x, y) = arm.la();
            let moved = [x + 200.0 * own[5], y + 200.0 * own[6]];
            let turn = libm::atan2(moved[1], moved[0]) - libm::atan2(y, x);
            let longer = libm::hypot(moved[0], moved[1]) - libm::hypot(x, y);
            expected += (turn / 0.1).powi(2) + (longer / 0.5).powi(2);
        }
        assert!((cost(&at) / expected - 1.0).abs() < 1e-12);
    }

    /// The rows are a linearisation: RᵀR = σ² JᵀJ and Rᵀr = ½ σ² ∂(cost)/∂p, which is the gradient.
    #[test]
    fn rows_and_gradient_are_derivatives_of_the_cost() {
        let (prior, at) = (prior(Some(&tolerance())), correction());
        let rows = prior.rows(0.5, &at);
        let gradient = prior.gradient(&at);
        let mut summed = [0.0; 26];
        let mut squares = 0.0;
        for (index, row) in rows.rows().enumerate() {
            let right = *row.last().unwrap();
            squares += right * right;
            for (entry, sum) in row.iter().zip(summed.iter_mut().skip(index)) {
                *sum += entry * right;
            }
        }
        assert!((squares / (0.25 * cost(&at)) - 1.0).abs() < 1e-12);
        for index in 0..26 {
            let [above, below] = [1e-6, -1e-6].map(|by| {
                let mut moved = at;
                moved[index] += by;
                cost(&moved)
            });
            let expected = (above - below) / 4e-6;
            // For a cost of about ten thousand, differences over 1e-6 have six correct digits.
            let allowed = 1e-6 * cost(&at);
            assert!((gradient[index] - expected).abs() < allowed, "{index}");
            assert!((summed[index] - 0.25 * gradient[index]).abs() < 1e-9 * cost(&at));
        }
    }

    /// At nominal, an arm calibrated separately has the same information.
    #[test]
    fn information_is_that_of_direction_and_length() {
        let robot = paper();
        let prior = prior(Some(&tolerance()));
        let arm = &robot.arms()[1];
        let of_arm = TolerancePrior::of_arm(arm, UNITS.first_chunk().unwrap(), Some(&tolerance()));
        let length = arm.upper_arm_length();
        for (row, column) in [(5, 5), (5, 6), (6, 6), (3, 3), (7, 7), (7, 6)] {
            let found = prior.information(8 + row, 8 + column);
            assert!((found - of_arm.information(row, column)).abs() <= 1e-12 * found.abs());
        }
        // The nominal arm is level at joint reading 0.
        assert!((prior.information(13, 13) / f64::powi(200.0 / 0.5, 2) - 1.0).abs() < 1e-12);
        let turn = 200.0 / (length * 0.1);
        assert!((prior.information(14, 14) / (turn * turn) - 1.0).abs() < 1e-12);
        assert_eq!(prior.information(6, 14), 0.0);
    }

    /// What only the prior determines is decided entirely by it; what is known exactly, not at all.
    #[test]
    fn the_share_is_of_length_and_direction() {
        let (prior, at) = (prior(Some(&tolerance())), correction());
        let rows = prior.rows(1.0, &at);
        let mut covariance = [[0.0; 26]; 26];
        for (index, column) in covariance.iter_mut().enumerate() {
            if prior.weights()[index] > 0.0 {
                column[index] = prior.weights()[index].powi(-2);
            }
        }
        for first in [5, 13, 21] {
            let (a, b) = (rows.row(first)[0], rows.row(first)[1]);
            let c = rows.row(first + 1)[0];
            let determinant = (a * c).powi(2);
            covariance[first][first] = (b * b + c * c) / determinant;
            covariance[first + 1][first + 1] = a * a / determinant;
            covariance[first][first + 1] = -a * b / determinant;
            covariance[first + 1][first] = -a * b / determinant;
        }
        let share = |covariance: &[f64], index| prior.shares(&at, covariance)[index];
        for index in (0..26).filter(|index| *index != 24) {
            let found = share(covariance.as_flattened(), index);
            assert!((found - 1.0).abs() < 1e-10, "{index} {found}");
            assert_eq!(share(&[0.0; 676], index), 0.0);
        }
        assert_eq!(prior.unheld(), 1);
    }

    /// The length is at the place of `La_x`, the direction at that of `La_y`.
    #[test]
    fn the_distance_is_in_tolerances_of_length_and_direction() {
        let robot = paper();
        let (la, _) = robot.arms()[0].la();
        let mut at = [0.0; 26];
        let (turn, longer) = (0.25, -1.0);
        at[5] = ((la + longer) * libm::cos(turn) - la) / 200.0;
        at[6] = (la + longer) * libm::sin(turn) / 200.0;
        let prior = prior(Some(&tolerance()));
        for (index, expected) in [(5, 2.0), (6, 2.5), (4, 0.0), (13, 0.0)] {
            let found = prior.distances(&at)[index];
            assert!((found - expected).abs() < 1e-10, "{index} {found}");
        }
    }

    /// Without a stated joint zero, the direction is unknown.
    #[test]
    fn without_a_joint_zero_both_components_are_lengths() {
        let plain = Tolerance::new(0.5, 0.004).unwrap();
        let prior = prior(Some(&plain));
        assert_eq!(prior.information(5, 5), f64::powi(400.0, 2));
        assert_eq!(prior.information(6, 6), f64::powi(400.0, 2));
        let arm = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 208.0, 156.0, 480.0]).unwrap();
        assert_eq!(plain.of_arm(&arm, Parameter::LaY), 0.5);
        // σ is 0.5 mm for the arm's length, and 0.1 of 260 mm for its direction.
        let [x, y] = [Parameter::LaX, Parameter::LaY].map(|of| tolerance().of_arm(&arm, of));
        assert!((x - libm::hypot(0.8 * 0.5, 0.6 * 26.0)).abs() < 1e-12);
        assert!((y - libm::hypot(0.6 * 0.5, 0.8 * 26.0)).abs() < 1e-12);
    }
}
