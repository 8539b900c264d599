//! The rigid motion that best fits small position errors.

use crate::geometry::centroid;
use delta_cal::{Robot, Sample};
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};

/// Small rigid motions of a set of points: a translation and a rotation about their centre.
///
/// A motion `m` moves the point `x` by `T(x) m`, `T(x) = (I, −[x − c]×)`. The least-squares fit to the errors `eₖ` of
/// the points is `m = (Σ TₖᵀTₖ)⁻¹ Σ Tₖᵀ eₖ`.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidMotions {
    centre: Vector3<f64>,
    /// (Σ TᵀT)⁻¹.
    inverse: Matrix6<f64>,
}

impl RigidMotions {
    /// Of these points, mm. `None` if there are fewer than three or they are collinear.
    pub fn of(points: impl Iterator<Item = Vector3<f64>> + Clone) -> Option<Self> {
        let centre = centroid(points.clone());
        let normal = points
            .map(|point| {
                let columns = columns(&(point - centre));
                columns.transpose() * columns
            })
            .sum::<Matrix6<f64>>();
        let inverse = normal.cholesky()?.inverse();
        let finite = inverse.iter().all(|entry| entry.is_finite());
        finite.then_some(Self { centre, inverse })
    }

    /// T at a point, mm: three coordinates by translation and rotation.
    pub fn at(&self, point: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
        columns(&(point - self.centre))
    }

    /// The fraction of the error at one of the points that the fitted motion absorbs, 0 to 1: a third of tr(T (Σ TᵀT)⁻¹
    /// Tᵀ).
    pub fn leverage(&self, point: &Vector3<f64>) -> f64 {
        let columns = self.at(point);
        (columns * self.inverse * columns.transpose()).trace() / 3.0
    }

    /// The motion that best fits the errors, for N columns of errors at each point.
    pub fn explaining<'a, const N: usize>(
        &self,
        errors: impl Iterator<Item = (&'a Vector3<f64>, &'a SMatrix<f64, 3, N>)>,
    ) -> SMatrix<f64, 6, N> {
        let mut sum = SMatrix::<f64, 6, N>::zeros();
        for (point, error) in errors {
            sum += self.at(point).transpose() * error;
        }
        self.inverse * sum
    }

    /// Position errors (mm) less the rigid motion that best fits them.
    pub fn removed(&self, errors: &[(Vector3<f64>, Vector3<f64>)]) -> Vec<Vector3<f64>> {
        let motion: Vector6<f64> =
            self.explaining(errors.iter().map(|(point, error)| (point, error)));
        errors
            .iter()
            .map(|(point, error)| error - self.at(point) * motion)
            .collect()
    }
}

/// Poses of a robot that it reached before as well: where the platform is, and how far it moved, mm.
pub(crate) fn moved(
    before: &Robot<f64>,
    poses: &[Sample<f64>],
) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let moved = poses.iter().filter_map(|pose| {
        let from = before.forward(&pose.joints).ok()?;
        Some((pose.position, pose.position - from))
    });
    moved.collect()
}

/// (I, −[x]×): displacement of a point by a translation and a rotation.
pub(crate) fn columns(arm: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
    let mut columns = SMatrix::<f64, 3, 6>::zeros();
    columns.fixed_columns_mut::<3>(0).fill_with_identity();
    columns
        .fixed_columns_mut::<3>(3)
        .copy_from(&-arm.cross_matrix());
    columns
}

/// Points within this fraction of the forearm (rms) count as a single point.
const SPOT: f64 = 0.02;
/// Points are collinear if their second extent is below this fraction of the first.
const LINE: f64 = 0.05;

/// Whether three or more points leave a rotation of the frame free, or nearly so.
pub(crate) fn degenerate(
    points: impl ExactSizeIterator<Item = Vector3<f64>> + Clone,
    forearm: f64,
) -> Option<&'static str> {
    if points.len() < 3 {
        return None;
    }
    let (number, mean) = (points.len() as f64, centroid(points.clone()));
    let scatter = points.fold(Matrix3::zeros(), |sum, point| {
        sum + (point - mean) * (point - mean).transpose()
    });
    let mut extents = scatter.symmetric_eigenvalues().data.0[0];
    extents.sort_by(|a, b| b.total_cmp(a));
    let [first, second, _] = extents.map(|value| value.max(0.0).sqrt());
    if first < SPOT * forearm * number.sqrt() {
        Some("in one spot")
    } else if second < LINE * first {
        Some("(nearly) on a line")
    } else {
        None
    }
}
