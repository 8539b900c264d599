//! The orthogonal reduction behind everything else: Householder reflections absorb rows into an upper triangular
//! factor.

use super::unknowns::Unknowns;
use crate::Real;
use crate::state::{Reader, State, Writer};
use core::hint::black_box;
use core::ops::Range;

/// R of a QR factorisation of rows of N unknowns and the right-hand side: upper triangular, N + 1 columns, packed by
/// rows. RᵀR is the sum of the outer products of all absorbed rows.
///
/// The sums of outer products are never formed: that would square the condition number, which single precision cannot
/// tolerate.
#[derive(Debug, Clone, PartialEq)]
#[allow(unreachable_pub)] // part of a sealed trait; nameable by no other crate
pub struct Triangle<T: Unknowns<N>, const N: usize> {
    entries: T::Triangle,
}

impl<T: Unknowns<N>, const N: usize> State<T> for Triangle<T, N> {
    const BYTES: usize = (N + 1) * (N + 2) / 2 * T::BYTES;

    fn save(&self, to: &mut Writer<'_>) {
        for entry in self.entries.as_ref() {
            entry.save(to);
        }
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        for entry in self.entries.as_mut() {
            entry.load(from);
        }
    }
}

impl<T: Unknowns<N>, const N: usize> Triangle<T, N> {
    const COLUMNS: usize = N + 1;

    #[inline(always)]
    pub(crate) const fn zero() -> Self {
        Self { entries: T::ZEROS }
    }

    /// The rows, each from its diagonal entry on: lengths N + 1, N, …, 1.
    pub fn rows(&self) -> impl Iterator<Item = &[T]> {
        let mut rest = self.entries.as_ref();
        (0..Self::COLUMNS).map_while(move |row| {
            let (head, tail) = rest.split_at_checked(Self::COLUMNS - row)?;
            rest = tail;
            Some(head)
        })
    }

    /// One row, from its diagonal entry on.
    pub(crate) fn row(&self, row: usize) -> &[T] {
        packed_row(self.entries.as_ref(), Self::COLUMNS, row)
    }

    /// The same, mutable.
    #[cfg(feature = "linear")]
    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [T] {
        self.entries_from(Self::COLUMNS.saturating_sub(row))
            .get_mut(..Self::COLUMNS.saturating_sub(row))
            .unwrap_or_default()
    }

    /// Lengths of the unknowns' columns.
    pub(crate) fn column_norms(&self) -> [T; N] {
        let mut norms = [T::ZERO; N];
        T::column_norms(self.entries.as_ref(), &mut norms);
        norms
    }

    /// Length of an unknown's column.
    pub(crate) fn column_norm(&self, column: usize) -> T {
        let rows = self.rows().take(column + 1).enumerate();
        let entries = rows.filter_map(|(row, entries)| entries.get(column.saturating_sub(row)));
        entries
            .fold(T::ZERO, |sum, entry| sum + entry.squared())
            .square_root()
    }

    /// The x that minimises |R (x, 1)|, by back-substitution. `None` if a pivot does not exceed its column's `smallest`:
    /// the rows do not determine x.
    pub(crate) fn minimiser(&self, smallest: &[T; N]) -> Option<[T; N]> {
        let mut solution = [T::ZERO; N];
        for (right, row) in solution.iter_mut().zip(self.rows()) {
            *right = row.last().copied().unwrap_or(T::ZERO);
        }
        T::back_substitute(self.entries.as_ref(), smallest, &mut solution).then_some(solution)
    }

    /// −(UᵀU)⁻¹ v and vᵀ (UᵀU)⁻¹ v by two substitutions, U without the last column: the step to the minimum where Jᵀr =
    /// v, and its gain.
    pub(crate) fn step_against(&self, mut v: [T; N]) -> Option<([T; N], T)> {
        left_substitute(self.entries.as_ref(), Self::COLUMNS, &mut v);
        let mut gain = T::ZERO;
        for entry in v {
            gain += entry.squared();
        }
        T::back_substitute(self.entries.as_ref(), &[T::ZERO; N], &mut v).then_some((v, gain))
    }

