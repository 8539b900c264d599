//! Least squares with optional columns, from the triangle of all rows.

use nalgebra::{DMatrix, DVector};

/// Weight of 0 for candidates that the rows do not distinguish, as a fraction of their longest column.
const INDISTINCT: f64 = 1e-6;

/// All rows of fixed columns, candidate columns and the residual, reduced to a triangle.
pub(super) struct Regression {
    triangle: DMatrix<f64>,
    /// Number of columns that always take part.
    always: usize,
    /// Effective number of measured residuals.
    pub(super) worth: f64,
    /// Rows of the prior, with the residual last.
    prior: Vec<DVector<f64>>,
}

/// A fit of the fixed columns and of some candidates.
pub(super) struct Fit {
    /// Coefficients of the fixed columns, then of the candidates in the requested order.
    pub(super) coefficients: DVector<f64>,
    /// Their covariance for residuals of unit variance.
    pub(super) covariance: DMatrix<f64>,
    /// Σ r² of the measured rows.
    pub(super) squares: f64,
    /// Σ r² of all rows, those of the prior included.
    cost: f64,
    /// Measured rows less the number of coefficients that they, and not the prior, determine.
    pub(super) freedom: f64,
}

impl Fit {
    /// Variance of a measured residual.
    pub(super) fn variance(&self) -> f64 {
        self.squares / self.freedom
    }

    /// The decrease of the whole sum of squares since a fit with fewer candidates.
    pub(super) fn gain(&self, without: &Self) -> f64 {
        without.cost - self.cost
    }

    /// The coefficients of the candidates alone.
    pub(super) fn of_candidates(&self, candidates: usize) -> &[f64] {
        &self.coefficients.as_slice()[self.coefficients.len() - candidates..]
    }
}

impl Regression {
    /// From measured rows, each with its weight in the sum of squares, and rows of the prior. A row holds `always`
    /// columns, the candidates, and the residual.
    pub(super) fn new(
        (always, candidates): (usize, usize),
        measured: Vec<(DVector<f64>, f64)>,
        prior: Vec<DVector<f64>>,
    ) -> Self {
        let worth = measured.iter().map(|(_, weight)| weight).sum();
        let measured = measured
            .into_iter()
            .map(|(row, weight)| row * weight.sqrt());
        let all: Vec<_> = measured.chain(prior.iter().cloned()).collect();
        let width = always + candidates + 1;
        let entry = |row: usize, column| all.get(row).map_or(0.0, |own| own[column]);
        Self {
            triangle: DMatrix::from_fn(all.len().max(width), width, entry)
                .qr()
                .unpack_r(),
            always,
            worth,
            prior,
        }
    }

    /// The fit with these candidates; `None` if the rows do not distinguish the columns.
    pub(super) fn solve(&self, chosen: &[usize]) -> Option<Fit> {
        let always = self.always;
        let columns = (0..always).chain(chosen.iter().map(|column| always + column));
        let mut part = self.triangle.select_columns(&columns.collect::<Vec<_>>());
        let (rows, columns) = part.shape();
        // A combination that no reading shows, as a drift along a plate, is 0.
        let lengths = (always..columns).map(|column| part.column(column).norm());
        let longest = lengths.fold(0.0, f64::max);
        part = part.resize_vertically(rows + columns - always, 0.0);
        for column in always..columns {
            part[(rows + column - always, column)] = INDISTINCT * longest;
        }
        let lengths: Vec<_> = part.column_iter().map(|column| column.norm()).collect();
        let rows = part.nrows();
        let qr = part.qr();
        let upper = qr.r();
        let diagonal = upper.diagonal();
        let mut distinct = diagonal.iter().zip(&lengths);
        if !distinct.all(|(own, length)| own.abs() > f64::EPSILON * length) {
            return None;
        }
        let turned = self.triangle.column(self.triangle.ncols() - 1);
        let mut turned = turned.into_owned().resize_vertically(rows, 0.0);
        qr.q_tr_mul(&mut turned);
        let inverse = upper.solve_upper_triangular(&DMatrix::identity(columns, columns))?;
        let coefficients = &inverse * turned.rows(0, columns);
        let covariance = &inverse * inverse.transpose();
        let cost = turned.rows_range(columns..).norm_squared();
        let (mut squares, mut by_prior) = (cost, 0.0);
        let of_always = covariance.view((0, 0), (always, always));
        for row in &self.prior {
            let (own, residual) = (row.rows(0, always), row[row.len() - 1]);
            squares -= (residual - own.dot(&coefficients.rows(0, always))).powi(2);
            by_prior += own.dot(&(of_always * own));
        }
        Some(Fit {
            coefficients,
            covariance,
            squares: squares.max(0.0),
            cost,
            freedom: self.worth - columns as f64 + by_prior,
        })
    }

    /// Σ over all measured rows of the squared contribution of these candidates.
    pub(super) fn effect(&self, chosen: &[usize], coefficients: &[f64]) -> f64 {
        let columns: Vec<_> = chosen.iter().map(|c| self.always + c).collect();
        let part = self.triangle.select_columns(&columns);
        (part * DVector::from_column_slice(coefficients)).norm_squared()
    }
}
