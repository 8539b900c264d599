//! The rows of a campaign: one robot calibrated with one set of settings.

use super::evaluation::bound;
use super::plan::{Case, Plan};
use super::simulated::{Planned, measured_at, simulate};
use super::trial::{ACCEPTED, NO_ROBOT, calibrate};
use crate::accuracy::information::differences;
use crate::accuracy::position_error::position_errors;
use crate::cores;
use crate::files::{InputError, Tool};
use crate::halt;
use csv::ReaderBuilder;
use delta_cal::Robot;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::ops::Range;
use std::time::Instant;

/// Robots per thread between progress reports.
const ROBOTS_A_THREAD: u64 = 64;
/// Without noise, the true robot is recovered if the parameter error is below this, mm.
const EXACT: f64 = 1e-6;
/// With noise, the true robot is recovered if the parameter error is below this multiple of the bound.
const RETURNED: f64 = 5.0;

/// The result for one robot in one case; `None` where a figure does not exist. Errors are in millimetres: parameter
/// errors are √ Σ error² with angles times the upper arm's length, position errors are rms over the held-out poses.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RobotResult {
    /// Index of the robot, from 0.
    pub robot: u64,
    /// Seed of its random numbers.
    pub seed: u64,
    /// `accepted`, or the reason for refusal.
    pub status: String,
    /// Whether the true robot was recovered: to rounding without noise, within five times the bound with it.
    pub returned: Option<bool>,
    /// Whether the nominal robot sufficed as starting point.
    pub from_nominal: Option<bool>,
    /// Gain (4.1) of the parameters.
    pub gain_percent: Option<f64>,
    /// Parameter error before calibration.
    pub parameter_before_mm: Option<f64>,
    /// Parameter error after calibration.
    pub parameter_after_mm: Option<f64>,
    /// σ of the parameter error as stated by the calibration.
    pub parameter_stated_mm: Option<f64>,
    /// Lower bound on σ of the parameter error (Cramér–Rao).
    pub parameter_bound_mm: Option<f64>,
    /// Position error before calibration; infinite if the robot reaches none of the poses.
    pub error_before_mm: Option<f64>,
    /// Position error after calibration.
    pub error_after_mm: Option<f64>,
    /// σ of the position error as stated by the calibration.
    pub error_stated_mm: Option<f64>,
    /// Relative position error (after the best rigid motion) before calibration.
    pub relative_before_mm: Option<f64>,
    /// Relative position error after calibration.
    pub relative_after_mm: Option<f64>,
    /// σ of the relative position error as stated by the calibration.
    pub relative_stated_mm: Option<f64>,
    /// Wall-clock time of the calibration, `None` in a browser; not written to the file, whose contents are reproducible.
    #[serde(skip)]
    pub seconds: Option<f64>,
}

impl RobotResult {
    /// Whether the calibration was accepted.
    pub fn is_accepted(&self) -> bool {
        self.status == ACCEPTED
    }
}

/// A case and the result for one robot.
pub type Row = (Case, RobotResult);

