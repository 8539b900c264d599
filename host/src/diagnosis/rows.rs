//! Explanations of readings that do not fit: rows that disagree, rows shifted by one, or one mistake in all rows.

use crate::accuracy::quantiles::median;
use crate::files::samples_file::{Kind, Reading, Readings};
use crate::finding::{Finding, warning};
use crate::fit::{Case, Frame, Options, Solution, solve};
use crate::judge::{agreeing, is_understated};
use crate::text::{count, in_lines};
use delta_cal::Sample;
use nalgebra::Vector3;
use serde_json::json;

/// Files with more rows are not refitted.
const MOST_ROWS: usize = 2000;
/// Most rows for which each is left out in turn.
const ROWS_TRIED: usize = 100;
/// Fewer samples that disagree are individually wrong.
pub(crate) const FEWEST: usize = 3;
/// At most one row in this many is a single mistake.
pub(crate) const MOST_WRONG: usize = 4;
/// Rows are shifted if a shift reduces their distance to this fraction.
const SHIFTED: f64 = 0.1;
const INCH: f64 = 25.4;

/// Rows whose positions belong to the joints of their neighbours, because a row is missing or duplicated, among the rows
/// that a robust fit rejected.
pub(crate) fn shifted_rows(solution: &Solution) -> Option<Finding> {
    let readings = &solution.readings;
    let rows = solution.rows.iter().enumerate();
    let suspected: Vec<_> = rows
        .filter(|(_, fit)| fit.suspected)
        .map(|(index, _)| index)
        .collect();
    let first = *suspected.first().filter(|_| suspected.len() >= FEWEST)?;
    // Median distance between positions and the robot at the joints of another row.
    let apart = |by: isize| -> Option<f64> {
        let off = |index: &usize| {
            let other = readings.rows.get(index.checked_add_signed(by)?)?;
            let reading = Reading {
                joints: other.value.joints,
                ..readings.rows.get(*index)?.value
            };
            let [x, y, z, ..] = solution.places.expected(&solution.robot, &reading);
            Some((reading.sample()?.position - Vector3::new(x?, y?, z?)).norm())
        };
        median(suspected.iter().filter_map(off))
    };
    let own = apart(0)?;
    let nearer = |by| apart(by).is_some_and(|other| other < SHIFTED * own);
    let mut ways = [(1, "after"), (-1, "before")].into_iter();
    let (belongs_to, which) = ways.find(|(by, _)| nearer(*by))?;
    let line = readings.rows.get(first)?.line;
    let text = format!(
        "From line {line} each position fits the joints of the row {which} it: rows are shifted by one. Look for a \
         missing or duplicate row."
    );
    Some(warning(
        "shifted",
        json!({ "line": line, "belongs_to": belongs_to }),
        text,
    ))
}

type Change = fn(&mut Reading);

/// Mistakes that affect all rows alike, for files without complete positions.
const MISTAKES: [(&str, Change); 7] = [
    ("The heights have the wrong sign: change it.", |row| {
        scaled(row, -1.0, 1.0);
    }),
    (
        "The heights are in inches: name the column height_in.",
        |row| scaled(row, INCH, 1.0),
    ),
    (
        "The distances are in inches: name the column distance_in.",
        |row| scaled(row, 1.0, INCH),
    ),
    ("The joint angles have the wrong sign: change it.", |row| {
        row.each_pose(|joints| joints.map(|q| -q));
    }),
    (
        "Joint columns 1 and 2 are exchanged: exchange their names.",
        |row| row.each_pose(|[a, b, c]| [b, a, c]),
    ),
    (
        "Joint columns 2 and 3 are exchanged: exchange their names.",
        |row| row.each_pose(|[a, b, c]| [a, c, b]),
    ),
    (
        "Joint columns 1 and 3 are exchanged: exchange their names.",
        |row| row.each_pose(|[a, b, c]| [c, b, a]),
    ),
];

fn scaled(row: &mut Reading, heights: f64, distances: f64) {
    row.height = row.height.map(|(plane, height)| (plane, heights * height));
    row.distance = row
        .distance
        .map(|(from, distance)| (from, distances * distance));
}

