//! The orthogonal reduction on which everything rests: rows go into an upper triangular factor by
//! Householder reflections.

use crate::Real;
use crate::snapshot::{Reader, State, Writer};
use core::hint::black_box;

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

    /// Leaves nothing in the last column.
    pub(crate) fn clear_last_column(&mut self) {
        *self = self.with_last_column(&[]);
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

// The functions on slices are shared by triangles of all sizes: each size of its own would be unrolled
// into more flash than its speed is worth. For the same reason one length is hidden from the optimiser.

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

/// Householder reflections of the leading columns of a triangle of `size` columns with a block of rows.
#[allow(clippy::inline_always)] // the sizes of each caller are constants that unroll it
#[inline(always)]
fn reduce<T: Real, const K: usize>(
    entries: &mut [T],
    size: usize,
    mut columns: &mut [[T; K]],
    pivots: usize,
) {
    let mut rest = entries;
    for row in 0..pivots {
        let Some((head, tail)) = rest.split_at_mut_checked(size - row) else {
            return;
        };
        rest = tail;
        let (Some((diagonal, right)), Some((column, later))) =
            (head.split_first_mut(), columns.split_first_mut())
        else {
            return;
        };
        columns = later;
        let below = dot(column, column);
        // Nothing to eliminate, or less than squares can hold without underflow: what is left of
        // a column by rounding alone when the block has fewer rows than columns.
        if !(below > T::SMALLEST_SQUARE) {
            continue;
        }
        let squared = *diagonal * *diagonal + below;
        let inverse_norm = squared.inverse_square_root();
        // The reflection v = (r ∓ norm, column) that keeps the sign of r (Parlett 1971): in a long
        // stream every entry of R is moved by a small correction, whose rounding is small too. The
        // usual sign would turn R over at every block, and round all of it.
        let sum = diagonal.magnitude() + squared * inverse_norm;
        let growth = below / sum;
        let growth = if *diagonal < T::ZERO { -growth } else { growth };
        let pivot = -growth;
        let scale = sum * inverse_norm / below;
        *diagonal += growth;
        for (entry, other) in right.iter_mut().zip(columns.iter_mut()) {
            let projection = (pivot * *entry + dot(column, other)) * scale;
            *entry -= projection * pivot;
            // By index, here and in `dot`: where a program is compiled in parts, iterators over two slices are not
            // inlined, and a sample costs four times as much.
            for index in 0..K {
                if let (Some(target), Some(source)) = (other.get_mut(index), column.get(index)) {
                    *target -= projection * *source;
                }
            }
        }
    }
}

fn packed_row<T>(entries: &[T], size: usize, row: usize) -> &[T] {
    let above = row.saturating_sub(1) * row / 2;
    let start = (row * size).saturating_sub(above);
    entries
        .get(start..)
        .and_then(|rest| rest.get(..size.saturating_sub(row)))
        .unwrap_or_default()
}

#[inline(never)]
fn affine<T: Real>(entries: &[T], x: &[T], product: &mut [T]) {
    let mut rest = entries;
    for (index, target) in product.iter_mut().enumerate() {
        let x = x.get(index..).unwrap_or_default();
        let Some((row, [right, below @ ..])) = rest.split_at_checked(x.len()) else {
            return;
        };
        rest = below;
        let mut value = *right;
        for (factor, x) in row.iter().zip(x) {
            value += *factor * *x;
        }
        *target = value;
    }
}

#[inline(never)]
fn transposed<T: Real>(entries: &[T], v: &[T], product: &mut [T]) {
    let (mut rest, mut product) = (entries, product);
    for part in v {
        let Some((row, [_, below @ ..])) = rest.split_at_checked(product.len()) else {
            return;
        };
        for (sum, factor) in product.iter_mut().zip(row) {
            *sum += *factor * *part;
        }
        let Some((_, others)) = product.split_first_mut() else {
            return;
        };
        (rest, product) = (below, others);
    }
}

#[inline(never)]
fn column_norms<T: Real>(entries: &[T], norms: &mut [T]) {
    let size = norms.len();
    for row in 0..size {
        let entries = packed_row(entries, size, row);
        for (sum, entry) in norms.iter_mut().skip(row).zip(entries) {
            *sum += *entry * *entry;
        }
    }
    for norm in norms {
        *norm = norm.square_root();
    }
}

/// x with xᵀ U = vᵀ in the place of v.
#[inline(never)]
fn left_substitute<T: Real>(entries: &[T], size: usize, vector: &mut [T]) {
    let (mut rows, mut rest) = (entries, vector);
    for length in (2..=size).rev() {
        let (Some(([pivot, row @ ..], below)), Some((target, later))) =
            (rows.split_at_checked(length), rest.split_first_mut())
        else {
            return;
        };
        *target /= *pivot;
        for (entry, factor) in later.iter_mut().zip(row) {
            *entry -= *target * *factor;
        }
        (rows, rest) = (below, later);
    }
}

/// x with U x = −v in the place of v.
#[inline(never)]
fn back_substitute<T: Real>(entries: &[T], smallest: &[T], solution: &mut [T]) -> bool {
    // From the last row, which holds the right-hand side's own entry alone.
    let Some((_, mut rest)) = entries.split_last() else {
        return false;
    };
    let size = solution.len();
    for index in (0..size).rev() {
        let length = size + 1 - index;
        let Some((before, [pivot, row @ ..])) =
            rest.split_at_checked(rest.len().saturating_sub(length))
        else {
            return false;
        };
        rest = before;
        let (Some([target, known @ ..]), Some(smallest)) =
            (solution.get_mut(index..), smallest.get(index))
        else {
            return false;
        };
        let mut value = -*target;
        for (coefficient, known) in row.iter().zip(known.iter()) {
            value -= *coefficient * *known;
        }
        if !(pivot.magnitude() > *smallest) {
            return false;
        }
        *target = value / *pivot;
    }
    true
}

/// Columns side by side: an entry of the triangle is loaded once for all of them.
#[inline(never)]
fn inverse_columns<T: Real, const K: usize>(entries: &[T], size: usize, columns: &mut [[T; K]]) {
    let length = black_box(columns.len());
    let end = (length * size).saturating_sub(length.saturating_sub(1) * length / 2);
    let mut rest = entries.get(..end).unwrap_or_default();
    for row in (0..length).rev() {
        let above = rest.len().saturating_sub(size.saturating_sub(row));
        let (Some((before, [pivot, entries @ ..])), Some([target, known @ ..])) =
            (rest.split_at_checked(above), columns.get_mut(row..))
        else {
            return;
        };
        rest = before;
        let mut values = core::array::from_fn(|column| {
            if column + length == row + K {
                T::ONE
            } else {
                T::ZERO
            }
        });
        for (entry, known) in entries.iter().zip(known.iter()) {
            for (value, known) in values.iter_mut().zip(known) {
                *value -= *entry * *known;
            }
        }
        let inverse = T::ONE / *pivot;
        *target = values.map(|value| value * inverse);
    }
}

#[inline(never)]
fn substitute<T: Real>(entries: &[T], size: usize, column: &mut [T]) {
    for row in (0..black_box(column.len().saturating_sub(1))).rev() {
        let ([pivot, row @ ..], Some([target, known @ ..])) =
            (packed_row(entries, size, row), column.get_mut(row..))
        else {
            return;
        };
        let mut value = T::ZERO;
        for (entry, known) in row.iter().zip(known.iter()) {
            value -= *entry * *known;
        }
        *target = value / *pivot;
    }
}

/// Σ aᵢbᵢ in four interleaved sums: a stated order that vectorises, the same on every platform.
#[inline]
fn dot<T: Real, const K: usize>(a: &[T; K], b: &[T; K]) -> T {
    let lanes = K / 4 * 4;
    let mut sum = T::ZERO;
    if let (Some([a0, a1, a2, a3]), Some([b0, b1, b2, b3])) =
        (a.first_chunk::<4>(), b.first_chunk::<4>())
    {
        let mut sums = [*a0 * *b0, *a1 * *b1, *a2 * *b2, *a3 * *b3];
        for index in 4..lanes {
            if let (Some(sum), Some(a), Some(b)) =
                (sums.get_mut(index % 4), a.get(index), b.get(index))
            {
                *sum += *a * *b;
            }
        }
        let [s0, s1, s2, s3] = sums;
        sum = (s0 + s2) + (s1 + s3);
    }
    for index in lanes..K {
        if let (Some(a), Some(b)) = (a.get(index), b.get(index)) {
            sum += *a * *b;
        }
    }
    sum
}

#[cfg(test)]
mod tests;
