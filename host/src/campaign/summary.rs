//! What came of each case: how many robots were refused or became worse, and the errors of all.

use super::plan::Case;
use super::row::{RobotResult, Row};
use crate::files::input::InputError;
use serde::Serialize;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Mean and quantiles, linear between the two nearest values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Distribution {
    /// The mean.
    pub mean: f64,
    /// At 5 %.
    pub p05: f64,
    /// At 50 %.
    pub median: f64,
    /// At 95 %.
    pub p95: f64,
}

impl Distribution {
    /// `None` if there are no values.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let at = |percent: usize| {
            let (index, rest) = (percent * last / 100, percent * last % 100);
            let low = values[index];
            let high = values[last.min(index + 1)];
            // An infinite neighbour of no weight does not count.
            if rest == 0 {
                low
            } else {
                low + (high - low) * number(rest) / 100.0
            }
        };
        Some(Self {
            mean: values.iter().sum::<f64>() / number(values.len()),
            p05: at(5),
            median: at(50),
            p95: at(95),
        })
    }
}

/// √(Σ error² / Σ σ²) over the accepted robots: 1 where σ is right.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ratios {
    /// Of the parameters, over the Cramér–Rao bound.
    pub error_to_bound: Option<f64>,
    /// Of the parameters, over the stated σ.
    pub parameters_to_stated: Option<f64>,
    /// Of positions, over the stated σ.
    pub error_to_stated: Option<f64>,
    /// Of positions after the best rigid motion, over the stated σ.
    pub relative_to_stated: Option<f64>,
}

/// What came of one case. Means and quantiles are over all simulated robots; one that was refused
/// keeps the error that it had, and its gain is 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseSummary {
    /// Which case.
    #[serde(flatten)]
    pub case: Case,
    /// Simulated robots.
    pub robots: usize,
    /// Start errors that make no robot, or one that cannot be measured; not among the robots.
    pub no_robot: usize,
    /// Robots that were calibrated, not refused.
    pub accepted: usize,
    /// Those of them whose position error is larger than before.
    pub worse: usize,
    /// Robots whose true parameters were found: to the arithmetic's accuracy without noise, within
    /// five times the Cramér–Rao bound with it.
    pub returned: usize,
    /// Those of them for which no other start than the nominal robot was needed.
    pub returned_from_nominal: usize,
    /// Why robots were refused, and how many for each reason.
    pub refused: BTreeMap<String, usize>,
    /// Gain (4.1), percent.
    pub gain_percent: Option<Distribution>,
    /// Parameter error before, mm.
    pub parameter_before_mm: Option<Distribution>,
    /// The same after.
    pub parameter_after_mm: Option<Distribution>,
    /// Position error over the held-out poses before, mm.
    pub error_before_mm: Option<Distribution>,
    /// The same after.
    pub error_after_mm: Option<Distribution>,
    /// Position error after the best rigid motion before, mm.
    pub relative_before_mm: Option<Distribution>,
    /// The same after.
    pub relative_after_mm: Option<Distribution>,
    /// Of the accepted robots.
    pub ratios: Ratios,
    /// Wall clock of one calibration; not known of rows from a file.
    pub seconds_per_calibration: Option<f64>,
}

impl CaseSummary {
    /// How many of the robots, percent.
    pub fn percent(&self, count: usize) -> f64 {
        100.0 * number(count) / number(self.robots)
    }