    /// Four of the last columns of the inverse of the leading rows and columns, as many as `columns` is long, and the
    /// products of these `rows` of them added to the lower half of a matrix of N rows given by columns.
    pub(crate) fn invert(&self, columns: &mut [[T; 4]], covariance: &mut [T], rows: Range<usize>) {
        let entries = self.entries.as_ref();
        T::invert(entries, Self::COLUMNS, columns, covariance, rows);
    }

    /// Uᵀ v, U without the last row and column.
    pub(crate) fn leading_transposed(&self, v: &[T; N]) -> [T; N] {
        let mut product = [T::ZERO; N];
        transposed(self.entries.as_ref(), v, &mut product);
        product
    }

    /// U x + c, U without the last row and column, c the entries of the last column beside them.
    pub(crate) fn leading_residual(&self, x: &[T; N]) -> [T; N] {
        let mut residual = [T::ZERO; N];
        T::affine(self.entries.as_ref(), x, &mut residual);
        residual
    }

    /// The square of the last column's diagonal entry: the minimum of |R (x, 1)|² over x.
    pub(crate) fn least_sum_of_squares(&self) -> T {
        let last = self.entries.as_ref().last();
        last.map_or(T::ZERO, |entry| entry.squared())
    }

    /// Completes a column whose last entry is given so that the rows above that entry yield zero.
    pub(crate) fn complete_column(&self, column: &mut [T]) {
        substitute(self.entries.as_ref(), Self::COLUMNS, column);
    }

