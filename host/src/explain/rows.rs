//! Explanations of readings that do not fit: rows shifted by one, a reflector beside the platform's centre, its tilt.

use crate::accuracy::quantiles::median;
use crate::accuracy::tilt::{CENTRAL, usual};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Reading, Readings};
use crate::finding::{Finding, warning};
use crate::fit::{Case, Frame, Solution, solve};
use crate::geometry::{Parallelograms, centroid};
use delta_cal::Sample;
use nalgebra::Vector3;
use serde_json::json;

/// Fewer samples that disagree are individually wrong.
pub(crate) const FEWEST: usize = 3;
/// At most one row in this many is a single mistake.
pub(crate) const MOST_WRONG: usize = 4;
/// Rows are shifted if a shift reduces their distance to this fraction.
const SHIFTED: f64 = 0.1;
/// σ of rods that are to explain readings, mm and radians.
const EXPLAINING: [f64; 2] = [0.3, 0.005];

/// Rows that a robust fit rejected, as [`shifted`].
pub(crate) fn shifted_rows(solution: &Solution) -> Option<Finding> {
    let rows = solution.rows.iter().enumerate();
    let suspected: Vec<_> = rows
        .filter(|(_, fit)| fit.suspected)
        .map(|(index, _)| index)
        .collect();
    shifted(solution, &solution.readings, &suspected)
}

/// Rows whose positions belong to the joints of their neighbours, because a row is missing or duplicated, among those that
/// disagree with a solution.
pub(crate) fn shifted(
    solution: &Solution,
    readings: &Readings,
    suspected: &[usize],
) -> Option<Finding> {
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

/// All points share an offset if its mean is this many times the scatter about it…
const SAME: f64 = 4.0;
/// …and more than this fraction of the forearm.
const LEAST: f64 = 0.005;

/// All points are off by nearly the same: the measured point may be a reflector or a tip. With a tolerance, the search looks
/// for one.
pub(crate) fn beside_the_platform_point(case: &Case<'_>) -> Option<Finding> {
    let robot = case.robot;
    let stated = robot.tolerance.is_some() || !robot.instruments.targets.is_empty();
    if case.options.frame == Frame::Sensor || stated {
        return None;
    }
    let offset = |row: &Sample<f64>| Some(row.position - robot.robot.forward(&row.joints).ok()?);
    let samples: Vec<_> = case.readings.samples().map(|row| row.value).collect();
    let offsets: Vec<Vector3<f64>> = samples.iter().filter_map(offset).collect();
    let few = 2 * offsets.len() < samples.len();
    let mean = centroid(offsets.iter().copied());
    let squares: f64 = offsets.iter().map(|own| (own - mean).norm_squared()).sum();
    let scatter = (squares / offsets.len() as f64).sqrt();
    let [arm, ..] = robot.robot.arms();
    if few || !(mean.norm() > SAME * scatter && mean.norm() > LEAST * arm.lb()) {
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

/// What to state of rods that would explain readings that Model 24 does not.
pub(crate) fn explained_by_rods(case: &Case<'_>) -> Option<String> {
    let mut targets = case.robot.instruments.targets.iter();
    if case.robot.parallelograms.is_some() || targets.all(|own| own.place.norm() <= CENTRAL) {
        return None;
    }
    let rods = Parallelograms {
        tolerance: EXPLAINING,
        ..usual(case.robot)
    };
    let tilting = RobotFile {
        parallelograms: Some(rods),
        ..case.robot.clone()
    };
    solve(&tilting, case.readings, &case.options).ok()?;
    Some(format!(
        "Rods of an arm that differ by some {} mm and tilt the platform explain these readings: state spacing_mm in \
         [parallelogram], the distance of the two rods.",
        rods.tolerance[0]
    ))
}
