//! A step at one row: an encoder that jumped, or a sensor, a reflector or a plate that was moved.

use super::causes::explained_by;
use super::explanation::loosened;
use super::judge::{Case, is_understated};
use super::{Finding, warning};
use crate::files::samples_file::{Kind, Readings};
use crate::fit::{Options, Solution, solve};
use crate::text::{joint, significant};
use nalgebra::Vector3;
use serde_json::json;

/// Least number of rows on either side of a step.
const LEAST_ROWS: usize = 3;
/// Files with more rows are not searched.
const MOST_ROWS: usize = 2000;
/// With more rows than this, an even selection is tried first, then the rows around the best.
const PLACES: usize = 300;
/// Least increase of the log-likelihood: a chance of about 1 in 10,000 over all rows and kinds.
const CLEARLY: f64 = 12.0;
/// A moved sensor leaves less than this fraction of the residuals; a drift looks like a small step.
const NO_DRIFT: f64 = 0.5;
/// A step leaves at most this fraction of the residuals.
const LEFT: f64 = 0.85;

/// A step in the errors of a file.
pub(super) struct Step {
    /// Whether it explains more than a drift would: a step of the positions must leave little of the residuals.
    pub(super) is_no_drift: bool,
    pub(super) finding: Finding,
}

impl Step {
    /// `sigma`: σ of a coordinate with and without the step, mm.
    fn new(case: &Case<'_>, kind: Kind, found: &Found, sigma: [f64; 2]) -> Self {
        let convention = &case.robot.convention;
        let line = case.readings.rows[found.index].line;
        let [with, without] = sigma.map(|own| significant(own, 2));
        let (what, remedy, by) = if let Some(joint) = found.joint() {
            let by = convention.degrees(found.by[0]);
            let what = format!(
                "The joint zero of arm {} jumped by {}{} at line {line}",
                joint + 1,
                significant(by, 2),
                joint::mark(case.robot.robot.drive())
            );
            let remedy = "An encoder or a coupling slipped: fix it, home the robot and measure again, or calibrate only the rows before or after.";
            (what, remedy, by)
        } else if kind == Kind::Height {
            let off = found.position().norm();
            let what = format!("From line {line} on, all heights are off by {off:.2} mm");
            let remedy = "The plate, the probe or the robot's base was moved there: calibrate the rows before and after separately.";
            (what, remedy, 0.0)
        } else {
            let [x, y, z] = convention.vector(&found.position()).data.0[0];
            let what = format!(
                "From line {line} on, all positions are off by ({x:.2}, {y:.2}, {z:.2}) mm in the robot's axes"
            );
            let remedy = "The sensor, its reflector or the robot's base was moved there: calibrate the rows before and after separately.";
            (what, remedy, 0.0)
        };
        let figures = json!({
            "line": line,
            "arm": found.joint().map(|joint| joint + 1),
            "joint": by,
            "position_mm": convention.vector(&found.position()).data.0[0],
            "sigma_mm": sigma,
        });
        let text =
            format!("{what}. Residuals: {with} mm with this step, {without} mm without. {remedy}");
        Self {
            is_no_drift: found.joint().is_some() || sigma[0] < NO_DRIFT * sigma[1],
            finding: warning("step", figures, text),
        }
    }
}

/// The step that explains most of the residuals, if it does so clearly.
pub(super) fn step(case: &Case<'_>) -> Option<Step> {
    let rows = case.readings.rows.len();
    let mut kinds = [Kind::Position, Kind::Height].into_iter();
    let kind = kinds.find(|own| case.readings.holds(*own))?;
    if !(4 * LEAST_ROWS..=MOST_ROWS).contains(&rows) {
        return None;
    }
    let options = Options {
        robust: false,
        ..case.options
    };
    // Until the step is removed, the readings may contradict what is stated.
    let (_, loose, solution) = loosened(&Case { options, ..*case })?;
    let fit = |readings: &Readings| solve(&loose, readings, &options).ok();
    let without = sigma(&solution, kind)?;
    let count = case
        .readings
        .rows
        .iter()
        .filter(|row| row.value.kind() == Some(kind));
    let count = (count.count() * if kind == Kind::Position { 3 } else { 1 }) as f64;
    let tried = candidates(&solution, case.readings)
        .into_iter()
        .flatten()
        .filter_map(|mut found| {
            let mut with = without;
            // The second pass starts from the result of the first: a jump of degrees is not small.
            for _ in 0..2 {
                let mended = found.undone(case.readings, &solution);
                let again = fit(&mended)?;
                with = sigma(&again, kind)?;
                let more = explained(&again, &mended, found.index).swap_remove(found.group);
                for (own, more) in found.by.iter_mut().zip(more.map_or(vec![], |(_, by)| by)) {
                    *own += more;
                }
            }
            let gain = count * (without / with).ln();
            let mended = found.undone(case.readings, &solution);
            let agrees = |own: Solution| !is_understated(&own);
            // A single wrong row looks like a step that leaves much.
            let clear =
                with < NO_DRIFT * without || solve(case.robot, &mended, &options).is_ok_and(agrees);
            (gain > CLEARLY && with < LEFT * without && clear).then_some((with, found))
        });
    let (with, found) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(Step::new(case, kind, &found, [with, without]))
}

