//! Order statistics without moving or copying what is ordered.

use crate::Real;

/// The middle value, or the mean of the two; infinity of none.
pub(super) fn median<T: Real>(values: impl Iterator<Item = T> + Clone) -> T {
    let count = values.clone().count();
    let upper = of_rank(values.clone(), count / 2).unwrap_or(T::INFINITY);
    if count % 2 == 1 {
        upper
    } else {
        let lower = of_rank(values, (count / 2).saturating_sub(1)).unwrap_or(T::INFINITY);
        (lower + upper) * T::HALF
    }
}

/// The value with `rank` values below it, or as many equal ones; `None` if there are not so many.
/// NaN counts as the largest.
///
/// Quickselect (Hoare 1961) on an interval of values in place of an interval of places: each pass
/// counts what lies below the one in the middle of those still in question. About 2 ln n passes;
/// n at worst.
pub(super) fn of_rank<T: Real>(values: impl Iterator<Item = T> + Clone, rank: usize) -> Option<T> {
    let values = values.map(|value| {
        if value <= T::INFINITY {
            value
        } else {
            T::INFINITY
        }
    });
    let (mut above, mut below) = (None, None);
    let mut inside = values.clone().count();
    if rank >= inside {
        return None;
    }
    let mut left = rank;
    loop {
        let within = |value: &T| {
            above.is_none_or(|bound| *value > bound) && below.is_none_or(|bound| *value < bound)
        };
        let pivot = values.clone().filter(within).nth(inside / 2)?;
        let (mut smaller, mut equal) = (0, 0);
        for value in values.clone().filter(within) {
            smaller += usize::from(value < pivot);
            equal += usize::from(value == pivot);
        }
        if left < smaller {
            below = Some(pivot);
            inside = smaller;
        } else if left < smaller + equal {
            return Some(pivot);
        } else {
            above = Some(pivot);
            left -= smaller + equal;
            inside = inside.saturating_sub(smaller + equal);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{median, of_rank};

    #[test]
    fn every_rank_is_what_sorting_finds() {
        let mut state = 1_u32;
        for length in 1..60_u32 {
            let mut values = [0.0_f32; 60];
            let count = values.len().min(length as usize);
            for value in &mut values[..count] {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                // Coarse, so that some are equal.
                *value = f32::from((state >> 27) as u16) - 9.0;
            }
            let mut sorted = values;
            sorted[..count].sort_by(f32::total_cmp);
            for (rank, expected) in sorted[..count].iter().enumerate() {
                let found = of_rank(values[..count].iter().copied(), rank);
                assert_eq!(found, Some(*expected), "{length} values, rank {rank}");
            }
            assert_eq!(of_rank(values[..count].iter().copied(), count), None);
        }
    }

    #[test]
    fn the_median_of_an_even_number_is_between_the_two_in_the_middle() {
        let of = |values: &[f64]| median(values.iter().copied()).to_bits();
        assert_eq!(of(&[3.0, 1.0, 2.0]), 2.0_f64.to_bits());
        assert_eq!(of(&[4.0, 1.0, 3.0, 2.0]), 2.5_f64.to_bits());
        assert_eq!(of(&[]), f64::INFINITY.to_bits());
    }

    #[test]
    fn what_is_not_a_number_comes_last() {
        let values = [f64::NAN, 2.0, f64::INFINITY, 1.0];
        assert_eq!(of_rank(values.into_iter(), 1), Some(2.0));
        assert_eq!(of_rank(values.into_iter(), 3), Some(f64::INFINITY));
    }
}