    /// Sets the diagonal and the last column, and zeros everywhere else.
    pub(crate) fn set_diagonal(&mut self, diagonal: &[T], last_column: &[T]) {
        let mut rest = self.entries.as_mut();
        rest.fill(T::ZERO);
        for (row, (value, right)) in diagonal.iter().zip(last_column).enumerate() {
            let Some((head, tail)) = rest.split_at_mut_checked(Self::COLUMNS - row) else {
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
    }

    #[cfg(test)]
    pub(crate) fn from_diagonal(diagonal: &[T], last_column: &[T]) -> Self {
        let mut triangle = Self::zero();
        triangle.set_diagonal(diagonal, last_column);
        triangle
    }

    /// Multiplies every entry.
    pub(crate) fn scale(&mut self, factor: T) {
        for entry in self.entries.as_mut() {
            *entry *= factor;
        }
    }

    /// Absorbs K rows, given by columns; the block serves as work space. Rows of zeros change nothing, so a block need
    /// not be full.
    ///
    /// One Householder reflection per column, of the diagonal entry with the block's column. Cost: about 2KN²
    /// multiplications and additions, N square roots.
    #[inline(never)] // with `eliminate` and `squares` 0.8 kB of joint flash
    pub(crate) fn absorb<const K: usize>(&mut self, block: &mut T::Columns<[T; K]>) {
        let entries = self.entries.as_mut();
        reduce(entries, Self::COLUMNS, block.as_mut(), Self::COLUMNS);
    }

    /// Absorbs four rows that are zero left of some column, given by the columns from there on: one function for
    /// triangles of all sizes.
    pub(crate) fn absorb_four(&mut self, columns: &mut [[T; 4]]) {
        let pivots = columns.len();
        T::absorb_four(self.entries_from(pivots), columns, pivots);
    }

    /// Absorbs K rows that are zero left of some column, given by the columns from there on, for the first `pivots` of
    /// these columns. The remainder of the rows is left in the other columns.
    #[inline(never)] // see `absorb`
    pub(crate) fn eliminate<const K: usize>(&mut self, columns: &mut [[T; K]], pivots: usize) {
        let size = columns.len();
        reduce(self.entries_from(size), size, columns, pivots);
    }

    /// All entries, row by row.
    pub(crate) fn entries(&self) -> &[T] {
        self.entries.as_ref()
    }

    /// The same, mutable.
    pub(crate) fn entries_mut(&mut self) -> &mut [T] {
        self.entries.as_mut()
    }

    /// The entries from the row of length `size` on.
    pub(crate) fn entries_from(&mut self, size: usize) -> &mut [T] {
        let entries = self.entries.as_mut();
        let start = entries.len().saturating_sub(size * (size + 1) / 2);
        entries.get_mut(start..).unwrap_or_default()
    }

    /// Exchanges entries so that those of the first `used` columns and the last stand at the front, as a triangle of `used`
    /// unknowns has them; or back, which a change of those alone leaves possible.
    pub(crate) fn pack(&mut self, used: usize, back: bool) {
        let columns = move |row| (row..used).chain([N]);
        let from = move |row, column| row * Self::COLUMNS + column - row * (row + 1) / 2;
        let all = columns(0).flat_map(move |row| columns(row).map(move |column| from(row, column)));
        let count = (used + 1) * (used + 2) / 2;
        let entries = self.entries.as_mut();
        let exchange = |pair: (usize, usize)| {
            // Equal ones stay.
            if let Ok([one, other]) = entries.get_disjoint_mut([pair.0, pair.1]) {
                core::mem::swap(one, other);
            }
        };
        if back {
            (0..count).rev().zip(all.rev()).for_each(exchange);
        } else {
            (0..count).zip(all).for_each(exchange);
        }
    }

    /// Absorbs another triangle: its K = N + 1 rows become a block.
    pub(crate) fn merge<const K: usize>(&mut self, other: &Self) {
        const { assert!(K == N + 1) };
        let mut block = T::columns([T::ZERO; K]);
        for (index, row) in other.rows().enumerate() {
            put_row(block.as_mut(), index, index, row);
        }
        self.absorb(&mut block);
    }

    /// The same, four rows at a time: slower, but with a small stack.
    pub(crate) fn merge_by_rows(&mut self, other: &Self) {
        for first in (0..Self::COLUMNS).step_by(4) {
            let mut block = T::columns([T::ZERO; 4]);
            for index in 0..4 {
                if first + index < Self::COLUMNS {
                    put_row(
                        block.as_mut(),
                        index,
                        first + index,
                        other.row(first + index),
                    );
                }
            }
            self.absorb_four(block.as_mut().get_mut(first..).unwrap_or_default());
        }
    }
}

/// The sum of squares.
#[inline(never)] // see `absorb`
pub(crate) fn squares<T: Real>(values: &[T]) -> T {
    let sum = |sum, value: &T| sum + value.squared();
    values.iter().fold(T::ZERO, sum)
}

/// The values from an index on, padded with zeros.
pub(crate) fn part<T: Real, const K: usize>(values: &[T], first: usize) -> [T; K] {
    let mut part = [T::ZERO; K];
    let values = values.get(first..).unwrap_or_default();
    for (own, value) in part.iter_mut().zip(values) {
        *own = *value;
    }
    part
}

/// Writes a row that begins at some column into a block given by columns.
pub(crate) fn put_row<T: Copy, const K: usize>(
    columns: &mut [[T; K]],
    index: usize,
    start: usize,
    row: &[T],
) {
    let columns = columns.get_mut(start..).unwrap_or_default();
    for (column, value) in columns.iter_mut().zip(row) {
        if let Some(entry) = column.get_mut(index) {
            *entry = *value;
        }
    }
}

/// Householder reflections of the leading columns of a triangle of `size` columns with a block of rows.
#[inline(always)] // each caller's number of rows unrolls it
pub(crate) fn reduce<T: Real, const K: usize>(
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
        reflect(diagonal, right, column, columns);
    }
}

/// Absorbs a row of nine columns into its triangle, one pivot of constant length at a time: in a program built for size
/// the compiler unrolls no loop.
pub(crate) fn absorb_nine<T: Real>(entries: &mut [T], row: &mut [[T; 1]; 9]) -> Option<()> {
    let (mut rest, mut columns) = (entries, &mut row[..]);
    macro_rules! reflections {
        ($($length:literal)+) => {$(
            let (head, below) = rest.split_first_chunk_mut::<$length>()?;
            let own = columns.first_chunk_mut::<$length>()?;
            let ([diagonal, right @ ..], [column, later @ ..]) = (head, own);
            reflect(diagonal, right, column, later);
            (rest, columns) = (below, later);
        )+};
    }
    reflections! { 9 8 7 6 5 4 3 2 1 }
    (rest.is_empty() && columns.is_empty()).then_some(())
}

/// The reflection of a triangle's row, from its diagonal entry on, with a column of a block and those to its right.
#[inline(always)]
fn reflect<T: Real, const K: usize>(
    diagonal: &mut T,
    right: &mut [T],
    column: &[T; K],
    later: &mut [[T; K]],
) {
    let below = dot(column, column);
    // Nothing to eliminate, or so little that its square underflows: the rounding left in a column if the block has
    // fewer rows than columns.
    if !(below > T::SMALLEST_SQUARE) {
        return;
    }
    let squared = *diagonal * *diagonal + below;
    let inverse_norm = squared.inverse_square_root();
    // The reflection v = (r ∓ norm, column) that keeps the sign of r (Parlett 1971): in a long stream each entry of R
    // changes by a small correction with small rounding. The usual sign would flip R at every block and round all of it.
    let sum = diagonal.magnitude() + squared * inverse_norm;
    let growth = below / sum;
    let growth = if *diagonal < T::ZERO { -growth } else { growth };
    let pivot = -growth;
    let scale = sum * inverse_norm / below;
    *diagonal += growth;
    let project = |entry: &mut T, other: &mut [T; K]| {
        let projection = (pivot * *entry + dot(column, other)) * scale;
        *entry -= projection * pivot;
        // By index, here and in `dot`: in a program compiled in several units, iterators over two slices are not
        // inlined, and a sample costs four times as much.
        for index in 0..K {
            if let (Some(target), Some(source)) = (other.get_mut(index), column.get(index)) {
                *target -= projection * *source;
            }
        }
    };
    let (mut right, mut later) = (right, later);
    if K == 2 {
        let ((fours, rest), (columns, others)) =
            (right.as_chunks_mut::<4>(), later.as_chunks_mut::<4>());
        for ([e0, e1, e2, e3], [c0, c1, c2, c3]) in fours.iter_mut().zip(columns) {
            project(e0, c0);
            project(e1, c1);
            project(e2, c2);
            project(e3, c3);
        }
        (right, later) = (rest, others);
    }
    for (entry, other) in right.iter_mut().zip(later) {
        project(entry, other);
    }
}

/// Σ aᵢbᵢ in four interleaved sums: a fixed order that vectorises, identical on every platform.
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

// Products and substitutions with an upper triangle, packed by rows. These functions are shared by triangles of all
// sizes: unrolling each size separately would cost more flash than the speed is worth. For the same reason one length
// is hidden from the optimiser.

fn packed_row<T>(entries: &[T], size: usize, row: usize) -> &[T] {
    let above = row.saturating_sub(1) * row / 2;
    let start = (row * size).saturating_sub(above);
    entries
        .get(start..)
        .and_then(|rest| rest.get(..size.saturating_sub(row)))
        .unwrap_or_default()
}

/// A value plus Σ aᵢ bᵢ, added in this order. In fours: in a program built for size the compiler unrolls no loop.
#[inline]
fn plus_products<T: Real>(value: T, a: &[T], b: &[T]) -> T {
    let length = a.len().min(b.len());
    let (a, last_a) = a.get(..length).unwrap_or_default().as_chunks::<4>();
    let (b, last_b) = b.get(..length).unwrap_or_default().as_chunks::<4>();
    let mut value = value;
    for (a, b) in a.iter().zip(b) {
        for (a, b) in a.iter().zip(b) {
            value += *a * *b;
        }
    }
    for (a, b) in last_a.iter().zip(last_b) {
        value += *a * *b;
    }
    value
}

/// Adds a multiple of one vector to another, in fours as well.
pub(crate) fn add_multiple<T: Real>(to: &mut [T], factor: T, vector: &[T]) {
    let length = to.len().min(vector.len());
    let (to, last_to) = to
        .get_mut(..length)
        .unwrap_or_default()
        .as_chunks_mut::<4>();
    let (vector, last) = vector.get(..length).unwrap_or_default().as_chunks::<4>();
    for (to, vector) in to.iter_mut().zip(vector) {
        for (sum, entry) in to.iter_mut().zip(vector) {
            *sum += *entry * factor;
        }
    }
    for (sum, entry) in last_to.iter_mut().zip(last) {
        *sum += *entry * factor;
    }
}

pub(crate) fn affine<T: Real>(entries: &[T], x: &[T], product: &mut [T]) {
    let (mut rest, mut x) = (entries, x);
    for target in product {
        let Some((row, [right, below @ ..])) = rest.split_at_checked(x.len()) else {
            return;
        };
        *target = plus_products(*right, row, x);
        (rest, x) = (below, x.get(1..).unwrap_or_default());
    }
}

fn transposed<T: Real>(entries: &[T], v: &[T], product: &mut [T]) {
    let (mut rest, mut product) = (entries, product);
    for part in v {
        let Some((row, [_, below @ ..])) = rest.split_at_checked(product.len()) else {
            return;
        };
        T::add_multiple(product, *part, row);
        let Some((_, others)) = product.split_first_mut() else {
            return;
        };
        (rest, product) = (below, others);
    }
}

pub(crate) fn column_norms<T: Real>(entries: &[T], norms: &mut [T]) {
    let (mut rest, mut later) = (entries, &mut *norms);
    while let Some((row, [_, below @ ..])) = rest.split_at_checked(later.len()) {
        for (sum, entry) in later.iter_mut().zip(row) {
            *sum += *entry * *entry;
        }
        let Some((_, others)) = later.split_first_mut() else {
            break;
        };
        (rest, later) = (below, others);
    }
    for norm in norms {
        *norm = norm.square_root();
    }
}

/// Solves xᵀ U = vᵀ in place.
fn left_substitute<T: Real>(entries: &[T], size: usize, vector: &mut [T]) {
    let (mut rows, mut rest) = (entries, vector);
    for length in (2..=size).rev() {
        let (Some(([pivot, row @ ..], below)), Some((target, later))) =
            (rows.split_at_checked(length), rest.split_first_mut())
        else {
            return;
        };
        *target /= *pivot;
        T::add_multiple(later, -*target, row);
        (rows, rest) = (below, later);
    }
}

/// Solves U x = −v in place.
pub(crate) fn back_substitute<T: Real>(entries: &[T], smallest: &[T], solution: &mut [T]) -> bool {
    // From the last row, which holds only the right-hand side's diagonal entry.
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
        let value = plus_products(*target, row, known);
        if !(pivot.magnitude() > *smallest) {
            return false;
        }
        *target = -value / *pivot;
    }
    true
}

