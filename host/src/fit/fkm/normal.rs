//! The linearised problem, reduced to its triangle arm by arm.

use nalgebra::{DMatrix, SMatrix, SVector};

/// Parameters of one arm, of all arms.
pub(super) const ARM: usize = 8;
pub(super) const ALL: usize = 24;

/// All 24 parameters, or a number for each.
pub(super) type Vector24 = SVector<f64, ALL>;
pub(super) type Matrix24 = SMatrix<f64, ALL, ALL>;

/// The triangular factor T of the Jacobian and Qᵀr: the cost is |T δ + Qᵀr|² and what no δ changes.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    pub(super) factor: Matrix24,
    pub(super) right: Vector24,
}

/// Rows that are zero left of one arm's columns: the first arm's reach over all three arms, the
/// second's over two, the last one's over its own. The last column is the residual.
pub(super) struct Staircase([DMatrix<f64>; 3]);

impl Staircase {
    /// Zero rows: as many for each arm.
    pub(super) fn zeros(rows: usize) -> Self {
        Self([0, 1, 2].map(|arm| DMatrix::zeros(rows, ALL - ARM * arm + 1)))
    }

    /// The rows that begin at this arm's columns.
    pub(super) fn rows_of(&mut self, arm: usize) -> &mut DMatrix<f64> {
        &mut self.0[arm]
    }

    /// Householder reflections, one arm's columns after the other: what remains of an arm's rows
    /// below its triangle goes on to the next arm's.
    ///
    /// `None` if an arm has fewer rows than parameters.
    pub(super) fn reduce(self) -> Option<Normal> {
        let mut normal = Normal {
            factor: Matrix24::zeros(),
            right: Vector24::zeros(),
        };
        let mut left_over = DMatrix::zeros(0, ALL + 1);
        for (arm, own) in self.0.into_iter().enumerate() {
            let (above, width) = (left_over.nrows(), own.ncols());
            let mut rows = left_over.resize_vertically(above + own.nrows(), 0.0);
            rows.rows_mut(above, own.nrows()).copy_from(&own);
            if rows.nrows() < ARM {
                return None;
            }
            let reflections = rows.columns(0, ARM).into_owned().qr();
            let mut beside = rows.columns(ARM, width - ARM).into_owned();
            reflections.q_tr_mul(&mut beside);
            let (first, others) = (ARM * arm, width - ARM - 1);
            let mut triangle = normal.factor.fixed_rows_mut::<ARM>(first);
            triangle
                .fixed_columns_mut::<ARM>(first)
                .copy_from(&reflections.r());
            triangle
                .columns_mut(first + ARM, others)
                .copy_from(&beside.view((0, 0), (ARM, others)));
            normal
                .right
                .fixed_rows_mut::<ARM>(first)
                .copy_from(&beside.view((0, others), (ARM, 1)));
            left_over = beside.remove_rows(0, ARM);
        }
        Some(normal)
    }
}

impl Normal {
    pub(super) fn column_norms(&self) -> Vector24 {
        Vector24::from_iterator(self.factor.column_iter().map(|column| column.norm()))
    }

    /// δ that minimises |T δ + Qᵀr|² + λ|D δ|², D the column norms; `None` if it does not exist.
    pub(super) fn minimiser(&self, damping: f64) -> Option<Vector24> {
        if damping > 0.0 {
            return self.damped(damping)?.minimiser(0.0);
        }
        let step = -self.factor.solve_upper_triangular(&self.right)?;
        step.iter().all(|delta| delta.is_finite()).then_some(step)
    }

    fn damped(&self, damping: f64) -> Option<Self> {
        let norms = self.column_norms() * damping.sqrt();
        let mut rows = Staircase::zeros(2 * ARM);
        for arm in 0..3 {
            let first = ARM * arm;
            let own = rows.rows_of(arm);
            let columns = ALL - first;
            own.view_mut((0, 0), (ARM, columns))
                .copy_from(&self.factor.view((first, first), (ARM, columns)));
            own.view_mut((0, columns), (ARM, 1))
                .copy_from(&self.right.rows(first, ARM));
            for parameter in 0..ARM {
                own[(ARM + parameter, parameter)] = norms[first + parameter];
            }
        }
        rows.reduce()
    }

    /// |T δ|²: by how much a displacement from a minimum raises the cost.
    pub(super) fn length_squared(&self, displacement: &Vector24) -> f64 {
        (self.factor * displacement).norm_squared()
    }

    /// (JᵀJ)⁻¹, from the inverse of the triangle; `None` if that is singular.
    pub(super) fn covariance(&self) -> Option<Matrix24> {
        let inverse = self.factor.solve_upper_triangular(&Matrix24::identity())?;
        let covariance = inverse * inverse.transpose();
        covariance
            .iter()
            .all(|entry| entry.is_finite())
            .then_some(covariance)
    }
}
