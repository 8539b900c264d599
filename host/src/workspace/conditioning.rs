//! How far from singularities the robot is, all over its workspace.

use super::Workspace;
use delta_cal::kinematics::SingularityDistance;
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// A reachable position and how well the robot is conditioned there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConditionedPosition {
    /// mm.
    pub position: Vector3<f64>,
    /// Both kinds; 0 at a singularity.
    pub conditioning: SingularityDistance<f64>,
}

impl ConditionedPosition {
    /// At a position, if it is reachable.
    pub fn at(workspace: &Workspace, position: Vector3<f64>) -> Option<Self> {
        let q = workspace
            .reach
            .any_joints(&workspace.robot, &position)
            .ok()?;
        Some(Self {
            position,
            conditioning: workspace.robot.singularity_distance(&position, &q),
        })
    }

    /// The smallest of all arms: 0 at a singularity of type 1.
    pub fn serial(&self) -> f64 {
        self.conditioning.serial.into_iter().fold(1.0, f64::min)
    }
}

/// Reachable nodes of the grid, every second or third if there are more than `most`.
pub fn conditioning_map(workspace: &Workspace, most: usize) -> Vec<ConditionedPosition> {
    let grid = &workspace.grid;
    let reachable = (0..grid.len()).filter(|node| grid.is_reachable(grid.place(*node)));
    let reachable: Vec<usize> = reachable.collect();
    let stride = (1_usize..=1000).find(|stride| reachable.len() / stride.pow(3) <= most);
    let stride = stride.unwrap_or(1000);
    reachable
        .into_par_iter()
        .map(|node| grid.place(node))
        .filter(|place| place.iter().all(|index| index % stride == 0))
        .filter_map(|place| ConditionedPosition::at(workspace, grid.node(place)))
        .collect()
}
