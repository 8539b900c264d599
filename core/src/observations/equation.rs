//! The expected reading of an instrument and its derivatives.

use super::instruments::Instruments;
use super::observation::{Distance, DistanceFrom, Height, Observation, READINGS};
use crate::Real;
use crate::frame::{RigidTransform, product, rotation_of};
use crate::robot::Robot;
use crate::samples::part;
use nalgebra::{Matrix3, Vector3, Vector4};

/// The difference between a reading and its expected value, with derivatives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Equation<T: Real> {
    /// Measured minus expected. Length.
    pub(super) residual: T,
    /// ∂h/∂X.
    pub(super) by_position: Vector3<T>,
    /// Whether h also depends on the other pose's position, with the opposite derivative.
    pub(super) between_poses: bool,
    /// Index of the first unknown that h depends on, among all parameters.
    pub(super) column: usize,
    /// ∂h/∂u for the unknowns from there on.
    pub(super) by_unknowns: [T; 6],
    /// σ of the reading alone. Length.
    pub(super) sigma: T,
}

/// w/2, rotation and translation of the coordinate frame: the rotation by the Gibbs vector w/2, applied after that of
/// the start.
pub(super) fn frame_at<T: Real>(
    start: &RigidTransform<T>,
    unknowns: &[T],
) -> (Vector3<T>, Matrix3<T>, Vector3<T>) {
    let [x, y, z, a, b, c] = part(unknowns, 0);
    let half = Vector3::new(a, b, c) * T::HALF;
    let turn = rotation_of(&Vector4::new(T::ONE, half.x, half.y, half.z));
    let columns = start.rotation.data.0.map(Vector3::from);
    let turned = Matrix3::from_columns(&columns.map(|column| product(&turn, &column)));
    (half, turned, start.translation + Vector3::new(x, y, z))
}

/// What rows are compared with: a robot, its instruments, and values of the unknowns, indexed among all parameters.
pub(crate) struct At<'a, T: Real> {
    pub(super) robot: &'a Robot<T>,
    pub(super) instruments: &'a Instruments<'a, T>,
    pub(super) frame: &'a RigidTransform<T>,
    pub(super) unknowns: &'a [T],
}

impl<T: Real> At<'_, T> {
    /// The equations of an observation at given platform positions.
    pub(crate) fn equations(
        &self,
        observation: &Observation<T>,
        position: &Vector3<T>,
        other: Option<&Vector3<T>>,
    ) -> [Option<Equation<T>>; READINGS] {
        let (instruments, unknowns) = (self.instruments, self.unknowns);
        let [x, y, z] = coordinates(observation, instruments, self.frame, unknowns, position);
        let height = observation
            .height
            .map(|height| of_height(&height, instruments, unknowns, position));
        let distance = observation
            .distance
            .map(|distance| of_distance(&distance, instruments, unknowns, position, other));
        [x, y, z, height, distance]
    }
}

