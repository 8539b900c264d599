//! The points of the boundary: where the grid's lines enter and leave the workspace.

use super::face::{self, ByParameters, Face};
use super::grid::Grid;
use crate::geometry::reach::{Limit, Reach};
use delta_cal::kinematics::KinematicsError;
use delta_cal::{ArmIndex, Robot};
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// Points are bisected to this part of the tolerance; the rest is left for rounding.
const PART: f64 = 1.0 / 16.0;

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

impl BoundaryPoint {
    /// The surface on which the point lies.
    pub fn face<'a>(&self, robot: &'a Robot<f64>, reach: &'a Reach) -> Face<'a> {
        Face {
            robot,
            reach,
            limit: self.limit,
            q: self.q,
        }
    }

    /// How far the boundary moves outwards at this point for each parameter; [`Face::displacement`].
    pub fn displacement(&self, robot: &Robot<f64>, reach: &Reach) -> Option<ByParameters> {
        self.face(robot, reach).displacement(&self.position)
    }
}

/// The grid's edges, as node and axis, of which one end is reachable and the other is not, in order.
pub(super) fn edges(grid: &Grid) -> impl Iterator<Item = (usize, usize)> + '_ {
    (0..grid.len()).flat_map(move |node| {
        let place = grid.place(node);
        let here = grid.is_reachable(place);
        (0..3).filter_map(move |axis| {
            let mut next = place;
            next[axis] += 1;
            (grid.is_reachable(next) != here).then_some((node, axis))
        })
    })
}

/// One on each of these edges.
pub(super) fn points(
    robot: &Robot<f64>,
    reach: &Reach,
    grid: &Grid,
    tolerance: f64,
) -> Vec<BoundaryPoint> {
    let edges: Vec<(usize, usize)> = edges(grid).collect();
    let point = |(node, axis): (usize, usize)| {
        let place = grid.place(node);
        let mut next = place;
        next[axis] += 1;
        let (from, to) = if grid.is_reachable(place) {
            (place, next)
        } else {
            (next, place)
        };
        let ends = (grid.node(from), grid.node(to));
        let point = between(robot, reach, ends, tolerance);
        BoundaryPoint {
            area: grid.spacing.powi(2) * point.outward[axis].abs(),
            ..point
        }
    };
    edges.into_par_iter().map(point).collect()
}

/// The boundary point between a reachable position and one that is not, which stands for no area.
pub(super) fn between(
    robot: &Robot<f64>,
    reach: &Reach,
    ends: (Vector3<f64>, Vector3<f64>),
    tolerance: f64,
) -> BoundaryPoint {
    let is_inside = |x: &Vector3<f64>| reach.any_joints(robot, x).is_ok();
    let (inside, outside) = bisect(is_inside, ends, tolerance * PART);
    let joints = reach.any_joints(robot, &inside);
    let q = joints.unwrap_or([reach.limits.at(0.5); 3]);
    let limit = what_stops(robot, reach, &q, &outside);
    let face = Face {
        robot,
        reach,
        limit,
        q,
    };
    let normal = face.distance(&inside).map(|(_, normal)| normal);
    BoundaryPoint {
        position: inside,
        limit,
        outward: normal.unwrap_or_else(|| (ends.1 - ends.0).normalize()),
        area: 0.0,
        q,
    }
}

/// The last point from `inside` that is, and the first towards `outside` that is not, at most
/// `tolerance` apart.
pub(super) fn bisect(
    is_inside: impl Fn(&Vector3<f64>) -> bool,
    (mut inside, mut outside): (Vector3<f64>, Vector3<f64>),
    tolerance: f64,
) -> (Vector3<f64>, Vector3<f64>) {
    while (outside - inside).norm() > tolerance {
        let middle = (inside + outside) * 0.5;
        if middle == inside || middle == outside {
            break;
        }
        if is_inside(&middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    (inside, outside)
}

/// What keeps the platform from `outside`, coming from a pose nearby with joint angles `q`.
pub(super) fn what_stops(
    robot: &Robot<f64>,
    reach: &Reach,
    q: &[f64; 3],
    outside: &Vector3<f64>,
) -> Limit {
    if let Err(error) = robot.inverse(outside) {
        return match error {
            KinematicsError::Unreachable(arm) => Limit::Serial(arm),
            error => error.into(),
        };
    }
    let Some(there) = face::branch(robot, outside, q) else {
        return Limit::NonFinite(ArmIndex::First);
    };
    let there = there.map(|q| reach.in_turn(q));
    match reach.allows(robot, outside, &there) {
        Err(Limit::Parallel(arm)) if face::elbows_turned_over(robot, q, &there) => {
            Limit::Assembly(arm)
        }
        Err(Limit::Parallel(_)) | Ok(()) => Limit::Parallel(face::flattest(robot, outside, &there)),
        Err(limit) => limit,
    }
}
