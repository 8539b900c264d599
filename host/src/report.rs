//! Results for people and for programs.

pub mod calibration;
pub mod campaign;
pub mod document;
pub mod export;
pub mod plan;
pub mod printer;
pub mod validation;
pub mod workspace;

use serde::Serialize;

/// What reports for programs have in common, before their contents.
#[derive(Debug, Serialize)]
pub(crate) struct Versioned<T> {
    schema_version: u32,
    program_version: &'static str,
    #[serde(flatten)]
    contents: T,
}

impl<T: Serialize> Versioned<T> {
    pub(crate) const fn new(schema_version: u32, contents: T) -> Self {
        Self {
            schema_version,
            program_version: env!("CARGO_PKG_VERSION"),
            contents,
        }
    }
}

/// A report for programs: indented, ending in a new line.
pub fn json(report: &impl Serialize) -> String {
    let text = serde_json::to_string_pretty(report);
    // A report is a struct of numbers and texts, which always can be written.
    text.unwrap_or_default() + "\n"
}

/// Of more rows reports for programs show some…
pub const MANY: usize = 10_000;
/// …and pages of more than these, which have them in figures as well.
pub const MANY_ON_A_PAGE: usize = 2_500;
/// So many spread evenly over the file…
const EVENLY: usize = 1_500;
/// …and so many that are farthest off.
const FARTHEST: usize = 500;

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

#[cfg(test)]
mod tests {
    use super::{EVENLY, FARTHEST, shown};

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
}
