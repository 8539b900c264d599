//! Straight lines through the workspace: where they are inside.
//!
//! Beside evenly spaced places, a line is looked at on both sides of where it meets the spheres and
//! planes of the limits, in closed form, and between two places that different limits forbid: a thin
//! piece lies where one limit ends and the other begins. A piece shorter than the spacing can be missed
//! only if it has both ends at singularities of one kind.

use super::Workspace;
use super::boundary::bisect;
use super::grid::Intervals;
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

impl Workspace {
    /// The reachable pieces of all lines of the grid along x, y and z. A line along x is at y + `counts.y` z, those
    /// along the other axes cyclically.
    pub(super) fn lines(&self) -> &[Vec<Intervals>; 3] {
        self.pieces.get_or_init(|| of_grid(self))
    }
}

#[allow(clippy::cast_precision_loss)] // some hundreds
fn of_grid(workspace: &Workspace) -> [Vec<Intervals>; 3] {
    let counts = workspace.grid.counts;
    [0, 1, 2].map(|axis| {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let length = (counts[axis] - 1) as f64 * workspace.grid.spacing;
        let direction = Vector3::ith(axis, 1.0);
        let line = |index: usize| {
            let mut place = [0; 3];
            (place[b], place[c]) = (index % counts[b], index / counts[b]);
            let origin = workspace.grid.node(place);
            intervals(workspace, &origin, &direction, length)
        };
        let lines = 0..counts[b] * counts[c];
        lines.into_par_iter().map(line).collect()
    })
}

/// The reachable pieces of the line from `origin` along the unit vector `direction` of this length.
/// Each end is within the tolerance.
pub(super) fn intervals(
    workspace: &Workspace,
    origin: &Vector3<f64>,
    direction: &Vector3<f64>,
    length: f64,
) -> Intervals {
    let at = |way: f64| origin + direction * way;
    let fault = |way: f64| {
        let joints = workspace.reach.any_joints(&workspace.robot, &at(way));
        joints.err()
    };
    let edge = |from: f64, to: f64| {
        let is_inside = |x: &Vector3<f64>| workspace.contains(x);
        let (inside, outside) = bisect(is_inside, (at(from), at(to)), workspace.tolerance / 16.0);
        ((inside + outside) * 0.5 - origin).dot(direction)
    };
    let mut intervals = Intervals::new();
    let mut places = places(workspace, origin, direction, length).into_iter();
    let Some(mut before) = places.next() else {
        return intervals;
    };
    let mut forbidden = fault(before);
    let mut entered = before;
    for place in places {
        let fault_there = fault(place);
        match (forbidden, fault_there) {
            (Some(_), None) => entered = edge(place, before),
            (None, Some(_)) => intervals.push((entered, edge(before, place))),
            (Some(here), Some(there)) if here != there => {
                let (mut low, mut high) = (before, place);
                while high - low > workspace.tolerance {
                    let middle = f64::midpoint(low, high);
                    match fault(middle) {
                        None => {
                            intervals.push((edge(middle, low), edge(middle, high)));
                            break;
                        }
                        Some(fault) if fault == here => low = middle,
                        Some(_) => high = middle,
                    }
                }
            }
            _ => {}
        }
        (before, forbidden) = (place, fault_there);
    }
    if forbidden.is_none() {
        intervals.push((entered, before));
    }
    intervals
}

/// Where to look, in order.
fn places(
    workspace: &Workspace,
    origin: &Vector3<f64>,
    direction: &Vector3<f64>,
    length: f64,
) -> Vec<f64> {
    let mut places = vec![0.0, length];
    let mut way = workspace.grid.spacing;
    while way < length {
        places.push(way);
        way += workspace.grid.spacing;
    }
    let mut beside = |way: f64| {
        let sides = [way - workspace.tolerance, way + workspace.tolerance];
        places.extend(
            sides
                .into_iter()
                .filter(|side| *side > 0.0 && *side < length),
        );
    };
    let reach = &workspace.reach;
    for arm in workspace.robot.arms() {
        for q in [reach.limits.minimum(), reach.limits.maximum()] {
            // |origin + t direction − B|² = Lb².
            let w = origin - arm.elbow(q);
            let middle = -w.dot(direction);
            let squared = middle * middle - w.norm_squared() + arm.lb() * arm.lb();
            if squared >= 0.0 {
                beside(middle - squared.sqrt());
                beside(middle + squared.sqrt());
            }
        }
        if let Some(limit) = reach.forearm_limit {
            // (origin + t direction − D)·ey = ± Lb sin β.
            let axis = &arm.basis().ey;
            let out = (origin - arm.d()).dot(axis);
            let steep = direction.dot(axis);
            for side in [-1.0, 1.0] {
                let way = (side * arm.lb() * limit.sin() - out) / steep;
                if way.is_finite() {
                    beside(way);
                }
            }
        }
    }
    places.sort_by(f64::total_cmp);
    places
}

/// What two lists of intervals have in common.
pub(super) fn intersection(a: &Intervals, b: &Intervals) -> Intervals {
    let mut common = Intervals::new();
    for (from_a, to_a) in a {
        for (from_b, to_b) in b {
            let (from, to) = (from_a.max(*from_b), to_a.min(*to_b));
            if from < to {
                common.push((from, to));
            }
        }
    }
    common
}
