//! Findings about a platform that tilts, or that may.

use crate::accuracy::tilt::{CENTRAL, displaced, tilt, unknown_rods, usual};
use crate::effects::OrientationNoise;
use crate::files::{ONLY_TARGET, Readings, RobotFile};
use crate::finding::{Finding, note, warning};
use crate::fit::{Case, Solution};
use crate::judge::Judged;
use crate::text::{count, list, significant};
use delta_cal::Sample;
use serde_json::json;

/// Rods that differ by more than this many σ do differ.
pub(crate) const NAMED: f64 = 2.0;

/// In how many rows there are rotations that cannot be used because the rods are not known, in a sentence.
pub(crate) fn unused_rotations(robot: &RobotFile, readings: &Readings) -> Option<(usize, String)> {
    let rows = readings.rows.iter().filter(|row| row.value.turn.is_some());
    let rows = rows.count();
    let unused = rows > 0 && robot.parallelograms.is_none();
    unused.then(|| {
        let text = format!(
            "The rotations rx_deg, ry_deg, rz_deg in {} are not used. State spacing_mm in [parallelogram] to have them used.",
            count(rows, "row")
        );
        (rows, text)
    })
}

/// Rods that differ; or what such rods would do, if nothing is known of them and a target or the tool is off the centre.
pub(super) fn of_rods(case: &Case<'_>, judged: &Judged, found: &mut Vec<Finding>) {
    let (robot, solution) = (case.robot, &judged.solution);
    let poses = &judged.poses.inside;
    let Some(stated) = robot.parallelograms else {
        let unused = unused_rotations(robot, case.readings);
        found.extend(
            unused.map(|(rows, text)| warning("rotations_unused", json!({ "rows": rows }), text)),
        );
        found.extend(unknown(robot, solution, poses));
        return;
    };
    if let Some(own) = solution.orientation.filter(OrientationNoise::contradicts) {
        let (used, stated) = (own.used_deg, own.stated_deg.unwrap_or_default());
        let text = format!(
            "Rotations scatter by {}°, and orientation_deg states {stated}°. The larger one is used.",
            significant(used, 2)
        );
        found.push(warning(
            "orientation_noise",
            json!({ "used_deg": used, "stated_deg": stated }),
            text,
        ));
    }
    let after = RobotFile {
        parallelograms: solution.tilt().map(|own| stated.with_numbers(&own.by)),
        ..robot.with_robot(&solution.robot)
    };
    let Some(report) = tilt(&after, solution, poses) else {
        return;
    };
    for own in &report.arms {
        let ([size, ..], [sigma, ..]) = (own.numbers.map(f64::abs), own.sigmas);
        if size > NAMED * sigma {
            let text = format!(
                "The two rods of arm {} differ by {} ± {} mm and tilt the platform by {} mrad. Exchange or match them.",
                own.arm,
                significant(size, 2),
                significant(sigma, 1),
                significant(own.tilt_mrad, 2)
            );
            let figures = json!({
                "arm": own.arm, "difference_mm": own.numbers[0], "sigma_mm": sigma, "tilt_mrad": own.tilt_mrad,
            });
            found.push(warning("rods_differ", figures, text));
        }
    }
}

/// In a sentence.
fn unknown(robot: &RobotFile, solution: &Solution, poses: &[Sample<f64>]) -> Option<Finding> {
    let own = unknown_rods(robot, solution, poses)?;
    let tool = robot.tool.iter().map(|own| ("tool".to_owned(), *own));
    let targets = robot.instruments.targets.iter().map(|own| {
        let name = match own.name.as_str() {
            ONLY_TARGET => ONLY_TARGET.to_owned(),
            name => format!("target {name}"),
        };
        (name, own.place)
    });
    let beside = targets.chain(tool);
    let beside = beside.filter(|(_, place)| place.norm() > CENTRAL);
    let rods = usual(robot);
    let moves: Vec<_> = beside
        .map(|(name, place)| (name, displaced(&rods, &solution.robot, poses, &place)))
        .collect();
    let each: Vec<_> = moves
        .iter()
        .map(|(name, by)| format!("the {name} by {} mm", significant(*by, 2)))
        .collect();
    let stated = if solution.is_absolute() {
        own.absolute_mm
    } else {
        own.relative_mm
    };
    let text = format!(
        "If the two rods of each arm differ by {} mm, as is usual, the platform tilts and moves {} (σ, with rods {:.0} mm apart). \
         Positions are then uncertain by {} mm more; the budget states that beside the combined uncertainty. State spacing_mm \
         in [parallelogram], and measure with three targets, to have the tilt found.",
        own.difference_mm,
        list(&each),
        own.spacing_mm,
        significant(stated, 2)
    );
    let moves: serde_json::Map<_, _> = moves
        .into_iter()
        .map(|(name, by)| (name.clone(), json!(by)))
        .collect();
    let figures = json!({
        "difference_mm": own.difference_mm, "spacing_mm": own.spacing_mm, "moves_mm": moves,
        "absolute_mm": own.absolute_mm, "relative_mm": own.relative_mm,
    });
    Some(note("rods_unknown", figures, text))
}