/// Several columns at once: each entry of the triangle is loaded once for all of them.
pub(crate) fn inverse_columns<T: Real, const K: usize>(
    entries: &[T],
    size: usize,
    columns: &mut [[T; K]],
) {
    let length = columns.len();
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

/// Adds these columns of V Vᵀ to the lower half of a matrix with `size` rows given by columns. V is given by rows,
/// possibly fewer, padded with zeros.
pub(crate) fn add_square<T: Real, const K: usize>(
    v: &[[T; K]],
    matrix: &mut [T],
    size: usize,
    columns: Range<usize>,
) {
    let mut rest = matrix.get_mut(columns.start * size..).unwrap_or_default();
    for index in columns {
        let (Some((column, others)), Some(own)) = (
            core::mem::take(&mut rest).split_at_mut_checked(size),
            v.get(index),
        ) else {
            return;
        };
        rest = others;
        let (column, below) = (column.get_mut(index..).unwrap_or_default(), v.get(index..));
        for (sum, other) in column.iter_mut().zip(below.unwrap_or_default()) {
            let mut value = *sum;
            for (a, b) in own.iter().zip(other) {
                value += *a * *b;
            }
            *sum = value;
        }
    }
}

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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::Triangle;
    use crate::fixtures;
    use nalgebra::{SMatrix, SVector};

    type Small = Triangle<f64, 4>;

    /// Random rows as columns of a matrix.
    fn rows<const K: usize>(uniform: &mut impl FnMut() -> f64) -> [SVector<f64, 5>; K] {
        [(); K].map(|()| SVector::from([(); 5].map(|()| uniform())))
    }

    fn by_columns<const K: usize>(rows: &[SVector<f64, 5>; K]) -> [[f64; K]; 5] {
        let mut columns = [[0.0; K]; 5];
        for (index, row) in rows.iter().enumerate() {
            for (column, value) in columns.iter_mut().zip(row.iter()) {
                column[index] = *value;
            }
        }
        columns
    }

    /// Σ row rowᵀ.
    fn gram(rows: &[SVector<f64, 5>]) -> SMatrix<f64, 5, 5> {
        let zero = SMatrix::zeros();
        rows.iter()
            .fold(zero, |sum, row| sum + row * row.transpose())
    }

    fn full(triangle: &Small) -> SMatrix<f64, 5, 5> {
        let mut matrix = SMatrix::zeros();
        for (index, row) in triangle.rows().enumerate() {
            assert_eq!(row.len(), 5 - index);
            assert_eq!(row, triangle.row(index));
            for (offset, value) in row.iter().enumerate() {
                matrix[(index, index + offset)] = *value;
            }
        }
        matrix
    }

    /// About ten roundings of numbers of about 10.
    const SAME: f64 = 1e-13;

    fn same(triangle: &Small, expected: &SMatrix<f64, 5, 5>) -> bool {
        (fixtures::gram(triangle) - expected).amax() < SAME
    }

    #[test]
    fn rows_of_any_block_size_sum_up() {
        let mut uniform = fixtures::uniform(1);
        for _ in 0..100 {
            // Singly, in fours with a remainder, and with zeros after the last.
            let all = rows::<12>(&mut uniform);
            let expected = gram(&all);
            let mut singly = Small::zero();
            for row in &all {
                singly.absorb(&mut by_columns(&[*row]));
            }
            assert!(same(&singly, &expected));
            let mut at_once = Small::zero();
            at_once.absorb(&mut by_columns(&all));
            assert!(same(&at_once, &expected));
            let mut in_parts = Small::zero();
            let [a, b, c, d, e, f, g, h, i, j, k, l] = all;
            in_parts.absorb(&mut by_columns(&[a, b, c, d, e, f, g]));
            in_parts.absorb(&mut by_columns(&[h, i, j, k, l, SVector::zeros()]));
            assert!(same(&in_parts, &expected));
            let mut merged = Small::zero();
            merged.absorb(&mut by_columns(&[a, b, c, d, e]));
            let mut other = Small::zero();
            other.absorb(&mut by_columns(&[f, g, h, i, j, k, l]));
            merged.merge::<5>(&other);
            assert!(same(&merged, &expected));
            merged.scale(0.5);
            assert!(same(&merged, &(expected * 0.25)));
        }
    }

    /// In a long stream the factor's entries change by small corrections: the diagonal never changes sign.
    #[test]
    fn the_diagonal_keeps_its_signs() {
        let mut uniform = fixtures::uniform(2);
        for _ in 0..100 {
            let start = rows::<1>(&mut uniform)[0];
            let mut triangle =
                Small::from_diagonal(start.as_slice(), &[0.0, 0.0, 0.0, 0.0, start[4]]);
            for _ in 0..20 {
                let before = full(&triangle).diagonal();
                triangle.absorb(&mut by_columns(&rows::<3>(&mut uniform)));
                let after = full(&triangle).diagonal();
                for (before, after) in before.iter().zip(after.iter()) {
                    assert!(before * after > 0.0 && after.abs() >= before.abs());
                }
            }
        }
    }

    /// Numbers whose squares underflow are skipped as zeros are, not divided by.
    #[test]
    fn what_cannot_be_squared_changes_no_bit() {
        let mut filled = Small::zero();
        filled.absorb(&mut by_columns(&rows::<7>(&mut fixtures::uniform(3))));
        for (before, entry) in [(filled, 0.0), (Small::zero(), 1e-160)] {
            let mut triangle = before.clone();
            triangle.absorb(&mut [[entry; 4]; 5]);
            assert_eq!(triangle, before);
        }
    }

    #[test]
    fn the_minimiser_solves_the_normal_equations() {
        let mut uniform = fixtures::uniform(5);
        for _ in 0..100 {
            let all = rows::<9>(&mut uniform);
            let mut triangle = Small::zero();
            triangle.absorb(&mut by_columns(&all));
            let gram = gram(&all);
            let matrix = gram.fixed_view::<4, 4>(0, 0).into_owned();
            let right = gram.fixed_view::<4, 1>(0, 4).into_owned();
            let inverse = matrix.try_inverse().unwrap();
            let expected = -(inverse * right);
            let found: [f64; 4] = triangle.minimiser(&[0.0; 4]).unwrap();
            // The normal equations square a condition number of up to some hundreds.
            assert!((SVector::from(found) - expected).norm() < 1e-8 * (1.0 + expected.norm()));

            let (step, gain) = triangle.step_against(right.into()).unwrap();
            assert!((SVector::from(step) - expected).norm() < 1e-8 * (1.0 + expected.norm()));
            assert!((gain + right.dot(&expected)).abs() < 1e-8 * (1.0 + gain));

            // Products with the leading part and its transpose.
            let leading = full(&triangle).fixed_view::<4, 4>(0, 0).into_owned();
            let beside = full(&triangle).fixed_view::<4, 1>(0, 4).into_owned();
            let residual = SVector::from(triangle.leading_residual(&step));
            assert!((residual - (leading * SVector::from(step) + beside)).norm() < SAME);
            let back = SVector::from(triangle.leading_transposed(&residual.into()));
            assert!((back - leading.transpose() * residual).norm() < SAME);

            // The inverse's last columns, two at a time, for every leading part.
            for length in 1..=5 {
                let mut columns = [[0.0; 2]; 5];
                super::inverse_columns(&triangle.entries, 5, &mut columns[..length]);
                for place in 0..2_usize.min(length) {
                    let column = columns.map(|entries| entries[1 - place]);
                    let product = full(&triangle) * SVector::from(column);
                    for (row, value) in product.iter().enumerate().take(length) {
                        let expected = if row + 1 + place == length { 1.0 } else { 0.0 };
                        assert!((value - expected).abs() < 1e-11);
                    }
                }
            }
        }
    }

    #[test]
    fn a_pivot_that_is_not_greater_than_the_smallest_determines_nothing() {
        let diagonal =
            Small::from_diagonal(&[1.0, -2.0, 3.0, 4.0, 5.0], &[3.0, 8.0, 6.0, 4.0, 5.0]);
        let minimiser = |smallest: &[f64; 4]| diagonal.minimiser(smallest);
        assert_eq!(minimiser(&[0.0; 4]), Some([-3.0, 4.0, -2.0, -1.0]));
        assert_eq!(
            minimiser(&[0.9, 1.9, 2.9, 3.9]),
            Some([-3.0, 4.0, -2.0, -1.0])
        );
        assert_eq!(minimiser(&[0.0, 2.0, 0.0, 0.0]), None);
        assert_eq!(minimiser(&[0.0, 0.0, 0.0, 4.1]), None);
        assert_eq!(minimiser(&[f64::NAN, 0.0, 0.0, 0.0]), None);
        assert_eq!(Small::zero().minimiser(&[0.0; 4]), None);
    }

    /// For parameters p₁ … pₖ with pₖ = 1, the others are such that the rows above the last yield zero.
    #[test]
    fn a_completed_column_leaves_nothing_in_the_rows_above_its_last_entry() {
        let mut uniform = fixtures::uniform(6);
        for length in 1..=5 {
            let mut triangle = Small::zero();
            triangle.absorb(&mut by_columns(&rows::<9>(&mut uniform)));
            let mut column = [0.0; 5];
            column[length - 1] = 1.0;
            triangle.complete_column(&mut column[..length]);
            assert!((column[length - 1] - 1.0).abs() < f64::MIN_POSITIVE);
            let product = full(&triangle) * SVector::from(column);
            assert!(product.rows(0, length - 1).amax() < SAME);
        }
    }
}