/// Wrong rows, or a mistake in all rows, that explain refused readings: a sentence with the remedy.
pub(crate) fn wrong_rows(case: &Case<'_>) -> Option<String> {
    let all = &case.readings.rows;
    if all.len() > MOST_ROWS {
        return None;
    }
    if !case.readings.holds(Kind::Position)
        && let Some(mistake) = mistake(case)
    {
        return Some(mistake.to_owned());
    }
    if case.options.robust {
        return None;
    }
    let robust = Options {
        robust: true,
        method: None,
        ..case.options
    };
    let solution = solve(case.robot, case.readings, &robust).ok();
    let Some(solution) = solution.filter(|_| case.robot.tolerance.is_some()) else {
        let line = one_wrong(case)?;
        return Some(format!(
            "Line {line} disagrees with all others: measure it again or delete it."
        ));
    };
    if let Some(shifted) = shifted_rows(&solution) {
        return Some(shifted.text);
    }
    let suspected = all.iter().zip(&solution.rows);
    let suspected = suspected.filter(|(_, fit)| fit.suspected);
    let lines: Vec<_> = suspected.map(|(row, _)| row.line).collect();
    // Single mistakes are few, and what remains agrees with the noise.
    let single = MOST_WRONG * lines.len() <= all.len() && !is_understated(&solution);
    (single && !lines.is_empty()).then(|| {
        format!(
            "{} of {} agree, all but {}. --robust leaves out those that do not.",
            all.len() - lines.len(),
            count(all.len(), "sample"),
            in_lines(&lines)
        )
    })
}

/// The change whose readings fit best, if any fit.
fn best<T>(case: &Case<'_>, changed: impl Iterator<Item = (Readings, T)>) -> Option<T> {
    let fitted = changed.filter_map(|(readings, what)| {
        let changed = Case {
            readings: &readings,
            ..*case
        };
        Some((agreeing(&changed)?.squares(), what))
    });
    let best = fitted.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(best.1)
}

fn mistake(case: &Case<'_>) -> Option<&'static str> {
    let changed = MISTAKES.into_iter().map(|(mistake, change)| {
        let mut changed = case.readings.clone();
        let rows = changed.rows.iter_mut();
        rows.for_each(|row| change(&mut row.value));
        (changed, mistake)
    });
    best(
        case,
        changed.filter(|(changed, _)| changed != case.readings),
    )
}

/// The line without which the other rows fit best, if they fit.
fn one_wrong(case: &Case<'_>) -> Option<u64> {
    let rows = case.readings.rows.len();
    let others = (0..rows).filter(|_| rows <= ROWS_TRIED).map(|index| {
        let mut others = case.readings.clone();
        let row = others.rows.remove(index);
        (others, row.line)
    });
    best(case, others)
}

/// Fewest points that show an offset.
const FEWEST_OFFSET: usize = 4;
/// All points share an offset if its mean is this many times the scatter about it…
const SAME: f64 = 4.0;
/// …and more than this fraction of the forearm…
const LEAST: f64 = 0.005;
/// …and more than this many σ of the arms' height within the tolerance: end stops move all points, too.
const SIGMAS: f64 = 3.0;

/// All points are off by nearly the same: the measured point may be a reflector or a tip.
pub(crate) fn beside_the_platform_point(case: &Case<'_>) -> Option<Finding> {
    let robot = case.robot;
    if case.options.frame == Frame::Sensor || !robot.instruments.targets.is_empty() {
        return None;
    }
    let offset = |row: &Sample<f64>| Some(row.position - robot.robot.forward(&row.joints).ok()?);
    let samples: Vec<_> = case.readings.samples().map(|row| row.value).collect();
    let offsets: Vec<Vector3<f64>> = samples.iter().filter_map(offset).collect();
    if offsets.len() < FEWEST_OFFSET || 2 * offsets.len() < samples.len() {
        return None;
    }
    let number = offsets.len() as f64;
    let mean = offsets.iter().sum::<Vector3<f64>>() / number;
    let squares: f64 = offsets.iter().map(|own| (own - mean).norm_squared()).sum();
    let scatter = (squares / number).sqrt();
    let [arm, ..] = robot.robot.arms();
    let [_, _, height, ..] = robot
        .tolerance
        .map_or([0.0; 8], |tolerance| tolerance.of_places(arm));
    let least = (LEAST * arm.lb()).max(SIGMAS * height);
    if !(mean.norm() > SAME * scatter && mean.norm() > least) {
        return None;
    }
    let [x, y, z] = robot.convention.vector(&mean).data.0[0];
    let text = format!(
        "All measured points are offset by ({x:.1}, {y:.1}, {z:.1}) mm from the platform point (scatter {scatter:.1} mm). \
         If a reflector or tip is mounted there, state [target] x_mm = {x:.1}, y_mm = {y:.1}, z_mm = {z:.1}; if the \
         coordinates are in another frame, use --frame sensor."
    );
    let figures = json!({ "offset_mm": [x, y, z], "scatter_mm": scatter });
    Some(warning("target", figures, text))
}
