//! Summary of each case: how many robots were refused or became worse, and the errors of all.

use super::plan::Case;
use super::row::{RobotResult, Row};
use super::trial::NO_ROBOT;
use crate::files::InputError;
use crate::order;
use serde::Serialize;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Mean and quantiles, interpolated linearly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Distribution {
    /// Mean.
    pub mean: f64,
    /// 5 % quantile.
    pub p05: f64,
    /// Median.
    pub median: f64,
    /// 95 % quantile.
    pub p95: f64,
}

impl Distribution {
    /// `None` if there are no values.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        order::sort(&mut values);
        let last = values.len().checked_sub(1)?;
        let at = |percent: usize| {
            let (index, rest) = (percent * last / 100, percent * last % 100);
            let low = values[index];
            let high = values[last.min(index + 1)];
            // Skip the neighbour if its weight is 0: it may be infinite.
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

/// √(Σ error² / Σ σ²) over the accepted robots: 1 if σ is correct.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ratios {
    /// Parameter error over the Cramér–Rao bound.
    pub error_to_bound: Option<f64>,
    /// Parameter error over the stated σ.
    pub parameters_to_stated: Option<f64>,
    /// Position error over the stated σ.
    pub error_to_stated: Option<f64>,
    /// Relative position error over the stated σ.
    pub relative_to_stated: Option<f64>,
}

/// Summary of one case. Means and quantiles are over all simulated robots; a refused robot keeps its original error,
/// and its gain is 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseSummary {
    /// The case.
    #[serde(flatten)]
    pub case: Case,
    /// Number of simulated robots.
    pub robots: usize,
    /// Start errors that yield no valid robot or one that cannot be measured; not counted in `robots`.
    pub no_robot: usize,
    /// Number of accepted calibrations.
    pub accepted: usize,
    /// Accepted calibrations after which the position error is larger than before.
    pub worse: usize,
    /// Robots whose true parameters were recovered: to rounding without noise, within five times the Cramér–Rao bound
    /// with it.
    pub returned: usize,
    /// Recovered robots for which the nominal robot sufficed as starting point.
    pub returned_from_nominal: usize,
    /// Number of refused robots by reason.
    pub refused: BTreeMap<String, usize>,
    /// Gain (4.1), percent.
    pub gain_percent: Option<Distribution>,
    /// Parameter error before calibration, mm.
    pub parameter_before_mm: Option<Distribution>,
    /// Parameter error after calibration, mm.
    pub parameter_after_mm: Option<Distribution>,
    /// Position error over the held-out poses before calibration, mm.
    pub error_before_mm: Option<Distribution>,
    /// Position error after calibration, mm.
    pub error_after_mm: Option<Distribution>,
    /// Relative position error (after the best rigid motion) before calibration, mm.
    pub relative_before_mm: Option<Distribution>,
    /// Relative position error after calibration, mm.
    pub relative_after_mm: Option<Distribution>,
    /// Error over σ, for the accepted robots.
    pub ratios: Ratios,
    /// Mean wall-clock time of one calibration; `None` for rows read from a file.
    pub seconds_per_calibration: Option<f64>,
}

impl CaseSummary {
    /// A count as a percentage of the simulated robots.
    pub fn percent(&self, count: usize) -> f64 {
        100.0 * number(count) / number(self.robots)
    }

    fn of(case: &Case, rows: &[&RobotResult]) -> Self {
        let mut robots = rows.to_vec();
        robots.retain(|row| row.status != NO_ROBOT);
        let (accepted, others): (Vec<_>, Vec<_>) =
            robots.iter().copied().partition(|row| row.is_accepted());
        let mut refused = BTreeMap::new();
        for row in others {
            *refused.entry(row.status.clone()).or_default() += 1;
        }
        let count =
            |of: &dyn Fn(&RobotResult) -> bool| accepted.iter().filter(|row| of(row)).count();
        // Refused robots keep their original errors.
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

/// Summarises rows by case, in order of first occurrence.
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

/// Joins the rows of several files, given by name.
///
/// # Errors
/// A robot that occurs twice.
pub fn join(files: Vec<(String, Vec<Row>)>) -> Result<Vec<Row>, InputError> {
    let mut seen = HashSet::new();
    let mut all = Vec::new();
    for (name, rows) in files {
        for (line, (case, result)) in (2..).zip(&rows) {
            if !seen.insert((format!("{case:?}"), result.seed)) {
                let cause = format!("robot {} of this case is a duplicate", result.robot);
                return Err(InputError::new(&name, cause)
                    .at_line(line)
                    .with_remedy("name each file once, and only files with different robots"));
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
