//! Where the robot is wanted: the positions of the fit and those of the stated loss.

use crate::accuracy::workspace_poses::inside;
use crate::files::robot_file::RobotFile;
use delta_cal::robot::Drive;
use nalgebra::Vector3;

/// At most so many positions are fitted.
const FITTED: usize = 300;
/// So far out, as a part of the towers' distance from the z axis, printers print.
const BETWEEN_TOWERS: f64 = 0.85;

/// Wanted positions in the calibrated robot's frame, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Those of the fit.
    pub fitted: Vec<Vector3<f64>>,
    /// Those of the stated loss, the fitted ones among them.
    pub evaluated: Vec<Vector3<f64>>,
    /// Within so far of the z axis, if that was not the whole workspace, mm.
    pub within: Option<f64>,
}

impl Wanted {
    /// All over the workspace of a robot: evenly spread in joint space, clear of singularities, where a controller
    /// reaches them. Of a robot with towers only what is well between them: further out the rods hang so flat that
    /// nobody works there.
    pub fn in_workspace(robot: &RobotFile) -> Self {
        let poses = inside(&robot.robot, &robot.reach());
        let positions = poses.into_iter().map(|pose| pose.position);
        let positions = positions.filter(|at| controller_reaches(robot, at));
        match robot.robot.drive() {
            Drive::Rotary => Self::of(positions.collect()),
            Drive::Linear => {
                let towers = robot.robot.arms().iter().map(|arm| arm.d().xy().norm());
                let within = BETWEEN_TOWERS * towers.fold(f64::INFINITY, f64::min);
                let within = within.round();
                Self {
                    within: Some(within),
                    ..Self::of(positions.filter(|at| at.xy().norm() <= within).collect())
                }
            }
        }
    }

    /// These.
    pub fn of(positions: Vec<Vector3<f64>>) -> Self {
        let step = positions.len().div_ceil(FITTED).max(1);
        Self {
            fitted: positions.iter().copied().step_by(step).collect(),
            evaluated: positions,
            within: None,
        }
    }

    /// The lowest height, mm.
    pub fn lowest(&self) -> f64 {
        let heights = self.evaluated.iter().map(|at| at.z);
        heights.fold(0.0, f64::min)
    }
}

/// Whether the elbows-out joint angles at a position, which are those that controllers compute, lead there, are within the
/// limits and, with motors that turn the arms, clear of singularities.
pub(super) fn controller_reaches(robot: &RobotFile, at: &Vector3<f64>) -> bool {
    let reach = robot.reach();
    let joints = reach.joints(&robot.robot, at);
    joints.is_ok_and(|joints| match robot.robot.drive() {
        Drive::Rotary => reach.clear_position(&robot.robot, &joints).is_ok(),
        Drive::Linear => true,
    })
}
