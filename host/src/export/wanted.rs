//! Where the robot is wanted: the positions of the fit and those of the stated loss.

use crate::accuracy::workspace_poses::inside;
use crate::files::robot_file::RobotFile;
use nalgebra::Vector3;

/// At most so many positions are fitted.
const FITTED: usize = 300;

/// Wanted positions in the calibrated robot's frame, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Those of the fit.
    pub fitted: Vec<Vector3<f64>>,
    /// Those of the stated loss, the fitted ones among them.
    pub evaluated: Vec<Vector3<f64>>,
}

impl Wanted {
    /// All over the workspace of a robot: evenly spread in joint space, clear of singularities.
    pub fn in_workspace(robot: &RobotFile) -> Self {
        let poses = inside(&robot.robot, &robot.reach());
        Self::of(poses.into_iter().map(|pose| pose.position).collect())
    }

    /// These.
    pub fn of(positions: Vec<Vector3<f64>>) -> Self {
        let step = positions.len().div_ceil(FITTED).max(1);
        Self {
            fitted: positions.iter().copied().step_by(step).collect(),
            evaluated: positions,
        }
    }

    /// The lowest height, mm.
    pub fn lowest(&self) -> f64 {
        let heights = self.evaluated.iter().map(|at| at.z);
        heights.fold(0.0, f64::min)
    }
}
