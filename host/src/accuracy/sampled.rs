//! Some rows of many: what reports show where nobody would read all.

/// Of more rows reports for programs show some…
pub const MANY: usize = 10_000;
/// …and pages of more than these, which have them in figures as well.
pub const MANY_ON_A_PAGE: usize = 2_500;
/// So many spread evenly over the file…
const EVENLY: usize = 1_500;
/// …and so many that are farthest off.
const FARTHEST: usize = 500;
/// The bars of a histogram.
const BARS: usize = 40;

/// How many values there are of each size.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// The width of a bar; the first begins at 0.
    pub width: f64,
    /// The values in each bar.
    pub counts: Vec<u64>,
    /// The values beyond the last bar, and those that are not known.
    pub beyond: u64,
}

/// If there are more rows than `most`: the rows that are shown, in their order. They are spread evenly,
/// or among those of the largest size.
pub fn shown(rows: usize, most: usize, size: impl Fn(usize) -> f64) -> Option<Vec<usize>> {
    if rows <= most {
        return None;
    }
    let mut farthest: Vec<_> = (0..rows).collect();
    farthest.select_nth_unstable_by(FARTHEST, |a, b| size(*b).total_cmp(&size(*a)));
    farthest.truncate(FARTHEST);
    let mut shown: Vec<_> = (0..EVENLY).map(|index| index * rows / EVENLY).collect();
    shown.extend(farthest);
    shown.sort_unstable();
    shown.dedup();
    Some(shown)
}

/// Some of many, spread evenly.
pub(crate) fn evenly<T: Copy>(all: &[T]) -> Vec<T> {
    let step = all.len().div_ceil(EVENLY).max(1);
    all.iter().copied().step_by(step).collect()
}

/// Which rows of `rows` are shown, in words.
pub fn in_words(shown: usize, rows: usize) -> String {
    format!("{shown} of {rows} samples: those farthest off, and others spread evenly over the file")
}

/// Those of the largest size among values that come one after the other.
#[derive(Debug)]
pub(crate) struct Farthest<T>(Vec<(f64, T)>);

impl<T> Default for Farthest<T> {
    fn default() -> Self {
        Self(Vec::with_capacity(2 * FARTHEST))
    }
}

impl<T> Farthest<T> {
    pub(crate) fn add(&mut self, value: T, size: f64) {
        if self.0.len() == 2 * FARTHEST {
            self.keep();
        }
        self.0.push((size, value));
    }

    fn keep(&mut self) {
        if self.0.len() > FARTHEST {
            self.0
                .select_nth_unstable_by(FARTHEST, |a, b| b.0.total_cmp(&a.0));
            self.0.truncate(FARTHEST);
        }
    }

    pub(crate) fn finish(mut self) -> impl Iterator<Item = T> {
        self.keep();
        self.0.into_iter().map(|(_, value)| value)
    }
}

impl Histogram {
    /// Of values; the bars reach to twice what 19 of 20 of them are below.
    pub(crate) fn of(values: impl Iterator<Item = Option<f64>> + Clone) -> Self {
        let mut histogram = Self::for_values(values.clone());
        for value in values {
            histogram.add(value);
        }
        histogram
    }

    /// Without a value yet, with bars for such values.
    #[allow(clippy::cast_precision_loss)] // the number of bars
    pub(crate) fn for_values(values: impl Iterator<Item = Option<f64>>) -> Self {
        let mut known: Vec<_> = values.flatten().collect();
        let most = known.len().saturating_sub(1) * 19 / 20;
        let reach = if known.is_empty() {
            0.0
        } else {
            2.0 * *known.select_nth_unstable_by(most, f64::total_cmp).1
        };
        let width = if reach > 0.0 {
            reach / BARS as f64
        } else {
            1.0
        };
        Self {
            width,
            counts: vec![0; BARS],
            beyond: 0,
        }
    }

    /// Counts a value.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // the number of a bar
    pub(crate) fn add(&mut self, value: Option<f64>) {
        let bar = value.and_then(|value| self.counts.get_mut((value / self.width) as usize));
        *bar.unwrap_or(&mut self.beyond) += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::{EVENLY, FARTHEST, Histogram, shown};

    #[test]
    fn many_rows_are_shown_by_some_spread_evenly_and_the_farthest_off() {
        let size = |row: usize| if row >= 19_600 { 1.0 } else { 0.0 };
        assert_eq!(shown(20_000, 20_000, size), None);
        let shown = shown(20_001, 20_000, size).unwrap_or_default();
        // 401 rows are far off; the other 99 of the farthest are any.
        assert!((19_600..20_001).all(|row| shown.contains(&row)));
        assert!(shown.is_sorted_by(|a, b| a < b));
        assert!(shown.len() <= EVENLY + FARTHEST && shown.len() > EVENLY);
        let gaps = shown.windows(2).map(|pair| pair[1] - pair[0]);
        assert_eq!(gaps.max(), Some(14));
    }

    #[test]
    fn a_histogram_counts_every_value() {
        // 19 of 20 are up to 1, so that 40 bars of 0.05 reach to 2.
        let values = [0.01, 0.06, 0.07, 1.0, 1.0];
        let values = values
            .into_iter()
            .cycle()
            .take(95)
            .chain([1.99, 2.5, 3.0, 9.0]);
        let found = Histogram::of(values.clone().map(Some).chain([None]));
        assert!((found.width - 0.05).abs() < 1e-15);
        assert_eq!(found.counts[..3], [19, 38, 0]);
        assert_eq!(found.counts[19] + found.counts[20], 38);
        assert_eq!(found.counts[39], 1);
        assert_eq!((found.counts.len(), found.beyond), (40, 4));
        assert_eq!(Histogram::of([None; 3].into_iter()).beyond, 3);
    }
}