fn coordinates<T: Real>(
    observation: &Observation<T>,
    instruments: &Instruments<'_, T>,
    start: &RigidTransform<T>,
    unknowns: &[T],
    position: &Vector3<T>,
) -> [Option<Equation<T>>; 3] {
    let sensor = instruments.sensor_frame;
    let (half, rotation, translation) = if sensor {
        frame_at(
            start,
            unknowns
                .get(instruments.frame_column()..)
                .unwrap_or_default(),
        )
    } else {
        (Vector3::zeros(), Matrix3::identity(), Vector3::zeros())
    };
    let turned = rotation * position;
    let expected = turned + translation;
    // δR = [ω]× R with ω = (δw + w/2 × δw)/(1 + |w/2|²).
    let spin = T::ONE / (T::ONE + half.dot(&half));
    let by_turn = [Vector3::x(), Vector3::y(), Vector3::z()]
        .map(|axis: Vector3<T>| ((axis + half.cross(&axis)) * spin).cross(&turned));
    let mut equations = [None; 3];
    let sigmas = instruments.noise.position().position_by_axis();
    for (axis, ((equation, measured), sigma)) in equations
        .iter_mut()
        .zip(observation.position)
        .zip(sigmas)
        .enumerate()
    {
        let Some(measured) = measured else { continue };
        let of = |vector: &Vector3<T>| vector.get(axis).copied().unwrap_or(T::ZERO);
        let mut by_unknowns = [T::ZERO; 6];
        if sensor {
            let [a, b, c] = &by_turn;
            let mut shift = [T::ZERO; 3];
            if let Some(entry) = shift.get_mut(axis) {
                *entry = T::ONE;
            }
            let [x, y, z] = shift;
            by_unknowns = [x, y, z, of(a), of(b), of(c)];
        }
        *equation = Some(Equation {
            residual: measured - of(&expected),
            by_position: Vector3::from_fn(|column, _| {
                rotation.get((axis, column)).copied().unwrap_or(T::ZERO)
            }),
            between_poses: false,
            column: instruments.frame_column(),
            by_unknowns,
            sigma,
        });
    }
    equations
}

fn of_height<T: Real>(
    height: &Height<T>,
    instruments: &Instruments<'_, T>,
    unknowns: &[T],
    position: &Vector3<T>,
) -> Equation<T> {
    let column = instruments.first_of_plane(height.plane);
    let [c, a, b] = part(unknowns, column);
    // h = (z − c − a x − b y)/√(1 + a² + b²).
    let squared = T::ONE + a.squared() + b.squared();
    let inverse = T::ONE / squared.square_root();
    let expected = (position.z - c - a * position.x - b * position.y) * inverse;
    let by_slope = |along: T, slope: T| -(along * inverse) - expected * slope / squared;
    Equation {
        residual: height.height - expected,
        by_position: Vector3::new(-a, -b, T::ONE) * inverse,
        between_poses: false,
        column,
        by_unknowns: [
            -inverse,
            by_slope(position.x, a),
            by_slope(position.y, b),
            T::ZERO,
            T::ZERO,
            T::ZERO,
        ],
        sigma: instruments.noise.height(),
    }
}

fn of_distance<T: Real>(
    distance: &Distance<T>,
    instruments: &Instruments<'_, T>,
    unknowns: &[T],
    position: &Vector3<T>,
    other: Option<&Vector3<T>>,
) -> Equation<T> {
    let (from, offset, point) = match distance.from {
        DistanceFrom::Point(point) => {
            let column = instruments.first_of_point(point);
            let [x, y, z, offset] = part(unknowns, column);
            let has_offset = instruments
                .points
                .get(usize::from(point))
                .is_some_and(|point| point.offset);
            let offset = if has_offset { offset } else { T::ZERO };
            (Vector3::new(x, y, z), offset, Some((column, has_offset)))
        }
        DistanceFrom::Pose(_) => (other.copied().unwrap_or(*position), T::ZERO, None),
    };
    let difference = position - from;
    let length = difference.dot(&difference).square_root();
    let mut direction = difference / length;
    let mut residual = distance.distance - length - offset;
    let mut by_unknowns = [T::ZERO; 6];
    let mut column = instruments.frame_column();
    if let Some((first, has_offset)) = point {
        column = first;
        let offset = if has_offset { T::ONE } else { T::ZERO };
        by_unknowns = [
            -direction.x,
            -direction.y,
            -direction.z,
            offset,
            T::ZERO,
            T::ZERO,
        ];
    } else if let Some(last) = instruments.of_scale() {
        let [scale] = part(unknowns, last);
        residual = distance.distance - length * (T::ONE + scale);
        direction *= T::ONE + scale;
        column = last;
        by_unknowns = [length, T::ZERO, T::ZERO, T::ZERO, T::ZERO, T::ZERO];
    }
    Equation {
        residual,
        by_position: direction,
        between_poses: point.is_none(),
        column,
        by_unknowns,
        sigma: instruments.noise.distance(),
    }
}
