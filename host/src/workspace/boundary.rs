//! The points of the boundary: where the grid's lines enter and leave the workspace.

use super::Workspace;
use super::line::PART;
use super::surface::{self, Surface};
use crate::geometry::reach::Limit;
use delta_cal::ArmIndex;
use delta_cal::kinematics::KinematicsError;
use nalgebra::Vector3;
use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};

/// One point of the boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundaryPoint {
    /// Where it is, mm; reachable.
    pub position: Vector3<f64>,
    /// What keeps the platform from going further outwards.
    pub limit: Limit,
    /// The boundary's normal, outwards.
    pub outward: Vector3<f64>,
    /// The area for which the point stands, mm²: spacing² · |normal along its line|. Summed over all
    /// points it is the area of the boundary.
    pub area: f64,
    /// The joint angles there, radians.
    pub q: [f64; 3],
}

/// Both ends of each piece of each line along x, y and z, in this order.
pub(super) fn points(workspace: &Workspace) -> Vec<BoundaryPoint> {
    let along = |axis: usize| {
        let of_line = move |(line, pieces): (usize, &Vec<(f64, f64)>)| {
            let origin = workspace.grid.node(workspace.grid.beginning(line, axis));
            let ends = pieces
                .iter()
                .flat_map(|(from, to)| [(*from, -1.0), (*to, 1.0)]);
            let point = |(way, sign)| {
                let way = Vector3::ith(axis, way);
                point(workspace, origin + way, axis, sign)
            };
            ends.map(point).collect::<Vec<_>>()
        };
        let lines = workspace.lines[axis].par_iter().enumerate();
        lines.flat_map_iter(of_line).collect::<Vec<_>>()
    };
    [0, 1, 2].into_iter().flat_map(along).collect()
}

/// The boundary point at the last reachable position along an axis, in the direction of the sign.
fn point(workspace: &Workspace, position: Vector3<f64>, axis: usize, sign: f64) -> BoundaryPoint {
    let Workspace { robot, reach, .. } = workspace;
    let joints = reach.any_joints(robot, &position);
    let q = joints.unwrap_or([reach.limits.at(0.5); 3]);
    let direction = Vector3::ith(axis, sign);
    // Twice as far as the last unreachable place, which may be there but for rounding.
    let outside = position + direction * (2.0 * PART * workspace.tolerance);
    let limit = what_stops(workspace, &q, &outside);
    let normal = Surface::new(robot, reach, limit, q).normal(robot, &position);
    let outward = normal.unwrap_or(direction);
    BoundaryPoint {
        position,
        limit,
        outward,
        area: workspace.grid.spacing.powi(2) * outward[axis].abs(),
        q,
    }
}

/// What keeps the platform from `outside`, coming from a pose nearby with joint angles `q`.
fn what_stops(workspace: &Workspace, q: &[f64; 3], outside: &Vector3<f64>) -> Limit {
    let Workspace { robot, reach, .. } = workspace;
    if let Err(error) = robot.inverse(outside) {
        return match error {
            KinematicsError::Unreachable(arm) => Limit::Serial(arm),
            error => error.into(),
        };
    }
    let Some(there) = surface::branch(robot, outside, q) else {
        return Limit::NonFinite(ArmIndex::First);
    };
    let there = there.map(|q| reach.in_turn(q));
    match reach.allows(robot, outside, &there) {
        Err(Limit::Parallel(arm)) if surface::elbows_turned_over(robot, q, &there) => {
            Limit::Assembly(arm)
        }
        Err(Limit::Parallel(_)) | Ok(()) => {
            Limit::Parallel(surface::flattest(robot, outside, &there))
        }
        Err(limit) => limit,
    }
}
