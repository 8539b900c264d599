//! How a platform tilts, and by how much rods of which nothing is known may tilt it.

use super::budget::unmodelled;
use super::quantiles::median;
use crate::effects::OrientationNoise;
use crate::files::RobotFile;
use crate::fit::Solution;
use crate::geometry::{OF_ARM, Parallelograms};
use crate::text::degrees;
use delta_cal::{Robot, Sample};
use nalgebra::Vector3;
use serde::Serialize;

/// A point this close to the centre of the platform, mm, is in it.
pub(crate) const CENTRAL: f64 = 1.0;
/// Of the poses in the workspace, every so many are looked at.
const EVERY: usize = 20;

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
pub(crate) fn tilt(
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
pub(crate) fn unknown_rods(
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

/// Rods of which nothing is stated.
pub(crate) fn usual(robot: &RobotFile) -> Parallelograms {
    Parallelograms {
        platform_radius: robot.platform_radius.unwrap_or_default(),
        ..Parallelograms::USUAL
    }
}

/// How far rods made to their tolerance move a point, one σ, median over these poses, mm.
pub(crate) fn displaced(
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
