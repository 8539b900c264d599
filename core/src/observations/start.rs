//! Start values for the instruments' unknowns: closed forms from the nominal robot's forward kinematics.

use super::equation::At;
use super::instruments::Instruments;
use super::observation::{DistanceFrom, ObservationRow};
use crate::Real;
use crate::frame::{RigidTransform, best_rotation, product};
use crate::robot::Robot;
use crate::samples::{Triangle, Unknowns, put_row};
use nalgebra::{Matrix3, Vector3};

/// Passes of the plane fit, each using the tilt found by the previous one.
const PASSES: usize = 3;
/// Touches are collinear if the determinant of their spread is below this fraction of its squared trace.
const LINE: f64 = 1e-3;

/// The start of the unknowns, at their indices among N parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StartValues<T: Real, const N: usize> {
    frame: RigidTransform<T>,
    unknowns: [T; N],
    /// Which coordinates were measured at all.
    axes: [bool; 3],
}

impl<T: Real, const N: usize> StartValues<T, N> {
    /// Before [`locate`](Self::locate); from checked rows, those that count.
    pub(super) fn new(rows: &[ObservationRow<T>]) -> Self {
        let mut axes = [false; 3];
        for row in counted(rows) {
            let observation = row.observation();
            for (seen, coordinate) in axes.iter_mut().zip(&observation.position) {
                *seen |= coordinate.is_some();
            }
        }
        Self {
            frame: RigidTransform::identity(),
            unknowns: [T::ZERO; N],
            axes,
        }
    }

    /// Finds a piece of the start: a plane, a point, or a part of the frame. Returns whether there are more.
    pub(super) fn locate(
        &mut self,
        robot: &Robot<T>,
        instruments: &Instruments<'_, T>,
        rows: &[ObservationRow<T>],
        piece: usize,
    ) -> bool {
        let (planes, points) = (instruments.planes, instruments.points);
        let of_points = piece.saturating_sub(planes.len());
        let sensor = instruments.sensor_frame;
        if let Some((index, plane)) = (0..).zip(planes).nth(piece) {
            let [height, a, b] = self::plane(robot, rows, index, plane.level.is_none());
            let height = plane.known.map_or(height, |(height, _)| height);
            self.put(instruments.first_of_plane(index), &[height, a, b]);
        } else if let Some((index, point)) = (0..).zip(points).nth(of_points) {
            let column = instruments.first_of_point(index);
            if let Some((place, _)) = point.known {
                self.put(column, place.as_slice());
            } else if point.offset
                && let Some([x, y, z, offset, _]) = self::point::<_, 5>(robot, rows, index)
            {
                self.put(column, &[x, y, z, offset]);
            } else if let Some([x, y, z, _]) = self::point::<_, 4>(robot, rows, index) {
                self.put(column, &[x, y, z]);
            }
        } else if sensor {
            return self.locate_frame(robot, rows, of_points.saturating_sub(points.len()));
        }
        sensor || piece + 1 < planes.len() + points.len()
    }

    /// Finds all of the start.
    pub(super) fn locate_all(
        &mut self,
        robot: &Robot<T>,
        instruments: &Instruments<'_, T>,
        rows: &[ObservationRow<T>],
    ) {
        let mut piece = 0;
        while self.locate(robot, instruments, rows, piece) {
            piece += 1;
        }
    }