/// Simulates and calibrates the given robots of each case. `progress` receives the number of finished robots and the
/// total.
///
/// A robot's random numbers depend only on the campaign's seed, the geometry, the case's values and the robot's index:
/// rows are bit-identical for any number of threads and any range.
///
/// # Errors
/// Planned poses were requested and cannot be found.
pub fn run(
    plan: &Plan,
    robots: &Range<u64>,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<Row>, InputError> {
    let each = robots.end.saturating_sub(robots.start);
    let total = each * plan.scenarios.len() as u64;
    let batch = ROBOTS_A_THREAD * cores::count() as u64;
    let mut rows = Vec::new();
    let mut finished = 0;
    progress(finished, total);
    for cases in &plan.scenarios {
        let planned = measured_at(plan, &cases[0])?;
        let mut first = robots.start;
        while first < robots.end {
            let next = robots.end.min(first + batch);
            let found = cores::map(first..next, |robot| of_robot(plan, cases, &planned, robot));
            rows.extend(found.into_iter().flatten());
            finished += next - first;
            first = next;
            progress(finished, total);
        }
    }
    Ok(rows)
}

/// One row for each of the cases that share their robots.
fn of_robot(plan: &Plan, cases: &[Case], planned: &Planned, robot: u64) -> Vec<Row> {
    halt::check();
    let seed = plan.seed_of(&cases[0], robot);
    let nominal = &plan.robot.robot;
    let none = RobotResult {
        robot,
        seed,
        status: NO_ROBOT.to_owned(),
        ..RobotResult::default()
    };
    let Some(simulated) = simulate(plan, &cases[0], planned, seed) else {
        let cases = cases.iter();
        return cases.map(|case| (case.clone(), none.clone())).collect();
    };
    let truth = &simulated.truth;
    let errors = |robot: &Robot<f64>, tool: &Tool| {
        let (own, true_one) = ((robot, tool), (truth, &simulated.tool));
        let positions = position_errors(own, true_one, simulated.held_out.iter().copied());
        (differences(robot, truth).norm(), positions.map(Some))
    };
    let (before, [error_before_mm, relative_before_mm]) = errors(nominal, &plan.tool());
    // Bounds do not depend on the solver or the weights.
    let mut bounds = HashMap::new();
    let result = |case: &Case| {
        let known = bounds.entry((case.method, case.prior));
        let parameter_bound_mm = *known.or_insert_with(|| {
            if plan.robot.parallelograms.is_some() {
                return None;
            }
            let tolerance = case.tolerance(&plan.robot).filter(|_| case.prior);
            let measured = &simulated.measured;
            bound(
                case.method,
                truth,
                measured,
                &case.noise()?,
                tolerance.as_ref(),
            )
        });
        let begin = (!cfg!(target_family = "wasm")).then(Instant::now);
        let calibrated = calibrate(&plan.robot, case, &simulated.samples, &simulated.turns);
        let row = RobotResult {
            seconds: begin.map(|begin| begin.elapsed().as_secs_f64()),
            parameter_before_mm: Some(before),
            parameter_bound_mm,
            error_before_mm,
            relative_before_mm,
            ..none.clone()
        };
        let calibrated = match calibrated {
            Ok(calibrated) => calibrated,
            Err(status) => {
                let status = status.to_owned();
                return RobotResult { status, ..row };
            }
        };
        let (error, [error_after_mm, relative_after_mm]) =
            errors(&calibrated.robot, &calibrated.tool);
        let [parameter_stated_mm, error_stated_mm, relative_stated_mm] =
            calibrated.stated(&simulated.held_out);
        let largest = match case.noise() {
            None => Some(EXACT),
            Some(_) => parameter_bound_mm.map(|bound| RETURNED * bound),
        };
        RobotResult {
            status: ACCEPTED.to_owned(),
            returned: largest.map(|largest| error <= largest),
            from_nominal: Some(calibrated.from_nominal),
            gain_percent: Some(100.0 * ((before - error) / before)),
            parameter_after_mm: Some(error),
            parameter_stated_mm,
            error_after_mm,
            error_stated_mm,
            relative_after_mm,
            relative_stated_mm,
            ..row
        }
    };
    let results: Vec<_> = cases.iter().map(result).collect();
    cases.iter().cloned().zip(results).collect()
}

/// Rows as a CSV file.
///
/// # Errors
/// None in practice: the table is written to memory.
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

/// Reads rows written by [`rows_csv`].
///
/// # Errors
/// A different header, or a damaged row, with its line.
pub fn read_rows(name: &str, text: &str) -> Result<Vec<Row>, InputError> {
    let fault = |error: csv::Error| {
        let line = error.position().map_or(1, csv::Position::line);
        InputError::new(name, error.to_string()).at_line(line)
    };
    let header = rows_csv(&[Row::default()]).map_err(fault)?;
    if text.lines().next() != header.lines().next() {
        let cause = "the header is not that of campaign rows";
        let remedy = "name files written by `delta-cal simulate --output` of this version";
        return Err(InputError::new(name, cause).at_line(1).with_remedy(remedy));
    }
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .from_reader(text.as_bytes());
    // Deserialised by position: a struct nested in a row has no header of its own.
    let rows = reader.records().skip(1);
    rows.map(|record| record?.deserialize::<Row>(None))
        .collect::<Result<_, _>>()
        .map_err(fault)
}
