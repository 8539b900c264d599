//! Sorting by numbers, with one instance of a sort for all types.

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