    /// A part of the frame that best fits the nominal robot's positions to the measured coordinates; the robot's own if
    /// there are too few. Returns whether there are more.
    fn locate_frame(&mut self, robot: &Robot<T>, rows: &[ObservationRow<T>], part: usize) -> bool {
        match part {
            0 => {
                if let Some(frame) = T::align(rows) {
                    self.frame = frame;
                    return false;
                }
            }
            // Until the next part, its rows are the directions of the axes; an unknown one is infinite.
            1..=3 => {
                let direction = affine(robot, rows, part - 1);
                let direction = direction.unwrap_or_else(|| Vector3::repeat(T::INFINITY));
                for (column, entry) in direction.iter().enumerate() {
                    if let Some(place) = self.frame.rotation.get_mut((part - 1, column)) {
                        *place = *entry;
                    }
                }
            }
            4 => {
                let [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]] = self.frame.rotation.data.0;
                let directions = [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]].map(Vector3::from);
                let rotation = T::nearest_rotation(&directions);
                self.frame.rotation = rotation.unwrap_or_else(Matrix3::identity);
            }
            _ => {
                let translation = self.frame.translation.iter_mut();
                for (axis, (entry, seen)) in translation.zip(self.axes).enumerate() {
                    if seen {
                        *entry = mean_shift(rows, axis, &self.frame.rotation);
                    }
                }
                return false;
            }
        }
        true
    }

    fn put(&mut self, column: usize, values: &[T]) {
        for (entry, value) in self.unknowns.iter_mut().skip(column).zip(values) {
            *entry = *value;
        }
    }

    /// A robot and values of the unknowns, relative to the frame at the start.
    pub(super) const fn at<'a>(
        &'a self,
        robot: &'a Robot<T>,
        instruments: &'a Instruments<'a, T>,
        unknowns: &'a [T; N],
    ) -> At<'a, T> {
        At {
            robot,
            instruments,
            frame: &self.frame,
            unknowns,
        }
    }

    /// The coordinate frame at the start.
    pub(super) const fn frame(&self) -> &RigidTransform<T> {
        &self.frame
    }

    /// The start values, at their indices among all parameters.
    pub(super) const fn unknowns(&self) -> &[T; N] {
        &self.unknowns
    }

    /// Whether the measured coordinates do not determine one of the frame's six numbers: a shift along an unmeasured
    /// axis, or a rotation about the only measured one.
    pub(super) fn is_free(&self, number: usize) -> bool {
        let [x, y, z] = self.axes;
        let seen = [x, y, z, y || z, x || z, x || y];
        !seen.get(number).copied().unwrap_or(false)
    }
}

fn counted<T: Real>(
    rows: &[ObservationRow<T>],
) -> impl Iterator<Item = &ObservationRow<T>> + Clone {
    rows.iter().filter(|row| !row.is_left_out())
}

/// c, a and b of the plane z = c + a x + b y that best fits the nominal robot's touches: a least-squares fit of z − h
/// √(1 + a² + b²) with the root from the previous pass, initially 1. Level if its tilt is known to be small or the
/// touches are nearly collinear.
fn plane<T: Real>(
    robot: &Robot<T>,
    rows: &[ObservationRow<T>],
    plane: u8,
    may_be_tilted: bool,
) -> [T; 3] {
    let [first, ..] = robot.arms();
    let unit = first.lb();
    // For x, y, z and the height: their sums, and the sums of their products with x and y.
    let (mut count, mut sums, mut by_x, mut by_y) =
        (T::ZERO, [T::ZERO; 4], [T::ZERO; 4], [T::ZERO; 4]);
    for row in counted(rows) {
        let observation = row.observation();
        if let Some(height) = observation.height
            && height.plane == plane
        {
            let there = row.nominal / unit;
            let values = [there.x, there.y, there.z, height.height / unit];
            count += T::ONE;
            for (index, value) in values.into_iter().enumerate() {
                for (sum, by) in [
                    (&mut sums, T::ONE),
                    (&mut by_x, there.x),
                    (&mut by_y, there.y),
                ] {
                    if let Some(entry) = sum.get_mut(index) {
                        *entry += value * by;
                    }
                }
            }
        }
    }
    let count = count.larger(T::ONE);
    let [x, y, z, h] = sums.map(|sum| sum / count);
    let [xx, _, xz, xh] = by_x;
    let [xy, yy, yz, yh] = by_y;
    let (xx, xy, yy) = (xx - count * x * x, xy - count * x * y, yy - count * y * y);
    let (xz, yz) = (xz - count * x * z, yz - count * y * z);
    let (xh, yh) = (xh - count * x * h, yh - count * y * h);
    let determinant = xx * yy - xy * xy;
    let level = [(z - h) * unit, T::ZERO, T::ZERO];
    if !(may_be_tilted && determinant > T::from_f64(LINE) * (xx + yy).squared()) {
        return level;
    }
    let (mut found, mut root) = (level, T::ONE);
    for _ in 0..PASSES {
        let (right_x, right_y) = (xz - xh * root, yz - yh * root);
        let a = (right_x * yy - right_y * xy) / determinant;
        let b = (right_y * xx - right_x * xy) / determinant;
        let squared = a.squared() + b.squared();
        if !(squared <= T::ONE) {
            return level;
        }
        found = [(z - h * root - a * x - b * y) * unit, a, b];
        root = (T::ONE + squared).square_root();
    }
    found
}

