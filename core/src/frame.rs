//! Cartesian frames: a rigid transform, and the alignment of two point sets.

use crate::Real;
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

/// A change of Cartesian frame: `y = rotation · x + translation`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidTransform<T: Real> {
    /// Proper rotation.
    pub rotation: Matrix3<T>,
    /// In the unit of the points.
    pub translation: Vector3<T>,
}

impl<T: Real> Default for RigidTransform<T> {
    fn default() -> Self {
        Self::identity()
    }
}

impl<T: Real> RigidTransform<T> {
    /// The identity transform.
    pub fn identity() -> Self {
        Self {
            rotation: Matrix3::identity(),
            translation: Vector3::zeros(),
        }
    }

    /// `rotation · point + translation`.
    pub fn apply(&self, point: &Vector3<T>) -> Vector3<T> {
        self.rotation * point + self.translation
    }

    /// The inverse transform.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self {
            rotation,
            translation: -(rotation * self.translation),
        }
    }

    /// The rotation and translation that map the first point of each pair to the second with the least sum of squared
    /// distances (Horn 1987, by unit quaternions).
    ///
    /// The iterator is traversed twice; nothing is stored.
    ///
    /// `None` for fewer than three pairs, collinear points, or a coordinate that is not finite or too large to be squared.
    ///
    /// ```
    /// use delta_cal::frame::RigidTransform;
    /// use nalgebra::Vector3;
    /// let from = [Vector3::new(0.0, 0.0, 0.0), Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 2.0, 0.0)];
    /// // A quarter turn about z and a shift by 5 along x.
    /// let pairs = from.iter().map(|p| (*p, Vector3::new(5.0 - p.y, p.x, p.z)));
    /// let found: RigidTransform<f64> = RigidTransform::align(pairs).unwrap();
    /// assert!((found.translation - Vector3::new(5.0, 0.0, 0.0)).norm() < 1e-12);
    /// ```
    pub fn align<I>(pairs: I) -> Option<Self>
    where
        I: IntoIterator<Item = (Vector3<T>, Vector3<T>)>,
        I::IntoIter: Clone,
    {
        let pairs = pairs.into_iter();
        // Relative to the first pair, so that a distant origin does not cost precision in the sums.
        let (from_first, to_first) = pairs.clone().next()?;
        let mut count = T::ZERO;
        let (mut from_sum, mut to_sum) = (Vector3::<T>::zeros(), Vector3::<T>::zeros());
        for (from, to) in pairs.clone() {
            count += T::ONE;
            from_sum += from - from_first;
            to_sum += to - to_first;
        }
        if !(count >= T::from_f64(3.0)) {
            return None;
        }
        let (from_mean, to_mean) = (from_sum / count, to_sum / count);
        let mut columns = [Vector3::<T>::zeros(); 3];
        let mut spread = T::ZERO;
        for (from, to) in pairs {
            let (from, to) = (from - from_first - from_mean, to - to_first - to_mean);
            for (column, to) in columns.iter_mut().zip(to.iter()) {
                *column += from * *to;
            }
            spread += from.dot(&from) + to.dot(&to);
        }
        let rotation = best_rotation(&Matrix3::from_columns(&columns), spread)?;
        let turned = product(&rotation, &(from_first + from_mean));
        Some(Self {
            rotation,
            translation: to_first + (to_mean - turned),
        })
    }
}

/// The rotation R that maximises Σ to · R from; `products` is Σ from · toᵀ, and `spread` the sum of all squares.
pub(crate) fn best_rotation<T: Real>(products: &Matrix3<T>, spread: T) -> Option<Matrix3<T>> {
    if !((spread * spread).finite() && spread > T::ZERO) {
        return None;
    }
    let ([largest, second], quaternion) = two_largest(&horn_matrix(&(products / spread)));
    // If the points are collinear, any rotation about their line fits equally well.
    if !(largest - second > T::EPSILON * T::from_f64(128.0)) {
        return None;
    }
    Some(rotation_of(&quaternion))
}

/// A matrix times a vector. Not nalgebra's product, which has a path to a panic in a program built for size.
pub(crate) fn product<T: Real>(matrix: &Matrix3<T>, vector: &Vector3<T>) -> Vector3<T> {
    let [x, y, z] = [vector.x, vector.y, vector.z];
    Vector3::new(
        matrix.m11 * x + matrix.m12 * y + matrix.m13 * z,
        matrix.m21 * x + matrix.m22 * y + matrix.m23 * z,
        matrix.m31 * x + matrix.m32 * y + matrix.m33 * z,
    )
}

