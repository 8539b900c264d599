//! What a report says of a platform that tilts, or that may.

use crate::accuracy::budget::unmodelled;
use crate::accuracy::quantiles::median;
use crate::effects::OrientationNoise;
use crate::files::robot_file::{ONLY_TARGET, RobotFile};
use crate::files::samples_file::Readings;
use crate::finding::{Finding, note, warning};
use crate::fit::{Case, Solution, solve};
use crate::geometry::{OF_ARM, Parallelograms};
use crate::judge::Judged;
use crate::text::{count, degrees, list, significant};
use delta_cal::{Robot, Sample};
use nalgebra::Vector3;
use serde::Serialize;
use serde_json::json;

/// σ of rods that are to explain readings, mm and radians.
const EXPLAINING: [f64; 2] = [0.3, 0.005];
/// A point this close to the centre of the platform, mm, is in it.
const CENTRAL: f64 = 1.0;
/// Of the poses in the workspace, every so many are looked at.
const EVERY: usize = 20;
/// Rods that differ by more than this many σ do differ.
pub(crate) const NAMED: f64 = 2.0;

/// The tilt of the platform.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TiltReport {
    /// The angle between platform and base, median over the workspace, milliradians.
    pub median_mrad: f64,
    /// The rods of each arm.
    pub arms: Vec<RodsReport>,
    /// The rotations that were read.
    pub orientation: Option<OrientationNoise>,
}

/// The two rods of an arm. The one on the side of t = z × r is the longer one, r being the arm's radial direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RodsReport {
    /// 1, 2 or 3.
    pub arm: usize,
    /// Difference of the rods' lengths, and of their spacing at the platform less that at the elbow, mm; yaw and roll of the
    /// elbow's axis against the platform's, degrees.
    pub numbers: [f64; OF_ARM],
    /// One σ of each.
    pub sigmas: [f64; OF_ARM],
    /// By how much the difference of the lengths tilts the platform, median over the workspace, milliradians.
    pub tilt_mrad: f64,
}

/// How a platform tilts over these poses; `None` if its rods are not known.
pub(super) fn tilt(
    after: &RobotFile,
    solution: &Solution,
    poses: &[Sample<f64>],
) -> Option<TiltReport> {
    let (rods, found) = (after.parallelograms?, solution.tilt()?);
    let convention = &after.convention;
    let tilted = |rods: &Parallelograms| {
        let some = poses.iter().step_by(EVERY);
        let found = some.filter_map(|pose| rods.pose(&after.robot, &pose.joints).ok());
        // Near a singularity the platform turns far: the median, milliradians.
        1e3 * median(found.map(|pose| pose.tilt.norm())).unwrap_or_default()
    };
    let arms = (0..3).map(|arm| {
        let in_file = |[rods, spacing, yaw, roll]: [f64; OF_ARM]| {
            [rods, spacing, degrees(yaw), degrees(roll)]
        };
        let sigma = |number| {
            let place = found.first + OF_ARM * arm + number;
            solution.covariance[(place, place)].sqrt()
        };
        let mut alone = Parallelograms {
            numbers: [[0.0; OF_ARM]; 3],
            ..rods
        };
        alone.numbers[arm][0] = rods.numbers[arm][0];
        RodsReport {
            arm: arm + 1,
            numbers: in_file(convention.rods(rods.numbers[arm])),
            sigmas: in_file([0, 1, 2, 3].map(sigma)),
            tilt_mrad: tilted(&alone),
        }
    });
    Some(TiltReport {
        median_mrad: tilted(&rods),
        arms: arms.collect(),
        orientation: solution.orientation,
    })
}

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

/// What to state of rods that would explain readings that Model 24 does not.
pub(super) fn explained_by_rods(case: &Case<'_>) -> Option<String> {
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

/// Rods of which nothing is known, in the uncertainty budget.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct UnknownRods {
    /// By how much the two rods of an arm, and their spacings, are taken to differ, one σ.
    pub difference_mm: f64,
    /// How far apart they are taken to be.
    pub spacing_mm: f64,
    /// σ of a position in the frame of the base due to that, median over the workspace.
    pub absolute_mm: f64,
    /// The same for relative positions.
    pub relative_mm: f64,
}

/// `None` if the rods are known, or all targets and the tool are the platform's centre.
pub(super) fn unknown_rods(
    robot: &RobotFile,
    solution: &Solution,
    poses: &[Sample<f64>],
) -> Option<UnknownRods> {
    let places = robot.instruments.targets.iter().map(|own| own.place);
    let mut beside = places.chain(robot.tool);
    let unknown = robot.parallelograms.is_none() && beside.any(|own| own.norm() > CENTRAL);
    let rods = usual(robot);
    let poses = poses.iter().step_by(EVERY).copied();
    let [absolute_mm, relative_mm] = unknown
        .then(|| unmodelled(solution, robot, rods, poses.collect()))
        .flatten()?;
    Some(UnknownRods {
        difference_mm: rods.tolerance[0],
        spacing_mm: rods.spacing,
        absolute_mm,
        relative_mm,
    })
}

fn usual(robot: &RobotFile) -> Parallelograms {
    Parallelograms {
        platform_radius: robot.platform_radius.unwrap_or_default(),
        ..Parallelograms::USUAL
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

/// How far rods made to their tolerance move a point, one σ, median over these poses, mm.
fn displaced(
    rods: &Parallelograms,
    robot: &Robot<f64>,
    poses: &[Sample<f64>],
    place: &Vector3<f64>,
) -> f64 {
    let moves = poses.iter().step_by(EVERY).filter_map(|pose| {
        let columns = rods.columns(robot, (&pose.position, &pose.joints), place)?;
        let each = columns.column_iter().zip(rods.sigmas());
        let each = each.map(|(own, sigma)| own.norm_squared() * sigma * sigma);
        Some(each.sum::<f64>().sqrt())
    });
    median(moves).unwrap_or_default()
}