/// Nominal position and measured distance of every row measured from a point, divided by a length.
fn distances<T: Real>(
    rows: &[ObservationRow<T>],
    point: u8,
    unit: T,
) -> impl Iterator<Item = (Vector3<T>, T)> {
    counted(rows).filter_map(move |row| {
        let observation = row.observation();
        let distance = observation.distance?;
        if distance.from != DistanceFrom::Point(point) {
            return None;
        }
        Some((row.nominal / unit, distance.distance / unit))
    })
}

/// p and, if it has one, the offset o of |X|² − d² = 2 X·p − 2 d o + k, with k eliminated.
fn point<T: Unknowns<N>, const N: usize>(
    robot: &Robot<T>,
    rows: &[ObservationRow<T>],
    point: u8,
) -> Option<[T; N]> {
    let [first, ..] = robot.arms();
    let unit = first.lb();
    let mut triangle = Triangle::<T, N>::zero();
    for (x, d) in distances(rows, point, unit) {
        let right = d.squared() - x.dot(&x);
        let terms = [T::TWO * x.x, T::TWO * x.y, T::TWO * x.z, -(T::TWO * d)];
        let mut columns = T::columns([T::ZERO; 2]);
        put_row(columns.as_mut(), 0, 0, &terms);
        put_row(columns.as_mut(), 0, N - 1, &[T::ONE, right]);
        T::absorb_two(triangle.entries_mut(), columns.as_mut(), N + 1);
    }
    let solution = solved(&triangle)?;
    Some(solution.map(|value| value * unit))
}

/// The least-squares solution, if the rows determine it.
fn solved<T: Unknowns<N>, const N: usize>(triangle: &Triangle<T, N>) -> Option<[T; N]> {
    let rounding = T::from_f64(64.0) * T::EPSILON;
    let smallest = triangle.column_norms().map(|norm| rounding * norm);
    triangle.minimiser(&smallest)
}

fn unit<T: Real>(vector: &Vector3<T>) -> Vector3<T> {
    vector / vector.dot(vector).square_root()
}

/// a of y = a · X + b for one coordinate, with b eliminated.
fn affine<T: Real>(
    robot: &Robot<T>,
    rows: &[ObservationRow<T>],
    axis: usize,
) -> Option<Vector3<T>> {
    let [first, ..] = robot.arms();
    let length = first.lb();
    let mut triangle = Triangle::<T, 4>::zero();
    let mut rows = counted(rows).filter_map(|row| {
        let measured = (*row.observation().position.get(axis)?)?;
        let x = row.nominal / length;
        Some([x.x, x.y, x.z, T::ONE, -(measured / length)])
    });
    // Two rows take hardly longer than one.
    while let Some(first) = rows.next() {
        let mut columns = first.map(|entry| [entry, T::ZERO]);
        let second = rows.next().unwrap_or([T::ZERO; 5]);
        for ([_, place], entry) in columns.iter_mut().zip(second) {
            *place = entry;
        }
        T::absorb_two(triangle.entries_mut(), &mut columns, 5);
    }
    let [x, y, z, _] = solved(&triangle)?;
    Some(Vector3::new(x, y, z))
}

/// The frame, if every pose that was measured at all has all three coordinates.
pub(crate) fn align<T: Real>(rows: &[ObservationRow<T>]) -> Option<RigidTransform<T>> {
    let whole = counted(rows).filter_map(|row| {
        let [Some(x), Some(y), Some(z)] = row.observation().position else {
            return None;
        };
        Some((row.nominal, Vector3::new(x, y, z)))
    });
    let everything = counted(rows).all(|row| {
        let measured = row.observation().position.iter().flatten().count();
        measured == 0 || measured == 3
    });
    let frame = everything.then(|| RigidTransform::align(whole));
    frame.flatten()
}

