//! The prior of a robot whose place in the measuring frame is not known.

use super::calibrator::workspace_centre;
use super::problem::Prior;
use super::tolerance::Tolerance;
use super::tolerance_prior::TolerancePrior;
use crate::Real;
use crate::robot::{Arm, Drive, Robot};
use crate::samples::{Triangle, put_row};
use nalgebra::{SMatrix, Vector3};

/// Rows that are reduced together.
const ROWS: usize = 4;

/// A tolerance about a nominal robot that may stand anywhere near its nominal place: the frame's six numbers
/// are estimated together with the parameters.
///
/// ```text
/// minimise over τ   |U (δ − G τ)|²   =   |(I − Q Qᵀ) U δ|²,   U G = Q R
/// ```
///
/// U holds 1/tolerance, of towers with a common radius a root of the information, and the columns of G are how the 24 parameters change when the robot is moved as
/// a rigid body by three small translations and three small rotations. δ is measured in the frame in which
/// the nominal robot stands, τ is what that frame is off by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeFrame<T: Real> {
    /// U: 1/tolerance in the problem's units, or 1 without a tolerance.
    known: TolerancePrior<T, 24>,
    /// Columns of Q.
    motions: [[T; 24]; 6],
    /// R of U G = Q R, by columns.
    factor: [[T; 6]; 6],
    centre: Vector3<T>,
    /// (I − Q Qᵀ) U, reduced to a triangle; zeros without a tolerance.
    rows: Triangle<T, 25, 325>,
}

/// A small motion of a rigid body: x → x + translation + rotation × (x − centre).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<T: Real> {
    /// Length.
    pub translation: Vector3<T>,
    /// Radians.
    pub rotation: Vector3<T>,
    /// Length.
    pub centre: Vector3<T>,
}

impl<T: Real> FreeFrame<T> {
    /// For a problem in which a correction of parameter j by 1 is `units[j]`. Without a tolerance nothing
    /// holds the parameters, and the frame is that in which their corrections are least.
    pub fn new(robot: &Robot<T>, units: &[T; 24], tolerance: Option<&Tolerance<T>>) -> Self {
        let centre = workspace_centre(robot);
        let places = robot.drive().places();
        let mut weights = [T::ONE; 24];
        if let Some(tolerance) = tolerance {
            for ((weight, unit), parameter) in
                weights.iter_mut().zip(units).zip(places.iter().cycle())
            {
                if let Some(parameter) = parameter {
                    *weight = *unit / tolerance.of(*parameter);
                }
            }
        }
        let [first, second, third] = robot.arms();
        let known = TolerancePrior::coupled(weights, [first, second, third], tolerance);
        let mut motions = [[T::ZERO; 24]; 6];
        for (axis, motion) in motions.iter_mut().enumerate() {
            let mut places = motion.iter_mut().zip(&weights).zip(units);
            for arm in robot.arms() {
                for value in moved(arm, &centre, axis) {
                    if let Some(((entry, weight), unit)) = places.next()
                        && *unit != T::ZERO
                    {
                        *entry = value / *unit * *weight;
                    }
                }
            }
            known.uncorrelate(motion);
        }
        let factor = orthonormalise(&mut motions);
        let mut prior = Self {
            known,
            motions,
            factor,
            centre,
            rows: Triangle::zero(),
        };
        if tolerance.is_some() {
            prior.reduce();
        } else {
            // Nothing else holds the places that the arms leave empty.
            let empty = units.map(|unit| if unit == T::ZERO { T::ONE } else { T::ZERO });
            prior.rows = Triangle::from_diagonal(&empty, &[T::ZERO; 24]);
        }
        prior
    }

    /// Whether there is a tolerance.
    fn holds(&self) -> bool {
        let pivot = self.rows.row(0).first();
        pivot.is_some_and(|pivot| *pivot != T::ZERO)
    }

