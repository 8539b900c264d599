//! Householder reflections of a triangle with a block of rows.

use crate::Real;

/// Householder reflections of the leading columns of a triangle of `size` columns with a block of rows.
#[allow(clippy::inline_always)] // the sizes of each caller are constants that unroll it
#[inline(always)]
pub(super) fn reduce<T: Real, const K: usize>(
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