/// The symmetric matrix whose dominant eigenvector is the quaternion (w, x, y, z) of the rotation R that maximises Σ to
/// · R from (Horn 1987). `s` is Σ from · toᵀ.
fn horn_matrix<T: Real>(s: &Matrix3<T>) -> Matrix4<T> {
    let (xx, xy, xz) = (s.m11, s.m12, s.m13);
    let (yx, yy, yz) = (s.m21, s.m22, s.m23);
    let (zx, zy, zz) = (s.m31, s.m32, s.m33);
    Matrix4::from([
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ])
}

/// Every pair of rows of a 4 × 4 matrix.
const PAIRS: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
/// Jacobi's method converges quadratically; a 4 × 4 matrix needs about five sweeps.
const SWEEPS: usize = 12;

/// An entry, without a path to a panic at any optimisation level.
fn entry<T: Real>(matrix: &Matrix4<T>, row: usize, column: usize) -> T {
    matrix.get((row, column)).copied().unwrap_or(T::ZERO)
}

/// The two largest eigenvalues of a symmetric matrix and the eigenvector of the largest, by cyclic Jacobi rotations.
fn two_largest<T: Real>(matrix: &Matrix4<T>) -> ([T; 2], Vector4<T>) {
    let mut matrix = *matrix;
    let mut vectors = Matrix4::<T>::identity();
    for _ in 0..SWEEPS {
        for (p, q) in PAIRS {
            let at = |i: usize, j: usize| entry(&matrix, i, j);
            let (diagonal_p, diagonal_q, off) = (at(p, p), at(q, q), at(p, q));
            // A smaller one turns nothing that is not lost in rounding: the matrix is that of unit spread.
            if !(off.magnitude() > T::EPSILON.squared()) {
                continue;
            }
            // tan of the rotation angle, the smaller root of t² + 2t cot 2φ − 1 = 0.
            let cotangent = (diagonal_q - diagonal_p) / (T::TWO * off);
            let root = (cotangent.squared() + T::ONE).square_root();
            let tangent = if cotangent < T::ZERO {
                -T::ONE / (root - cotangent)
            } else {
                T::ONE / (root + cotangent)
            };
            let cosine = T::ONE / (tangent.squared() + T::ONE).square_root();
            let sine = tangent * cosine;
            for line in 0..4 {
                turn(&mut matrix, [(line, p), (line, q)], cosine, sine);
                turn(&mut vectors, [(line, p), (line, q)], cosine, sine);
            }
            for line in 0..4 {
                turn(&mut matrix, [(p, line), (q, line)], cosine, sine);
            }
        }
    }
    let mut largest = [-T::INFINITY; 2];
    let mut vector = Vector4::new(T::ONE, T::ZERO, T::ZERO, T::ZERO);
    for index in 0..4 {
        let value = entry(&matrix, index, index);
        let [first, second] = largest;
        if value > first {
            largest = [value, first];
            vector = Vector4::from_fn(|row, _| entry(&vectors, row, index));
        } else if value > second {
            largest = [first, value];
        }
    }
    (largest, vector)
}

/// Rotates two entries in their plane.
fn turn<T: Real>(matrix: &mut Matrix4<T>, places: [(usize, usize); 2], cosine: T, sine: T) {
    let [a, b] = places.map(|(row, column)| entry(matrix, row, column));
    for (place, value) in places
        .into_iter()
        .zip([cosine * a - sine * b, sine * a + cosine * b])
    {
        if let Some(entry) = matrix.get_mut(place) {
            *entry = value;
        }
    }
}

/// The rotation matrix of a quaternion, which need not be normalised.
pub(crate) fn rotation_of<T: Real>(quaternion: &Vector4<T>) -> Matrix3<T> {
    let unit = quaternion / quaternion.dot(quaternion).square_root();
    let (w, x, y, z) = (unit.x, unit.y, unit.z, unit.w);
    let two = T::TWO;
    Matrix3::new(
        T::ONE - two * (y * y + z * z),
        two * (x * y - w * z),
        two * (x * z + w * y),
        two * (x * y + w * z),
        T::ONE - two * (x * x + z * z),
        two * (y * z - w * x),
        two * (x * z - w * y),
        two * (y * z + w * x),
        T::ONE - two * (x * x + y * y),
    )
}
