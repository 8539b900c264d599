//! The distance between measured positions and those that a geometry gives.

use super::information::prior_covariance;
use super::quantiles::median;
use super::rigid_motion::RigidMotions;
use super::uncertainty::{jacobian, variance};
use crate::files::{RobotFile, Tool, Tooled};
use crate::order;
use delta_cal::Robot;
use nalgebra::Vector3;
use serde::Serialize;

/// A sample further off than this many times the median is an outlier.
pub(crate) const OUTLIER: f64 = 6.0;
/// Measured positions further off than this fraction of the forearm are in another frame or unit, or the joints are in
/// another order.
const ELSEWHERE: f64 = 0.05;
/// A tolerance allows this many σ.
const ALLOWED: f64 = 3.0;

/// Distance between the measured positions and those of a robot's geometry, mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PositionError {
    /// Root mean square distance over the samples that the geometry can reach; NaN if there are none, like the other
    /// distances.
    pub rms: f64,
    /// Median distance, insensitive to outliers.
    pub median: f64,
    /// Largest distance.
    pub max: f64,
    /// Line in the samples file of the sample with the largest distance.
    pub max_at_line: Option<u64>,
    /// Samples whose joint angles have no position in this geometry; the other figures exclude them.
    pub unreachable: usize,
}

/// Before and after a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BeforeAfter {
    /// With the robot file's parameters.
    pub before: PositionError,
    /// With the calibrated parameters.
    pub after: PositionError,
}

/// σ of a coordinate over robots made to the file's tolerance, median over poses, mm; `None` without a tolerance.
pub(crate) fn sigma_by_tolerance(
    file: &RobotFile,
    poses: impl Iterator<Item = [f64; 3]>,
) -> Option<f64> {
    let tolerance = file.tolerance.as_ref()?;
    let covariance = prior_covariance(&file.robot, tolerance);
    median(poses.filter_map(|joints| {
        let position = file.robot.forward(&joints).ok()?;
        let jacobian = jacobian(&file.robot, &Tool::default(), &position, &joints)?;
        Some(variance(&covariance, &jacobian)?.sqrt() / 3.0_f64.sqrt())
    }))
}

/// rms errors of the positions of its tool that a robot's geometry gives at these joint angles (radians), mm: absolute, and after the
/// rigid motion that fits best. Infinite if the geometry reaches too few of them.
pub(crate) fn position_errors(
    (robot, tool): Tooled<'_>,
    (truth, true_tool): Tooled<'_>,
    joints: impl Iterator<Item = [f64; 3]>,
) -> [f64; 2] {
    let errors: Vec<_> = joints
        .filter_map(|q| {
            let is = true_tool.position(truth, &q).ok()?;
            Some((is, tool.position(robot, &q).ok()? - is))
        })
        .collect();
    let lengths = errors.iter().map(|(_, error)| error.norm());
    let absolute = lengths.map(|length| length * length).sum();
    let motions = RigidMotions::of(errors.iter().map(|(point, _)| *point));
    let relative = motions.map_or(f64::NAN, |motions| {
        let left = motions.removed(&errors);
        left.iter().map(Vector3::norm_squared).sum()
    });
    [absolute, relative].map(|squares: f64| {
        let rms = (squares / errors.len() as f64).sqrt();
        if rms.is_nan() { f64::INFINITY } else { rms }
    })
}

impl PositionError {
    /// Whether the measured points are further off than the robot file's tolerance allows, as in another frame or unit
    /// or with another order of joints.
    pub(crate) fn contradicts(
        &self,
        file: &RobotFile,
        poses: impl Iterator<Item = [f64; 3]>,
    ) -> bool {
        let allowed = |sigma: f64| self.median <= ALLOWED * 3.0_f64.sqrt() * sigma;
        self.lies_elsewhere(&file.robot) && !sigma_by_tolerance(file, poses).is_some_and(allowed)
    }

    /// Whether the measured points are as far off as in another frame or unit or with another order of joints.
    pub(crate) fn lies_elsewhere(&self, robot: &Robot<f64>) -> bool {
        let [arm, ..] = robot.arms();
        !(self.median <= ELSEWHERE * arm.lb())
    }

    /// From distances, each with its line; `None` is unreachable.
    pub(crate) fn of(distances: impl IntoIterator<Item = (Option<f64>, u64)>) -> Self {
        let mut known = Vec::new();
        let mut unreachable = 0;
        for (distance, line) in distances {
            match distance {
                Some(distance) => known.push((distance, line)),
                None => unreachable += 1,
            }
        }
        order::sort_by(&mut known, |own| own.0);
        let squares: f64 = known.iter().map(|(distance, _)| distance * distance).sum();
        let middle = known.get(known.len() / 2);
        Self {
            rms: f64::sqrt(squares / known.len() as f64),
            median: middle.map_or(f64::NAN, |(distance, _)| *distance),
            max: known.last().map_or(f64::NAN, |(distance, _)| *distance),
            max_at_line: known.last().map(|(_, line)| *line),
            unreachable,
        }
    }
}
