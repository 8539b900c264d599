//! The orthogonal reduction on which everything rests: rows go into an upper triangular factor by
//! Householder reflections.

mod reflections;
mod substitution;

use crate::Real;
use crate::snapshot::{Reader, State, Writer};
use reflections::reduce;
use substitution::{
    affine, back_substitute, column_norms, inverse_columns, left_substitute, packed_row,
    substitute, transposed,
};

/// R of a QR factorisation, upper triangular `N × N`, packed by rows into `LENGTH` = N(N+1)/2
/// numbers. RᵀR is the sum of the outer products of all rows ever absorbed.
///
/// Sums of outer products are never formed themselves: that would square the condition number,
/// which single precision cannot bear.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(unreachable_pub)] // part of a sealed trait; nameable by no other crate
pub struct Triangle<T, const N: usize, const LENGTH: usize> {
    entries: [T; LENGTH],
}

impl<T: Real, const N: usize, const LENGTH: usize> State<T> for Triangle<T, N, LENGTH> {
    const BYTES: usize = LENGTH * T::BYTES;

    fn save(&self, to: &mut Writer<'_>) {
        self.entries.save(to);
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        self.entries.load(from);
    }
}

impl<T: Real, const N: usize, const LENGTH: usize> Triangle<T, N, LENGTH> {
    pub(crate) const fn zero() -> Self {
        const { assert!(LENGTH == N * (N + 1) / 2) };
        Self {
            entries: [T::ZERO; LENGTH],
        }
    }

    /// The rows, each from its diagonal entry on: lengths N, N − 1, … 1.
    pub fn rows(&self) -> impl Iterator<Item = &[T]> {
        let mut rest = self.entries.as_slice();
        (0..N).map_while(move |row| {
            let (head, tail) = rest.split_at_checked(N - row)?;
            rest = tail;
            Some(head)
        })
    }

    /// One row, from its diagonal entry on.
    pub(crate) fn row(&self, row: usize) -> &[T] {
        packed_row(&self.entries, N, row)
    }

    /// The same to write to.
    #[cfg(feature = "linear")]
    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [T] {
        self.entries_from(N.saturating_sub(row))
            .get_mut(..N.saturating_sub(row))
            .unwrap_or_default()
    }

    /// Lengths of the columns.
    pub(crate) fn column_norms(&self) -> [T; N] {
        let mut norms = [T::ZERO; N];
        column_norms(&self.entries, &mut norms);
        norms
    }

    /// x that makes |R (x, 1)| least, M = N − 1 numbers, by back-substitution. `None` if a pivot is not
    /// greater than its column's `smallest`: the rows do not determine x.
    pub(crate) fn minimiser<const M: usize>(&self, smallest: &[T; N]) -> Option<[T; M]> {
        const { assert!(M + 1 == N) };
        let mut solution = [T::ZERO; M];
        for (right, row) in solution.iter_mut().zip(self.rows()) {
            *right = row.last().copied().unwrap_or(T::ZERO);
        }
        back_substitute(&self.entries, smallest, &mut solution).then_some(solution)
    }

    /// −(UᵀU)⁻¹ v and vᵀ (UᵀU)⁻¹ v, U the columns but the last: the step to the minimum where Jᵀr = v, and
    /// what it gains, by two substitutions.
    pub(crate) fn step_against<const M: usize>(&self, mut v: [T; M]) -> Option<([T; M], T)> {
        const { assert!(M + 1 == N) };
        left_substitute(&self.entries, N, &mut v);
        let mut gain = T::ZERO;
        for entry in v {
            gain += entry.squared();
        }
        back_substitute(&self.entries, &[T::ZERO; N], &mut v).then_some((v, gain))
    }

    /// The last columns of the inverse of the leading rows and columns, as many as `columns` is long.
    pub(crate) fn inverse_columns<const K: usize>(&self, columns: &mut [[T; K]]) {
        inverse_columns(&self.entries, N, columns);
    }

    /// Uᵀ v, U the rows and columns but the last.
    pub(crate) fn leading_transposed<const M: usize>(&self, v: &[T; M]) -> [T; M] {
        const { assert!(M + 1 == N) };
        let mut product = [T::ZERO; M];
        transposed(&self.entries, v, &mut product);
        product
    }

