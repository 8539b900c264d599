//! The rows of a campaign: one robot, calibrated one way.

use super::plan::{Case, Plan, Scenario};
use super::simulated::{Planned, measured_at, simulate};
use super::trial::{ACCEPTED, NO_ROBOT, bound, calibrate};
use crate::accuracy::evaluation::{Evaluation, HeldOutError};
use crate::files::input::InputError;
use crate::fit::Method;
use csv::ReaderBuilder;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::time::Instant;

/// Robots a thread between two signs of progress.
const ROBOTS_A_THREAD: u64 = 64;
/// Without noise, a robot is the true one if its parameter error is below this, mm.
const EXACT: f64 = 1e-6;
/// With noise, a robot is the true one if its parameter error is below this many times the bound.
const RETURNED: f64 = 5.0;

/// What came of one robot in one case. Empty where there is nothing to state. Lengths are in
/// millimetres; of parameters √ Σ error², angles times the upper arm's length, and of positions
/// rms over the held-out poses.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RobotResult {
    /// Counted from 0.
    pub robot: u64,
    /// Of its random numbers.
    pub seed: u64,
    /// `accepted`, or why it was refused.
    pub status: String,
    /// Whether the calibrated robot is the true one: to the arithmetic's accuracy without noise,
    /// within five times the bound with it.
    pub returned: Option<bool>,
    /// Whether no other start than the nominal robot was needed.
    pub from_nominal: Option<bool>,
    /// (4.1), of the parameters.
    pub gain_percent: Option<f64>,
    /// Of the parameters, before.
    pub parameter_before_mm: Option<f64>,
    /// The same after.
    pub parameter_after_mm: Option<f64>,
    /// What the calibration states of it, one σ.
    pub parameter_stated_mm: Option<f64>,
    /// The least that it can be (Cramér–Rao), one σ.
    pub parameter_bound_mm: Option<f64>,
    /// Of positions, before; infinite where the robot's geometry reaches no pose.
    pub error_before_mm: Option<f64>,
    /// The same after.
    pub error_after_mm: Option<f64>,
    /// What the calibration states of it, one σ.
    pub error_stated_mm: Option<f64>,
    /// Of positions after the best rigid motion, before.
    pub relative_before_mm: Option<f64>,
    /// The same after.
    pub relative_after_mm: Option<f64>,
    /// What the calibration states of it, one σ.
    pub relative_stated_mm: Option<f64>,
    /// Wall clock of the calibration; not among the columns, which are the same in every run.
    #[serde(skip)]
    pub seconds: Option<f64>,
}

impl RobotResult {
    /// Whether there was a robot to calibrate.
    pub fn is_simulated(&self) -> bool {
        self.status != NO_ROBOT
    }

    /// Whether it was calibrated and not refused.
    pub fn is_accepted(&self) -> bool {
        self.status == ACCEPTED
    }
}

/// A case and what came of one robot in it.
pub type Row = (Case, RobotResult);