    fn of(case: &Case, rows: &[&RobotResult]) -> Self {
        let robots: Vec<_> = rows
            .iter()
            .copied()
            .filter(|row| row.is_simulated())
            .collect();
        let (accepted, others): (Vec<_>, Vec<_>) =
            robots.iter().copied().partition(|row| row.is_accepted());
        let mut refused = BTreeMap::new();
        for row in others {
            *refused.entry(row.status.clone()).or_default() += 1;
        }
        let count =
            |of: &dyn Fn(&RobotResult) -> bool| accepted.iter().filter(|row| of(row)).count();
        // Refused robots stay as they were.
        let over = |of: &dyn Fn(&RobotResult) -> [Option<f64>; 2]| {
            let values = robots.iter().filter_map(|row| {
                let [before, after] = of(row);
                if row.is_accepted() { after } else { before }
            });
            Distribution::of(values.collect())
        };
        let all = |of: &dyn Fn(&RobotResult) -> Option<f64>| {
            Distribution::of(robots.iter().filter_map(|row| of(row)).collect())
        };
        let ratio = |of: &dyn Fn(&RobotResult) -> [Option<f64>; 2]| {
            let pairs = accepted.iter().filter_map(|row| match of(row) {
                [Some(error), Some(sigma)] => Some((error * error, sigma * sigma)),
                _ => None,
            });
            let (errors, sigmas) =
                pairs.fold((0.0, 0.0), |sum, own| (sum.0 + own.0, sum.1 + own.1));
            (sigmas > 0.0).then(|| (errors / sigmas).sqrt())
        };
        let seconds = rows.iter().filter_map(|row| row.seconds).collect();
        Self {
            case: case.clone(),
            robots: robots.len(),
            no_robot: rows.len() - robots.len(),
            accepted: accepted.len(),
            worse: count(&|row| row.error_after_mm > row.error_before_mm),
            returned: count(&|row| row.returned == Some(true)),
            returned_from_nominal: count(&|row| {
                row.returned == Some(true) && row.from_nominal == Some(true)
            }),
            refused,
            gain_percent: over(&|row| [Some(0.0), row.gain_percent]),
            parameter_before_mm: all(&|row| row.parameter_before_mm),
            parameter_after_mm: over(&|row| [row.parameter_before_mm, row.parameter_after_mm]),
            error_before_mm: all(&|row| row.error_before_mm),
            error_after_mm: over(&|row| [row.error_before_mm, row.error_after_mm]),
            relative_before_mm: all(&|row| row.relative_before_mm),
            relative_after_mm: over(&|row| [row.relative_before_mm, row.relative_after_mm]),
            ratios: Ratios {
                error_to_bound: ratio(&|row| [row.parameter_after_mm, row.parameter_bound_mm]),
                parameters_to_stated: ratio(&|row| {
                    [row.parameter_after_mm, row.parameter_stated_mm]
                }),
                error_to_stated: ratio(&|row| [row.error_after_mm, row.error_stated_mm]),
                relative_to_stated: ratio(&|row| [row.relative_after_mm, row.relative_stated_mm]),
            },
            seconds_per_calibration: Distribution::of(seconds).map(|own| own.mean),
        }
    }
}

const fn number(count: usize) -> f64 {
    count as f64
}

/// The cases of rows, in the order in which they occur.
pub fn summarize(rows: &[Row]) -> Vec<CaseSummary> {
    let mut places: HashMap<String, usize> = HashMap::new();
    let mut cases: Vec<(&Case, Vec<&RobotResult>)> = Vec::new();
    for (case, result) in rows {
        let place = *places.entry(format!("{case:?}")).or_insert(cases.len());
        if place == cases.len() {
            cases.push((case, Vec::new()));
        }
        cases[place].1.push(result);
    }
    let cases = cases.iter();
    cases
        .map(|(case, results)| CaseSummary::of(case, results))
        .collect()
}

/// Joins the rows of several files, each with its name.
///
/// # Errors
/// A robot that stands in them twice.
pub fn join(files: Vec<(String, Vec<Row>)>) -> Result<Vec<Row>, InputError> {
    let mut seen = HashSet::new();
    let mut all = Vec::new();
    for (name, rows) in files {
        for (line, (case, result)) in (2..).zip(&rows) {
            if !seen.insert((format!("{case:?}"), result.seed)) {
                let cause = format!("robot {} of this case was read before", result.robot);
                return Err(InputError::new(&name, cause)
                    .at_line(line)
                    .with_remedy("name each file once, and files of different robots"));
            }
        }
        all.extend(rows);
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::Distribution;

    /// numpy.quantile([1, 2, 4, 8, inf], [0.05, 0.5, 0.75]) is 1.2, 4, 8.
    #[test]
    fn quantiles_are_those_of_numpy() -> Result<(), &'static str> {
        let found = Distribution::of(vec![8.0, 1.0, f64::INFINITY, 4.0, 2.0]).ok_or("values")?;
        assert!((found.p05 - 1.2).abs() < 1e-15);
        assert!((found.median - 4.0).abs() < 1e-15);
        assert!(found.p95.is_infinite() && found.mean.is_infinite());
        let one = Distribution::of(vec![3.0]).ok_or("a value")?;
        assert_eq!(
            [one.mean, one.p05, one.p95].map(f64::to_bits),
            [3.0_f64; 3].map(f64::to_bits)
        );
        assert_eq!(Distribution::of(Vec::new()), None);
        Ok(())
    }
}