    /// Row j of (I − Q Qᵀ) U.
    fn row(&self, index: usize) -> [T; 24] {
        let mut row = [T::ZERO; 24];
        for (column, entry) in row.iter_mut().enumerate() {
            let mut part = if column == index { T::ONE } else { T::ZERO };
            for motion in &self.motions {
                if let (Some(own), Some(other)) = (motion.get(index), motion.get(column)) {
                    part -= *own * *other;
                }
            }
            *entry = part;
        }
        self.known.uncorrelate(&mut row);
        for (entry, weight) in row.iter_mut().zip(self.known.weights()) {
            *entry *= *weight;
        }
        row
    }

    fn reduce(&mut self) {
        for first in (0..24).step_by(ROWS) {
            let mut block = [[T::ZERO; ROWS]; 25];
            for index in 0..ROWS {
                put_row(&mut block, index, 0, &self.row(first + index));
            }
            self.rows.absorb(&mut block);
        }
    }

    /// Qᵀ U δ.
    fn along(&self, correction: &[T; 24]) -> [T; 6] {
        let mut weighed = *correction;
        for (delta, weight) in weighed.iter_mut().zip(self.known.weights()) {
            *delta = *weight * *delta;
        }
        self.known.uncorrelate(&mut weighed);
        let mut parts = [T::ZERO; 6];
        for (part, motion) in parts.iter_mut().zip(&self.motions) {
            for (entry, delta) in motion.iter().zip(&weighed) {
                *part += *entry * *delta;
            }
        }
        parts
    }

    /// The motion of the nominal robot that comes nearest to a correction: τ = R⁻¹ Qᵀ U δ.
    pub fn motion(&self, correction: &[T; 24]) -> Motion<T> {
        let mut parts = self.along(correction);
        for index in (0..6).rev() {
            let mut value = parts.get(index).copied().unwrap_or(T::ZERO);
            for (column, known) in self.factor.iter().zip(parts).skip(index + 1) {
                value -= column.get(index).copied().unwrap_or(T::ZERO) * known;
            }
            let pivot = self.factor.get(index).and_then(|column| column.get(index));
            if let (Some(part), Some(pivot)) = (parts.get_mut(index), pivot) {
                *part = if pivot.magnitude() > T::ZERO {
                    value / *pivot
                } else {
                    T::ZERO
                };
            }
        }
        let [x, y, z, a, b, c] = parts;
        Motion {
            translation: Vector3::new(x, y, z),
            rotation: Vector3::new(a, b, c),
            centre: self.centre,
        }
    }

    /// U δ.
    fn product(&self, correction: &[T; 24]) -> [T; 24] {
        let mut product = [T::ZERO; 24];
        for (index, (entry, row)) in product.iter_mut().zip(self.rows.rows()).enumerate() {
            let below = correction.get(index..).unwrap_or_default();
            for (factor, delta) in row.iter().zip(below) {
                *entry += *factor * *delta;
            }
        }
        product
    }
}

impl<T: Real> Prior<T, 24, 25, 325> for FreeFrame<T> {
    fn rows(&self, sigma: T, correction: &[T; 24]) -> Triangle<T, 25, 325> {
        let mut rows = self.rows.with_last_column(&self.product(correction));
        rows.scale(sigma);
        rows
    }

    fn cost(&self, correction: &[T; 24]) -> T {
        let mut sum = T::ZERO;
        for entry in self.product(correction) {
            sum += entry.squared();
        }
        sum
    }

    fn gradient(&self, correction: &[T; 24]) -> [T; 24] {
        let mut gradient = [T::ZERO; 24];
        for (index, (row, part)) in self.rows.rows().zip(self.product(correction)).enumerate() {
            for (entry, factor) in gradient.iter_mut().skip(index).zip(row) {
                *entry += *factor * part;
            }
        }
        gradient
    }

    fn unheld(&self) -> usize {
        if self.holds() {
            return self.motions.len();
        }
        let pivots = self.rows.rows().take(24);
        pivots
            .filter(|row| row.first().is_none_or(|pivot| *pivot == T::ZERO))
            .count()
    }

