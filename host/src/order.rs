//! Sorting by numbers, with one instance of a sort for all types, and choosing by size.

/// Ascending.
pub(crate) fn sort(values: &mut [f64]) {
    values.sort_unstable_by(f64::total_cmp);
}

/// By a number of each, the smallest first; what is equal stays in its order.
pub(crate) fn sort_by<T>(values: &mut Vec<T>, key: impl Fn(&T) -> f64) {
    let order = ordered(values.iter().map(key).zip(0..).collect());
    let mut places: Vec<_> = values.drain(..).map(Some).collect();
    let sorted = order
        .into_iter()
        .filter_map(|(_, place)| places.get_mut(place)?.take());
    values.extend(sorted);
}

fn ordered(mut keys: Vec<(f64, usize)>) -> Vec<(f64, usize)> {
    keys.sort_unstable_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
    keys
}

/// With more rows than this, reports for programs show a selection:
pub(crate) const MANY: usize = 10_000;
/// this many, spread evenly over the file,
const EVENLY: usize = 1_500;
/// and this many with the largest errors.
const FARTHEST: usize = 500;

/// The indices of the rows shown, in order; if there are more than `most`, those spread evenly and those of the largest
/// size.
pub(crate) fn shown(rows: usize, most: usize, size: impl Fn(usize) -> f64) -> Vec<usize> {
    let mut farthest: Vec<_> = (0..rows).collect();
    if rows <= most {
        return farthest;
    }
    farthest.select_nth_unstable_by(FARTHEST, |a, b| size(*b).total_cmp(&size(*a)));
    farthest.truncate(FARTHEST);
    let mut shown: Vec<_> = (0..EVENLY).map(|index| index * rows / EVENLY).collect();
    shown.extend(farthest);
    shown.sort_unstable();
    shown.dedup();
    shown
}

#[cfg(test)]
mod tests {
    use super::{EVENLY, FARTHEST, shown};

    #[test]
    fn many_rows_are_shown_by_some_spread_evenly_and_the_farthest_off() {
        let size = |row: usize| if row >= 19_600 { 1.0 } else { 0.0 };
        assert_eq!(shown(20_000, 20_000, size).len(), 20_000);
        let shown = shown(20_001, 20_000, size);
        // 401 rows are far off; the other 99 of the 500 are arbitrary.
        assert!((19_600..20_001).all(|row| shown.contains(&row)));
        assert!(shown.is_sorted_by(|a, b| a < b));
        assert!(shown.len() <= EVENLY + FARTHEST && shown.len() > EVENLY);
        let gaps = shown.windows(2).map(|pair| pair[1] - pair[0]);
        assert_eq!(gaps.max(), Some(14));
    }
}