    /// U x + c, U the rows and columns but the last and c the last one's entries beside them.
    pub(crate) fn leading_residual<const M: usize>(&self, x: &[T; M]) -> [T; M] {
        const { assert!(M + 1 == N) };
        let mut residual = [T::ZERO; M];
        affine(&self.entries, x, &mut residual);
        residual
    }

    /// The square of the last column's own entry: what no x leaves less of |R (x, 1)|².
    pub(crate) fn least_sum_of_squares(&self) -> T {
        self.entries.last().map_or(T::ZERO, |entry| entry.squared())
    }

    /// Completes a column whose last entry is given, so that the rows above that entry give zero.
    pub(crate) fn complete_column(&self, column: &mut [T]) {
        substitute(&self.entries, N, column);
    }

    /// Puts numbers on the diagonal of an empty triangle, and beside them into the last column.
    pub fn from_diagonal(diagonal: &[T], last_column: &[T]) -> Self {
        let mut triangle = Self::zero();
        let mut rest = triangle.entries.as_mut_slice();
        for (row, (value, right)) in diagonal.iter().zip(last_column).enumerate() {
            let Some((head, tail)) = rest.split_at_mut_checked(N - row) else {
                break;
            };
            if let Some(entry) = head.first_mut() {
                *entry = *value;
            }
            if let Some(entry) = head.last_mut() {
                *entry = *right;
            }
            rest = tail;
        }
        triangle
    }

    /// The same with another last column, and nothing in its last row.
    pub(crate) fn with_last_column(mut self, values: &[T]) -> Self {
        let mut rest = self.entries.as_mut_slice();
        let mut values = values.iter();
        for row in 0..N {
            let Some((head, tail)) = rest.split_at_mut_checked(N - row) else {
                break;
            };
            if let Some(entry) = head.last_mut() {
                *entry = values.next().copied().unwrap_or(T::ZERO);
            }
            rest = tail;
        }
        self
    }

    /// Multiplies every entry.
    pub(crate) fn scale(&mut self, factor: T) {
        for entry in &mut self.entries {
            *entry *= factor;
        }
    }

    /// Takes in K rows, given by columns; the block is used up as work space. Rows of zeros change
    /// nothing, so a block need not be full.
    ///
    /// One Householder reflection a column, of the diagonal entry with the block's column. Cost:
    /// about 2KN² multiplications and additions, N square roots.
    #[inline(never)]
    pub(crate) fn absorb<const K: usize>(&mut self, block: &mut [[T; K]; N]) {
        reduce(&mut self.entries, N, block.as_mut_slice(), N);
    }

    /// Takes in K rows that are zero left of some column, given by the columns from there on, as far as
    /// the first `pivots` of these columns go. What is left of the rows stands in the other columns.
    #[inline(never)]
    pub fn eliminate<const K: usize>(&mut self, columns: &mut [[T; K]], pivots: usize) {
        let size = columns.len();
        reduce(self.entries_from(size), size, columns, pivots);
    }

    /// The rows from that on whose length is `size`.
    fn entries_from(&mut self, size: usize) -> &mut [T] {
        let start = LENGTH.saturating_sub(size * (size + 1) / 2);
        self.entries.get_mut(start..).unwrap_or_default()
    }

    /// Takes in another triangle: its rows become a block.
    pub(crate) fn merge(&mut self, other: &Self) {
        let mut block = [[T::ZERO; N]; N];
        for (index, row) in other.rows().enumerate() {
            put_row(&mut block, index, index, row);
        }
        self.absorb(&mut block);
    }

    /// The same, four rows at a time: slower, and on a small stack.
    pub(crate) fn merge_by_rows(&mut self, other: &Self) {
        for first in (0..N).step_by(4) {
            let mut block = [[T::ZERO; 4]; N];
            for index in 0..4 {
                if first + index < N {
                    put_row(&mut block, index, first + index, other.row(first + index));
                }
            }
            let columns = block.get_mut(first..).unwrap_or_default();
            let pivots = columns.len();
            self.eliminate(columns, pivots);
        }
    }
}

/// Writes a row that begins at a column into a block given by columns.
pub(crate) fn put_row<T: Copy, const K: usize>(
    columns: &mut [[T; K]],
    index: usize,
    start: usize,
    row: &[T],
) {
    for (column, value) in columns.iter_mut().skip(start).zip(row) {
        if let Some(entry) = column.get_mut(index) {
            *entry = *value;
        }
    }
}

#[cfg(test)]
mod tests;
