//! The grid of lines through the workspace's bounding box.

use super::Workspace;
use crate::cores;
use crate::geometry::{Limit, Reach, SWEPT, sweep};
use crate::order;
use delta_cal::Robot;
use nalgebra::Vector3;

/// Lines across the longest side if no spacing is set.
pub(super) const LINES: f64 = 80.0;
/// Margin of nodes on each side of the swept box, which may be slightly too small.
const MARGIN: f64 = 2.0;
/// Nodes of the largest grid.
const LARGEST: f64 = 6e7;

/// Equally spaced lines parallel to the axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Position of the first node, mm.
    pub origin: Vector3<f64>,
    /// Distance between neighbouring nodes, mm.
    pub spacing: f64,
    /// Number of nodes along x, y and z.
    pub counts: [usize; 3],
}

impl Grid {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // checked before
    pub(super) fn between(
        low: &Vector3<f64>,
        high: &Vector3<f64>,
        spacing: f64,
    ) -> Result<Self, WorkspaceError> {
        let counts = (high - low).map(|side| (side / spacing).ceil() + 2.0 + 2.0 * MARGIN);
        if !(counts.product() <= LARGEST) {
            let least = ((high - low).product() / LARGEST).cbrt() * 1.1;
            return Err(WorkspaceError::TooFine { spacing, least });
        }
        // Multiples of the spacing plus an odd fraction of it, so that no node lies on a robot's symmetry plane or on a
        // limit at a round number.
        let odd = Vector3::new(0.317, 0.433, 0.241);
        let first = low.zip_map(&odd, |low, odd| (low / spacing).floor() - odd);
        Ok(Self {
            origin: first.add_scalar(1.0 - MARGIN) * spacing,
            spacing,
            counts: counts.data.0[0].map(|count| count as usize),
        })
    }

    /// A node's position, mm.
    pub fn node(&self, place: [usize; 3]) -> Vector3<f64> {
        self.origin + Vector3::from(place.map(|index| self.way(index)))
    }

    /// Distance from a line's start to the node with this index, mm.
    pub(super) fn way(&self, index: usize) -> f64 {
        index as f64 * self.spacing
    }

    /// Distance from the first to the last node along an axis, mm.
    pub(super) fn length(&self, axis: usize) -> f64 {
        self.way(self.counts[axis] - 1)
    }

    /// Number of lines along an axis.
    pub(super) fn lines(&self, axis: usize) -> usize {
        self.counts[(axis + 1) % 3] * self.counts[(axis + 2) % 3]
    }

    /// Index of the line along `axis` through a node.
    pub(super) fn line_of(&self, place: [usize; 3], axis: usize) -> usize {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        place[b] + self.counts[b] * place[c]
    }

    /// The first node of a line along an axis.
    pub(super) fn beginning(&self, line: usize, axis: usize) -> [usize; 3] {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut place = [0; 3];
        (place[b], place[c]) = (line % self.counts[b], line / self.counts[b]);
        place
    }

    /// Every `stride`th node along each axis.
    pub(super) fn places(&self, stride: usize) -> impl Iterator<Item = [usize; 3]> {
        let [nx, ny, nz] = self.counts;
        let each = move |count: usize| (0..count).step_by(stride);
        each(nz).flat_map(move |k| each(ny).flat_map(move |j| each(nx).map(move |i| [i, j, k])))
    }
}

/// The bounding box of all positions in a sweep of the forward model over the joints' range.
pub(super) fn swept_box(
    robot: &Robot<f64>,
    reach: &Reach,
) -> Result<(Vector3<f64>, Vector3<f64>), WorkspaceError> {
    let none = Vector3::repeat(f64::INFINITY);
    let (mut low, mut high) = (none, -none);
    let mut forearms_forbid = 0;
    for q in sweep(reach) {
        match reach.position(robot, &q) {
            Ok(x) => (low, high) = (low.inf(&x), high.sup(&x)),
            Err(Limit::Forearm(_)) => forearms_forbid += 1,
            Err(_) => {}
        }
    }
    match forearms_forbid {
        _ if low.x <= high.x => Ok((low, high)),
        0 => Err(WorkspaceError::Apart),
        _ => Err(WorkspaceError::Empty { forearms_forbid }),
    }
}

/// Why a workspace cannot be computed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WorkspaceError {
    /// The forearms meet at no pose of the forward sweep.
    #[error(
        "the workspace is empty: the forearms meet at none of {SWEPT} poses within the joint limits"
    )]
    Apart,
    /// No pose of the forward sweep is reachable.
    #[error(
        "the workspace is empty: forearm_max_deg forbids all {forearms_forbid} poses at which the forearms meet"
    )]
    Empty {
        /// Number of poses that only the ball joints forbid.
        forearms_forbid: u32,
    },
    /// No line meets the workspace: it is too thin.
    #[error("the workspace is thinner than the line spacing of {spacing:.3} mm")]
    Thin {
        /// Line spacing, mm.
        spacing: f64,
    },
    /// The grid would have too many nodes.
    // The minimum is rounded up so that it is accepted.
    #[error(
        "--spacing {spacing}mm is too small for this workspace: the minimum is {:.2}mm",
        (least * 100.0).ceil() / 100.0
    )]
    TooFine {
        /// The requested spacing, mm.
        spacing: f64,
        /// The smallest accepted spacing, mm.
        least: f64,
    },
}

impl WorkspaceError {
    /// What to do next.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::Apart => {
                "check the lengths (in mm), the arms' azimuths and min_deg, max_deg in [joints]"
            }
            Self::Empty { .. } => "increase forearm_max_deg in [joints], or delete the line",
            Self::Thin { .. } => "set a smaller --spacing, or wider limits in [joints]",
            Self::TooFine { .. } => "set a larger --spacing, or omit it",
        }
    }
}

/// Bisection stops at this fraction of the tolerance; the rest is a margin for rounding.
pub(super) const PART: f64 = 1.0 / 64.0;

/// The reachable intervals of a line, in order: first and last reachable point, mm from its start.
pub(super) type Intervals = Vec<(f64, f64)>;

impl Workspace {
    pub(super) fn lines_along(&self, axis: usize) -> Vec<Intervals> {
        let (direction, length) = (Vector3::ith(axis, 1.0), self.grid.length(axis));
        cores::map(0..self.grid.lines(axis), |line| {
            let origin = self.grid.node(self.grid.beginning(line, axis));
            self.pieces(&origin, &direction, length)
        })
    }

    /// The reachable intervals of a line from `origin` along the unit vector `direction`.
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

    /// Positions to test along a line, in order: the grid nodes, and both sides of each intersection with a limit.
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
        order::sort(&mut places);
        places
    }
}

/// The last position from `inside` towards `outside` that is inside, to within `tolerance`.
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

/// The intersection of two lists of intervals.
pub(super) fn intersection(a: &Intervals, b: &Intervals) -> Intervals {
    let both = a
        .iter()
        .flat_map(|a| b.iter().map(move |b| (a.0.max(b.0), a.1.min(b.1))));
    both.filter(|(from, to)| from < to).collect()
}