    fn distance(&self, correction: &[T; 24], parameter: usize) -> T {
        if !self.holds() {
            return T::ZERO;
        }
        let mut distance = T::ZERO;
        for (entry, delta) in self.row(parameter).iter().zip(correction) {
            distance += *entry * *delta;
        }
        distance.magnitude()
    }

    fn share(&self, covariance: &[T], parameter: usize) -> T {
        let Some(column) = covariance.chunks_exact(24).nth(parameter) else {
            return T::ZERO;
        };
        let mut own = [T::ZERO; 24];
        own.copy_from_slice(column);
        // (UᵀU C)ⱼⱼ = Σ over the rows i of Uᵢⱼ (U C)ᵢⱼ.
        let mut share = T::ZERO;
        for (index, (row, product)) in self.rows.rows().zip(self.product(&own)).enumerate() {
            if let Some(entry) = parameter
                .checked_sub(index)
                .and_then(|place| row.get(place))
            {
                share += *entry * product;
            }
        }
        share
    }
}

/// How an arm's parameters change with a translation along an axis (0 to 2) or a rotation about it (3 to
/// 5). A rotation ω of the arm is one of θ about z, of α about ex and of the upper arm about the motor
/// axis ey; of a linear drive it leans the tower.
fn moved<T: Real>(arm: &Arm<T>, centre: &Vector3<T>, axis: usize) -> [T; 8] {
    let mut direction = Vector3::zeros();
    if let Some(entry) = direction.get_mut(axis % 3) {
        *entry = T::ONE;
    }
    let zero = T::ZERO;
    if axis < 3 {
        return [
            direction.x,
            direction.y,
            direction.z,
            zero,
            zero,
            zero,
            zero,
            zero,
        ];
    }
    let basis = arm.basis();
    let d = direction.cross(&(arm.d() - centre));
    if arm.drive() == Drive::Linear {
        let turned = direction.cross(&basis.ez);
        return [
            d.x,
            d.y,
            d.z,
            turned.x / basis.ex.x,
            turned.y / basis.ey.y,
            zero,
            zero,
            zero,
        ];
    }
    let theta = direction.dot(&basis.ez) / basis.ez.z;
    let alpha = direction.dot(&basis.ex);
    let upper_arm = direction.dot(&basis.ey) - basis.ey.z * theta;
    let (la_x, la_y) = arm.la();
    [
        d.x,
        d.y,
        d.z,
        theta,
        alpha,
        la_y * upper_arm,
        -(la_x * upper_arm),
        zero,
    ]
}

/// Gram–Schmidt, twice over for the rounding; returns R by columns.
fn orthonormalise<T: Real>(columns: &mut [[T; 24]; 6]) -> [[T; 6]; 6] {
    let mut factor = SMatrix::<T, 6, 6>::zeros();
    for index in 0..6 {
        for _ in 0..2 {
            for before in 0..index {
                let (Some(other), Some(column)) =
                    (columns.get(before).copied(), columns.get_mut(index))
                else {
                    continue;
                };
                let mut part = T::ZERO;
                for (a, b) in other.iter().zip(column.iter()) {
                    part += *a * *b;
                }
                for (entry, source) in column.iter_mut().zip(other) {
                    *entry -= part * source;
                }
                if let Some(entry) = factor.get_mut((before, index)) {
                    *entry += part;
                }
            }
        }
        let Some(column) = columns.get_mut(index) else {
            continue;
        };
        let mut squared = T::ZERO;
        for entry in column.iter() {
            squared += entry.squared();
        }
        let length = squared.square_root();
        if length > T::ZERO {
            for entry in column.iter_mut() {
                *entry /= length;
            }
        }
        if let Some(entry) = factor.get_mut((index, index)) {
            *entry = length;
        }
    }
    factor.data.0
}
