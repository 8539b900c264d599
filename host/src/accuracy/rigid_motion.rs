//! The rigid motion that explains most of small position errors.

use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};

/// Small rigid motions of a set of points: a shift and a turn about their centre.
///
/// A motion `m` moves the point `x` by `T(x) m`, `T(x) = (I, −[x − c]×)`. Of the errors `eₖ` of the
/// points it explains, by least squares, `m = (Σ TₖᵀTₖ)⁻¹ Σ Tₖᵀ eₖ`.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidMotions {
    centre: Vector3<f64>,
    /// (Σ TᵀT)⁻¹.
    inverse: Matrix6<f64>,
}

impl RigidMotions {
    /// Of these points, mm. `None` if they are fewer than three or on a line.
    pub fn of(points: impl ExactSizeIterator<Item = Vector3<f64>> + Clone) -> Option<Self> {
        let number = points.clone().fold(0.0, |count, _| count + 1.0);
        let centre = points.clone().sum::<Vector3<f64>>() / number;
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

    /// T at a point, mm: three coordinates by shift and turn.
    pub fn at(&self, point: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
        columns(&(point - self.centre))
    }

    /// How much of the error at a point of these the motion that explains most of all takes up, 0 to 1: a third of
    /// tr(T (Σ TᵀT)⁻¹ Tᵀ).
    pub fn leverage(&self, point: &Vector3<f64>) -> f64 {
        let columns = self.at(point);
        (columns * self.inverse * columns.transpose()).trace() / 3.0
    }

    /// The motion that explains most of errors: N columns of them at each point.
    pub fn explaining<const N: usize>(
        &self,
        errors: impl Iterator<Item = (Vector3<f64>, SMatrix<f64, 3, N>)>,
    ) -> SMatrix<f64, 6, N> {
        let sum = errors.fold(
            SMatrix::zeros(),
            |sum: SMatrix<f64, 6, N>, (point, error)| sum + self.at(&point).transpose() * error,
        );
        self.inverse * sum
    }

    /// Position errors (mm) less the rigid motion that explains most of them.
    pub fn removed(&self, errors: &[(Vector3<f64>, Vector3<f64>)]) -> Vec<Vector3<f64>> {
        let motion: Vector6<f64> = self.explaining(errors.iter().copied());
        errors
            .iter()
            .map(|(point, error)| error - self.at(point) * motion)
            .collect()
    }
}

fn columns(arm: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
    let mut columns = SMatrix::<f64, 3, 6>::zeros();
    columns.fixed_columns_mut::<3>(0).fill_with_identity();
    columns
        .fixed_columns_mut::<3>(3)
        .copy_from(&-arm.cross_matrix());
    columns
}

/// Points within this part of the forearm (rms) are in one spot.
const SPOT: f64 = 0.02;
/// Points are on a line if their second extent is below this part of the first.
const LINE: f64 = 0.05;

/// Three points or more that leave a rotation of the frame free, or nearly so.
pub(crate) fn degenerate(
    points: impl ExactSizeIterator<Item = Vector3<f64>> + Clone,
    forearm: f64,
) -> Option<&'static str> {
    if points.len() < 3 {
        return None;
    }
    let number = points.clone().fold(0.0, |count, _| count + 1.0);
    let mean = points.clone().sum::<Vector3<f64>>() / number;
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
