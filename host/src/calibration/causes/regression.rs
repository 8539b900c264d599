//! Least squares with columns that may or may not take part, from the triangle of all rows.

use nalgebra::{DMatrix, DVector};

/// A column whose length outside the span of the others is less than this part of its length is
/// not told apart from them.
const INDISTINCT: f64 = 1e-6;

/// Rows of columns that always take part, of columns that may, and of the residual, reduced to a
/// triangle as they come.
pub(super) struct Rows {
    triangle: DMatrix<f64>,
    waiting: Vec<DVector<f64>>,
    /// Columns that always take part.
    always: usize,
    /// How many residuals the rows are worth.
    worth: f64,
    /// Rows of the prior, the residual last.
    prior: Vec<DVector<f64>>,
}

impl Rows {
    /// No rows yet: `always` columns, then `candidates`, then the residual.
    pub(super) fn new(always: usize, candidates: usize) -> Self {
        let width = always + candidates + 1;
        Self {
            triangle: DMatrix::zeros(width, width),
            waiting: Vec::new(),
            always,
            worth: 0.0,
            prior: Vec::new(),
        }
    }

    /// A measured row that counts with `weight` in the sum of squares.
    pub(super) fn add(&mut self, row: DVector<f64>, weight: f64) {
        self.worth += weight;
        self.take(row * weight.sqrt());
    }

    /// A row of the prior about the first columns.
    pub(super) fn add_prior(&mut self, columns: impl Iterator<Item = f64>, residual: f64) {
        let width = self.triangle.ncols();
        let mut row = DVector::zeros(width);
        for (entry, own) in row.iter_mut().zip(columns) {
            *entry = own;
        }
        row[width - 1] = residual;
        self.prior.push(row.clone());
        self.take(row);
    }

    fn take(&mut self, row: DVector<f64>) {
        self.waiting.push(row);
        if self.waiting.len() >= 2 * self.triangle.ncols() {
            self.reduce();
        }
    }

    fn reduce(&mut self) {
        let width = self.triangle.ncols();
        let mut all = DMatrix::zeros(width + self.waiting.len(), width);
        all.rows_mut(0, width).copy_from(&self.triangle);
        for (mut to, row) in all.row_iter_mut().skip(width).zip(&self.waiting) {
            to.copy_from(&row.transpose());
        }
        self.triangle = all.qr().unpack_r();
        self.waiting.clear();
    }

    /// All rows taken in.
    pub(super) fn regression(mut self) -> Regression {
        self.reduce();
        Regression(self)
    }
}

/// All rows, with any of the candidates.
pub(super) struct Regression(Rows);

/// A fit of the columns that always take part and of some candidates.
pub(super) struct Solution {
    /// Of the columns that always take part and then of the candidates, in the order asked for.
    pub(super) coefficients: DVector<f64>,
    /// Their covariance for residuals of unit variance.
    pub(super) covariance: DMatrix<f64>,
    /// Σ r² of the measured rows.
    pub(super) squares: f64,
    /// Measured rows less the coefficients that they and not the prior determine.
    pub(super) freedom: f64,
}

impl Solution {
    /// Of one residual, as the measured rows have it.
    pub(super) fn variance(&self) -> f64 {
        self.squares / self.freedom
    }
}

impl Regression {
    fn part(&self, chosen: &[usize]) -> DMatrix<f64> {
        let always = self.0.always;
        let columns: Vec<_> = (0..always)
            .chain(chosen.iter().map(|column| always + column))
            .collect();
        self.0.triangle.select_columns(&columns)
    }

    fn residual(&self) -> DVector<f64> {
        let triangle = &self.0.triangle;
        triangle.column(triangle.ncols() - 1).into_owned()
    }

    /// The fit with these candidates; `None` if the rows do not tell the columns apart.
    pub(super) fn solve(&self, chosen: &[usize]) -> Option<Solution> {
        let part = self.part(chosen);
        let columns = part.ncols();
        let lengths: Vec<_> = part.column_iter().map(|column| column.norm()).collect();
        let qr = part.qr();
        let upper = qr.r();
        let diagonal = upper.diagonal();
        let distinct = |(own, length): (&f64, &f64)| own.abs() > f64::EPSILON * length;
        if !diagonal.iter().zip(&lengths).all(distinct) {
            return None;
        }
        let mut turned = self.residual();
        qr.q_tr_mul(&mut turned);
        let inverse = upper.solve_upper_triangular(&DMatrix::identity(columns, columns))?;
        let coefficients = &inverse * turned.rows(0, columns);
        let covariance = &inverse * inverse.transpose();
        let mut squares = turned.rows_range(columns..).norm_squared();
        let mut by_prior = 0.0;
        let always = self.0.always;
        let of_always = covariance.view((0, 0), (always, always));
        for row in &self.0.prior {
            let (own, residual) = (row.rows(0, always), row[row.len() - 1]);
            squares -= (residual - own.dot(&coefficients.rows(0, always))).powi(2);
            by_prior += own.dot(&(of_always * own));
        }
        let number = lengths.iter().fold(0.0, |count, _| count + 1.0);
        Some(Solution {
            coefficients,
            covariance,
            squares: squares.max(0.0),
            freedom: self.0.worth - number + by_prior,
        })
    }

    /// For each group of candidates, by how much the sum of squares falls if it joins the chosen ones;
    /// `None` for a group that the rows do not tell apart from the columns that take part.
    pub(super) fn gains(&self, chosen: &[usize], groups: &[Vec<usize>]) -> Vec<Option<f64>> {
        let part = self.part(chosen);
        let columns = part.ncols();
        let mut turned = self.0.triangle.clone();
        part.qr().q_tr_mul(&mut turned);
        let width = turned.ncols();
        let left = turned.rows_range(columns..).into_owned();
        let residual = left.column(width - 1).into_owned();
        let gain = |group: &Vec<usize>| {
            let group: Vec<_> = group.iter().map(|column| self.0.always + column).collect();
            let own = left.select_columns(&group);
            let qr = own.qr();
            let lengths = group.iter().map(|column| turned.column(*column).norm());
            let diagonal = qr.r().diagonal();
            let distinct = |(own, length): (&f64, f64)| own.abs() > INDISTINCT * length;
            let mut projected = residual.clone();
            qr.q_tr_mul(&mut projected);
            diagonal
                .iter()
                .zip(lengths)
                .all(distinct)
                .then(|| projected.rows(0, group.len()).norm_squared())
        };
        groups.iter().map(gain).collect()
    }

    /// Σ over all measured rows of the squared contribution of these candidates.
    pub(super) fn effect(&self, chosen: &[usize], coefficients: &[f64]) -> f64 {
        let columns: Vec<_> = chosen.iter().map(|c| self.0.always + c).collect();
        let part = self.0.triangle.select_columns(&columns);
        (part * DVector::from_column_slice(coefficients)).norm_squared()
    }

    /// The squared length of a candidate over the measured rows.
    pub(super) fn length_squared(&self, candidate: usize) -> f64 {
        self.0
            .triangle
            .column(self.0.always + candidate)
            .norm_squared()
    }

    /// How many residuals the measured rows are worth.
    pub(super) fn worth(&self) -> f64 {
        self.0.worth
    }
}
