use crate::Real;
use core::fmt;
use nalgebra::{Matrix3, RealField, Vector3};

/// A change of Cartesian frame: `y = rotation · x + translation`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidTransform<T: Real> {
    /// Proper rotation.
    pub rotation: Matrix3<T>,
    /// In the unit of the points.
    pub translation: Vector3<T>,
}

/// Why two sets of points do not determine a rigid transform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AlignmentError {
    /// Fewer than three pairs of points.
    TooFewPoints,
    /// All points lie on one line.
    Collinear,
    /// A coordinate is NaN, infinite, or too large to be squared.
    NonFinite,
}

impl fmt::Display for AlignmentError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::TooFewPoints => "a frame needs at least three points",
            Self::Collinear => "all points lie on one line, which leaves the frame undetermined",
            Self::NonFinite => "a coordinate is not a finite number",
        })
    }
}

impl core::error::Error for AlignmentError {}

impl<T: Real> RigidTransform<T> {
    /// The transform that changes nothing.
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

    /// The transform that undoes this one.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self {
            rotation,
            translation: -(rotation * self.translation),
        }
    }
}

impl<T: Real + RealField> RigidTransform<T> {
    /// The proper rotation and translation that take the first point of each pair to the second
    /// with the least sum of squared distances (Kabsch 1976; Umeyama 1991, without scale).
    ///
    /// The iterator is run through twice; nothing is stored.
    ///
    /// # Errors
    /// Fewer than three pairs, points on one line, or a coordinate that is not finite.
    ///
    /// ```
    /// use delta_cal::RigidTransform;
    /// use nalgebra::Vector3;
    /// # fn main() -> Result<(), delta_cal::AlignmentError> {
    /// let from = [Vector3::new(0.0, 0.0, 0.0), Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 2.0, 0.0)];
    /// // A quarter turn about z and a shift by 5 along x.
    /// let pairs = from.iter().map(|p| (*p, Vector3::new(5.0 - p.y, p.x, p.z)));
    /// let found: RigidTransform<f64> = RigidTransform::align(pairs)?;
    /// assert!((found.translation - Vector3::new(5.0, 0.0, 0.0)).norm() < 1e-12);
    /// # Ok(())
    /// # }
    /// ```
    pub fn align<I>(pairs: I) -> Result<Self, AlignmentError>
    where
        I: IntoIterator<Item = (Vector3<T>, Vector3<T>)>,
        I::IntoIter: Clone,
    {
        let pairs = pairs.into_iter();
        let mut count = T::ZERO;
        let (mut from_sum, mut to_sum) = (Vector3::<T>::zeros(), Vector3::<T>::zeros());
        for (from, to) in pairs.clone() {
            count += T::ONE;
            from_sum += from;
            to_sum += to;
        }
        if !(count >= <T as Real>::from_f64(3.0)) {
            return Err(AlignmentError::TooFewPoints);
        }
        let (from_mean, to_mean) = (from_sum / count, to_sum / count);
        let mut covariance = Matrix3::<T>::zeros();
        let mut spread = T::ZERO;
        for (from, to) in pairs {
            let (from, to) = (from - from_mean, to - to_mean);
            covariance += to * from.transpose();
            spread += from.dot(&from) + to.dot(&to);
        }
        if !(spread.finite() && covariance.iter().all(|entry| entry.finite())) {
            return Err(AlignmentError::NonFinite);
        }
        // 64 sweeps are many times what a 3×3 matrix needs; the bound excludes an endless loop.
        let svd = covariance
            .try_svd(true, true, <T as Real>::EPSILON, 64)
            .ok_or(AlignmentError::Collinear)?;
        let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
            return Err(AlignmentError::Collinear);
        };
        let second = svd.singular_values[1];
        if !(second > spread * <T as Real>::EPSILON * <T as Real>::from_f64(64.0)) {
            return Err(AlignmentError::Collinear);
        }
        let handedness = (u * v_t).determinant();
        let mut u_proper = u;
        if handedness < T::ZERO {
            // Singular values are sorted: reflecting the last direction costs least.
            u_proper.column_mut(2).neg_mut();
        }
        let rotation = u_proper * v_t;
        Ok(Self {
            rotation,
            translation: to_mean - rotation * from_mean,
        })
    }
}