fn sigma(solution: &Solution, kind: Kind) -> Option<f64> {
    let mut noise = solution.noise.iter();
    let own = noise.find(|own| own.kind == kind)?;
    Some(if own.stated {
        own.sigma * own.ratio()
    } else {
        own.sigma
    })
}

/// Columns of the steps tested: one for each joint, and three for the positions.
const GROUPS: [&[usize]; 4] = [&[0], &[1], &[2], &[3, 4, 5]];
const OF_POSITIONS: usize = 3;

/// A step from the row at `index` on.
struct Found {
    index: usize,
    /// Index into [`GROUPS`].
    group: usize,
    /// Size: radians or mm of a joint, or mm along the robot's axes.
    by: Vec<f64>,
}

impl Found {
    fn joint(&self) -> Option<usize> {
        (self.group != OF_POSITIONS).then_some(self.group)
    }

    fn position(&self) -> Vector3<f64> {
        match self.by[..] {
            [x, y, z] => Vector3::new(x, y, z),
            _ => Vector3::zeros(),
        }
    }

    /// The readings without the step.
    fn undone(&self, readings: &Readings, solution: &Solution) -> Readings {
        let mut mended = readings.clone();
        let off = self.position();
        let turned = solution
            .places
            .frame
            .map_or(off, |frame| frame.rotation * off);
        for row in mended.rows.iter_mut().skip(self.index) {
            if let Some(joint) = self.joint() {
                row.value.joints[joint] += self.by[0];
            } else {
                for (axis, coordinate) in row.value.position.iter_mut().enumerate() {
                    *coordinate = coordinate.map(|value| value - turned[axis]);
                }
                row.value.height = row.value.height.map(|(plane, height)| {
                    let normal = solution.places.planes.get(plane).map(|own| own.normal);
                    (plane, height - normal.map_or(0.0, |own| own.dot(&off)))
                });
            }
        }
        mended
    }
}

/// The best step of a joint and the best step of the positions.
fn candidates(solution: &Solution, readings: &Readings) -> [Option<Found>; 2] {
    let rows = readings.rows.len();
    let (last, stride) = (rows.saturating_sub(LEAST_ROWS), rows.div_ceil(PLACES));
    let mut best: [Option<(f64, Found)>; 2] = [None, None];
    let mut look = |index: usize| {
        let groups = explained(solution, readings, index).into_iter().enumerate();
        for (group, (gain, by)) in groups.filter_map(|(group, own)| Some((group, own?))) {
            let place = &mut best[usize::from(group == OF_POSITIONS)];
            if place.as_ref().is_none_or(|(most, _)| gain > *most) {
                *place = Some((gain, Found { index, group, by }));
            }
        }
        best.each_ref()
            .map(|own| own.as_ref().map(|(_, own)| own.index))
    };
    let mut places = [None; 2];
    for index in (LEAST_ROWS..last).step_by(stride) {
        places = look(index);
    }
    for place in places.into_iter().flatten().filter(|_| stride > 1) {
        let around = place.saturating_sub(stride).max(LEAST_ROWS)..(place + stride).min(last);
        around.for_each(|index| {
            look(index);
        });
    }
    best.map(|own| own.map(|(_, found)| found))
}

/// The decrease of the sum of squares by steps of each joint and of the positions at a row, and the sizes of the steps.
fn explained(
    solution: &Solution,
    readings: &Readings,
    index: usize,
) -> Vec<Option<(f64, Vec<f64>)>> {
    let of_position = |row: usize| readings.rows[row].value.kind() != Some(Kind::Distance);
    explained_by(solution, readings, &GROUPS.map(<[_]>::to_vec), |row, at| {
        let joints = [0, 1, 2].map(|joint| at.by_joints.column(joint).into_owned());
        let axes = [0, 1, 2].map(|axis| Vector3::ith(axis, f64::from(u8::from(of_position(row)))));
        let after = if row >= index { 1.0 } else { 0.0 };
        let all = joints.into_iter().chain(axes);
        all.map(|own| after * own).collect()
    })
}