/// The proper rotation nearest to a matrix given by rows, of which one that is not finite follows from the others.
pub(crate) fn nearest_rotation<T: Real>(rows: &[Vector3<T>; 3]) -> Option<Matrix3<T>> {
    let [x, y, z] = *rows;
    let [x, y, z] = match rows.each_ref().map(|row| row.x.finite()) {
        [true, true, true] => [x, y, z],
        [true, true, false] => [x, y, unit(&x.cross(&y))],
        [false, true, true] => [unit(&y.cross(&z)), y, z],
        [true, false, true] => [x, unit(&z.cross(&x)), z],
        _ => return None,
    };
    let spread = T::from_f64(3.0) + x.dot(&x) + y.dot(&y) + z.dot(&z);
    best_rotation(&Matrix3::from_columns(&[x, y, z]), spread)
}

fn mean_shift<T: Real>(rows: &[ObservationRow<T>], axis: usize, rotation: &Matrix3<T>) -> T {
    let (mut sum, mut count) = (T::ZERO, T::ZERO);
    for row in counted(rows) {
        if let Some(Some(measured)) = row.observation().position.get(axis) {
            let turned = product(rotation, &row.nominal);
            sum += *measured - turned.get(axis).copied().unwrap_or(T::ZERO);
            count += T::ONE;
        }
    }
    sum / count.larger(T::ONE)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_precision_loss, clippy::unwrap_used)]

    extern crate alloc;

    use super::StartValues;
    use crate::fixtures::{instruments, joints, paper};
    use crate::frame::RigidTransform;
    use crate::observations::{Instruments, Observation, ObservationRow};
    use crate::robot::Robot;
    use alloc::borrow::ToOwned;
    use nalgebra::{Rotation3, Vector3};

    /// From rows as a calibrator receives them.
    fn start_of<const N: usize>(
        robot: &Robot<f64>,
        instruments: &Instruments<'_, f64>,
        rows: &[ObservationRow<f64>],
    ) -> StartValues<f64, N> {
        let mut rows = rows.to_owned();
        for row in &mut rows {
            row.place(robot).unwrap();
        }
        let mut start = StartValues::new(&rows);
        start.locate_all(robot, instruments, &rows);
        start
    }

    /// Coordinates of the nominal robot in a rotated and shifted frame, some per pose: the start is that frame, along
    /// the measured axes.
    #[test]
    fn the_frame_is_found_whatever_coordinates_were_measured() {
        let robot = paper();
        let frame = RigidTransform {
            rotation: *Rotation3::new(Vector3::new(0.3, -0.5, 0.8)).matrix(),
            translation: Vector3::new(40.0, -70.0, 300.0),
        };
        let instruments = Instruments {
            sensor_frame: true,
            ..instruments(&[], &[])
        };
        for pattern in [
            // All per pose; all, in turn; two of them.
            [[true; 3]; 2],
            [[true, false, true], [false, true, false]],
            [[true, true, false]; 2],
            [[false, true, true]; 2],
            [[true, false, true]; 2],
        ] {
            let rows: [ObservationRow<f64>; 40] = core::array::from_fn(|index| {
                let joints = joints(index);
                let measured = frame.apply(&robot.forward(&joints).unwrap());
                let seen = pattern[index % 2];
                ObservationRow::new(Observation {
                    position: core::array::from_fn(|axis| seen[axis].then(|| measured[axis])),
                    ..Observation::at(joints)
                })
            });
            let start = start_of::<30>(&robot, &instruments, &rows);
            // ε times lengths of some hundreds times a condition number of some tens.
            assert!((start.frame().rotation - frame.rotation).amax() < 1e-10);
            let seen = [0, 1, 2].map(|axis| pattern.iter().any(|own| own[axis]));
            for (axis, seen) in seen.into_iter().enumerate() {
                let expected = if seen { frame.translation[axis] } else { 0.0 };
                assert!((start.frame().translation[axis] - expected).abs() < 1e-8);
            }
        }
    }
}
