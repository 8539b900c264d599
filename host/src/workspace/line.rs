//! Straight lines through the workspace: where they are inside.
//!
//! Beside evenly spaced places, a line is looked at on both sides of where it meets the spheres and
//! planes of the limits, in closed form. So no piece is missed, however thin, that has an end at one
//! of those; one between two singularities may be, if it is shorter than the spacing.

use super::Workspace;
use super::boundary::bisect;
use nalgebra::Vector3;

/// Pieces of a line that are reachable: from and to, mm from its beginning, in order.
pub(super) type Intervals = Vec<(f64, f64)>;

/// The reachable pieces of the line from `origin` along the unit vector `direction` of this length.
/// Each end is within the tolerance.
pub(super) fn intervals(
    workspace: &Workspace,
    origin: &Vector3<f64>,
    direction: &Vector3<f64>,
    length: f64,
) -> Intervals {
    let at = |way: f64| origin + direction * way;
    let inside = |way: f64| workspace.contains(&at(way));
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
    let mut entered = inside(before).then_some(before);
    for place in places {
        match (entered, inside(place)) {
            (None, true) => entered = Some(edge(place, before)),
            (Some(from), false) => {
                intervals.push((from, edge(before, place)));
                entered = None;
            }
            _ => {}
        }
        before = place;
    }
    intervals.extend(entered.map(|from| (from, before)));
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
