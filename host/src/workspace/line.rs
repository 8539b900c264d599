//! Straight lines through the workspace: where they are inside.
//!
//! Beside evenly spaced places, a line is looked at on both sides of where it meets the spheres and
//! planes of the limits, in closed form, and between two places that different limits forbid: a thin
//! piece lies where one limit ends and the other begins. A piece shorter than the spacing can be missed
//! only if it has both ends at singularities of one kind.

use super::Workspace;
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// Ends are found to this part of the tolerance; the rest is left for rounding.
pub(super) const PART: f64 = 1.0 / 64.0;

/// Pieces of a line that are inside: their first and last reachable places, mm from the line's
/// beginning, in order.
pub(super) type Intervals = Vec<(f64, f64)>;

impl Workspace {
    /// The pieces of all lines of the grid along an axis.
    pub(super) fn lines_along(&self, axis: usize) -> Vec<Intervals> {
        let (direction, length) = (Vector3::ith(axis, 1.0), self.grid.length(axis));
        (0..self.grid.lines(axis))
            .into_par_iter()
            .map(|line| {
                let origin = self.grid.node(self.grid.beginning(line, axis));
                self.pieces(&origin, &direction, length)
            })
            .collect()
    }

    /// The pieces of the line from `origin` along the unit vector `direction` of this length.
    pub(super) fn pieces(
        &self,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        length: f64,
    ) -> Intervals {
        let fault = |way: f64| {
            let x = origin + direction * way;
            self.reach.any_joints(&self.robot, &x).err()
        };
        let edge = |inside: f64, outside: f64| {
            bisected(
                |way| fault(way).is_none(),
                inside,
                outside,
                self.tolerance * PART,
            )
        };
        let mut pieces = Intervals::new();
        let mut places = self.places(origin, direction, length).into_iter();
        let Some(mut before) = places.next() else {
            return pieces;
        };
        let (mut forbidden, mut entered) = (fault(before), before);
        for place in places {
            let fault_there = fault(place);
            match (forbidden, fault_there) {
                (Some(_), None) => entered = edge(place, before),
                (None, Some(_)) => pieces.push((entered, edge(before, place))),
                (Some(here), Some(there)) if here != there => {
                    let (mut low, mut high) = (before, place);
                    while high - low > self.tolerance {
                        let middle = f64::midpoint(low, high);
                        match fault(middle) {
                            None => {
                                pieces.push((edge(middle, low), edge(middle, high)));
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
            pieces.push((entered, before));
        }
        pieces
    }

    /// Where to look, in order.
    fn places(&self, origin: &Vector3<f64>, direction: &Vector3<f64>, length: f64) -> Vec<f64> {
        let nodes = (0..).map(|node| self.grid.way(node));
        let mut places: Vec<f64> = nodes.take_while(|way| *way < length).collect();
        places.push(length);
        let mut beside = |way: f64| {
            let sides = [way - self.tolerance, way + self.tolerance];
            places.extend(
                sides
                    .into_iter()
                    .filter(|side| *side > 0.0 && *side < length),
            );
        };
        let limits = &self.reach.limits;
        for arm in self.robot.arms() {
            for q in [limits.minimum(), limits.maximum()] {
                // |origin + t direction − B|² = Lb².
                let w = origin - arm.elbow(q);
                let middle = -w.dot(direction);
                let squared = middle * middle - w.norm_squared() + arm.lb() * arm.lb();
                if squared >= 0.0 {
                    beside(middle - squared.sqrt());
                    beside(middle + squared.sqrt());
                }
            }
            if let Some(limit) = self.reach.forearm_limit {
                // (origin + t direction − D)·ey = ± Lb sin β.
                let axis = &arm.basis().ey;
                let out = (origin - arm.d()).dot(axis);
                let ways = [-1.0, 1.0]
                    .map(|side| (side * arm.lb() * limit.sin() - out) / direction.dot(axis));
                ways.into_iter()
                    .filter(|way| way.is_finite())
                    .for_each(&mut beside);
            }
        }
        places.sort_by(f64::total_cmp);
        places
    }
}

/// The last place from `inside` towards `outside` that is inside, to this tolerance.
pub(super) fn bisected(
    is_inside: impl Fn(f64) -> bool,
    mut inside: f64,
    mut outside: f64,
    tolerance: f64,
) -> f64 {
    while (outside - inside).abs() > tolerance {
        let middle = f64::midpoint(inside, outside);
        if middle.to_bits() == inside.to_bits() || middle.to_bits() == outside.to_bits() {
            break;
        }
        if is_inside(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

/// What two lists of intervals have in common.
pub(super) fn intersection(a: &Intervals, b: &Intervals) -> Intervals {
    let both = a
        .iter()
        .flat_map(|a| b.iter().map(move |b| (a.0.max(b.0), a.1.min(b.1))));
    both.filter(|(from, to)| from < to).collect()
}
