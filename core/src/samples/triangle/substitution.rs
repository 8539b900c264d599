//! Products and substitutions with an upper triangle, packed by rows.
//!
//! These functions are shared by triangles of all sizes: each size of its own would be unrolled into more flash than
//! its speed is worth. For the same reason one length is hidden from the optimiser.

use crate::Real;
use core::hint::black_box;

pub(super) fn packed_row<T>(entries: &[T], size: usize, row: usize) -> &[T] {
    let above = row.saturating_sub(1) * row / 2;
    let start = (row * size).saturating_sub(above);
    entries
        .get(start..)
        .and_then(|rest| rest.get(..size.saturating_sub(row)))
        .unwrap_or_default()
}

#[inline(never)]
pub(super) fn affine<T: Real>(entries: &[T], x: &[T], product: &mut [T]) {
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
pub(super) fn transposed<T: Real>(entries: &[T], v: &[T], product: &mut [T]) {
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
pub(super) fn column_norms<T: Real>(entries: &[T], norms: &mut [T]) {
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
pub(super) fn left_substitute<T: Real>(entries: &[T], size: usize, vector: &mut [T]) {
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
pub(super) fn back_substitute<T: Real>(entries: &[T], smallest: &[T], solution: &mut [T]) -> bool {
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
pub(super) fn inverse_columns<T: Real, const K: usize>(
    entries: &[T],
    size: usize,
    columns: &mut [[T; K]],
) {
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
pub(super) fn substitute<T: Real>(entries: &[T], size: usize, column: &mut [T]) {
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