/// Simulates these robots of each case and calibrates them. `progress` is told how many robots are
/// finished, of how many.
///
/// A robot's random numbers depend on the campaign's seed, the geometry, the case's values and the
/// robot's number alone: rows are the same to the bit for any number of threads and in any range.
///
/// # Errors
/// Poses that cannot be planned.
pub fn run(
    plan: &Plan,
    robots: &Range<u64>,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<Row>, InputError> {
    let each = robots.end.saturating_sub(robots.start);
    let total = each * plan.scenarios.len() as u64;
    let batch = ROBOTS_A_THREAD * rayon::current_num_threads() as u64;
    let mut rows = Vec::new();
    let mut finished = 0;
    progress(finished, total);
    for scenario in &plan.scenarios {
        let planned = measured_at(plan, scenario)?;
        let mut first = robots.start;
        while first < robots.end {
            let next = robots.end.min(first + batch);
            let found: Vec<_> = (first..next)
                .into_par_iter()
                .map(|robot| of_robot(plan, scenario, &planned, robot))
                .collect();
            rows.extend(found.into_iter().flatten());
            finished += next - first;
            first = next;
            progress(finished, total);
        }
    }
    Ok(rows)
}

/// One row for each case of a scenario.
fn of_robot(plan: &Plan, scenario: &Scenario, planned: &Planned, robot: u64) -> Vec<Row> {
    let seed = plan.seed_of(scenario, robot);
    let nominal = &plan.robot.robot;
    let Some(simulated) = simulate(plan, scenario, planned, seed) else {
        let none = RobotResult {
            robot,
            seed,
            status: NO_ROBOT.to_owned(),
            ..RobotResult::default()
        };
        let cases = scenario.cases.iter();
        return cases.map(|case| (case.clone(), none.clone())).collect();
    };
    let before = Evaluation {
        truth: &simulated.truth,
        before: nominal,
        after: nominal,
    };
    let [error_before_mm, relative_before_mm] =
        errors(&before.position_error_before(&simulated.held_out));
    // They depend on neither solver nor weights.
    let mut bounds: Vec<(Method, bool, Option<f64>)> = Vec::new();
    let result = |case: &Case| {
        let mut row = RobotResult {
            robot,
            seed,
            parameter_before_mm: Some(before.error_before()),
            error_before_mm,
            relative_before_mm,
            ..RobotResult::default()
        };
        let known = bounds
            .iter()
            .find(|(method, prior, _)| (*method, *prior) == (case.method, case.prior));
        row.parameter_bound_mm = if let Some((.., bound)) = known {
            *bound
        } else {
            let bound = bound(scenario, case, &simulated);
            bounds.push((case.method, case.prior, bound));
            bound
        };
        let begin = Instant::now();
        let calibrated = calibrate(plan, scenario, case, &simulated.samples);
        row.seconds = Some(begin.elapsed().as_secs_f64());
        let calibrated = match calibrated {
            Ok(calibrated) => calibrated,
            Err(status) => {
                status.clone_into(&mut row.status);
                return row;
            }
        };
        let evaluation = Evaluation {
            after: &calibrated.robot,
            ..before
        };
        let error = evaluation.error_after();
        let [error_after_mm, relative_after_mm] =
            errors(&evaluation.position_error_after(&simulated.held_out));
        let [parameter_stated_mm, error_stated_mm, relative_stated_mm] =
            calibrated.stated(&simulated.held_out);
        let largest = match scenario.noise {
            None => Some(EXACT),
            Some(_) => row.parameter_bound_mm.map(|bound| RETURNED * bound),
        };
        RobotResult {
            status: ACCEPTED.to_owned(),
            returned: largest.map(|largest| error <= largest),
            from_nominal: Some(calibrated.from_nominal),
            gain_percent: Some(evaluation.gain()),
            parameter_after_mm: Some(error),
            parameter_stated_mm,
            error_after_mm,
            error_stated_mm,
            relative_after_mm,
            relative_stated_mm,
            ..row
        }
    };
    let results: Vec<_> = scenario.cases.iter().map(result).collect();
    scenario.cases.iter().cloned().zip(results).collect()
}

/// Absolute and relative. A robot that reaches none of the poses has an error all the same.
fn errors(error: &HeldOutError) -> [Option<f64>; 2] {
    let known = |value: f64| Some(if value.is_nan() { f64::INFINITY } else { value });
    [known(error.rms), known(error.intrinsic_rms)]
}

/// Rows as a CSV file.
///
/// # Errors
/// None is known: the table is written to memory.
pub fn rows_csv(rows: &[Row]) -> Result<String, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    text(writer)
}

pub(super) fn text(writer: csv::Writer<Vec<u8>>) -> Result<String, csv::Error> {
    let bytes = writer
        .into_inner()
        .map_err(csv::IntoInnerError::into_error)?;
    String::from_utf8(bytes).map_err(|error| std::io::Error::other(error).into())
}

/// Rows of a CSV file that [`rows_csv`] has made.
///
/// # Errors
/// Another file, or a row that is damaged, with its line.
pub fn read_rows(name: &str, text: &str) -> Result<Vec<Row>, InputError> {
    let fault = |error: csv::Error| {
        let line = error.position().map_or(1, csv::Position::line);
        InputError::new(name, error.to_string()).at_line(line)
    };
    let header = rows_csv(&[Row::default()]).map_err(fault)?;
    if text.lines().next() != header.lines().next() {
        let cause = "the header is not that of the rows of a campaign";
        let remedy = "name files that `delta-cal simulate --output` of this version has written";
        return Err(InputError::new(name, cause).at_line(1).with_remedy(remedy));
    }
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .from_reader(text.as_bytes());
    // By their places: a struct within a row has no header of its own.
    let rows = reader.records().skip(1);
    rows.map(|record| record?.deserialize::<Row>(None))
        .collect::<Result<_, _>>()
        .map_err(fault)
}
