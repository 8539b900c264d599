//! The nodes of a grid of lines, and which of them are reachable.

use super::error::WorkspaceError;
use crate::geometry::reach::{Limit, Reach};
use crate::geometry::sweep::{SWEPT, sweep};
use delta_cal::Robot;
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// Lines across the longest side, if no spacing is given.
const LINES: f64 = 80.0;
/// Nodes beyond the box that the sweep found, at each side; the sweep may miss a little.
const MARGIN: f64 = 2.0;
/// Nodes of the largest grid.
const LARGEST: f64 = 6e7;

/// Pieces of a line that are reachable: from and to, mm from its beginning, in order.
pub(super) type Intervals = Vec<(f64, f64)>;

/// A grid of lines parallel to the axes. Its outermost nodes are not reachable.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Its first node, mm.
    pub origin: Vector3<f64>,
    /// Between neighbouring nodes, mm.
    pub spacing: f64,
    /// Nodes along x, y and z.
    pub counts: [usize; 3],
    reachable: Vec<bool>,
}

impl Grid {
    /// The grid that holds the whole workspace.
    pub(super) fn of(
        robot: &Robot<f64>,
        reach: &Reach,
        spacing: Option<f64>,
    ) -> Result<Self, WorkspaceError> {
        let (mut low, mut high) = swept_box(robot, reach)?;
        let longest = (high - low).max();
        let spacing = spacing.unwrap_or(longest / LINES);
        loop {
            let grid = Self::between(&low, &high, spacing)?;
            let grid = grid.filled(robot, reach);
            let Some(sides) = grid.reachable_sides() else {
                return Err(WorkspaceError::Thin { spacing });
            };
            // What the sweep missed.
            let grow = 4.0 * spacing + 0.1 * longest;
            for axis in 0..3 {
                low[axis] -= if sides[axis][0] { grow } else { 0.0 };
                high[axis] += if sides[axis][1] { grow } else { 0.0 };
            }
            if sides == [[false; 2]; 3] {
                return Ok(grid);
            }
        }
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // checked before
    fn between(
        low: &Vector3<f64>,
        high: &Vector3<f64>,
        spacing: f64,
    ) -> Result<Self, WorkspaceError> {
        let counts = (high - low).map(|side| (side / spacing).ceil() + 1.0 + 2.0 * MARGIN);
        if !(counts.product() <= LARGEST) {
            let least = ((high - low).product() / LARGEST).cbrt() * 1.1;
            return Err(WorkspaceError::TooFine { spacing, least });
        }
        // Whole multiples of the spacing plus an odd part of it: the planes of a robot's symmetry,
        // and its limits in round numbers, do not fall on nodes.
        let odd = Vector3::new(0.317, 0.433, 0.241);
        let first = low.zip_map(&odd, |low, odd| (low / spacing).floor() - odd);
        let [nx, ny, nz] = counts.data.0[0].map(|count| count as usize + 1);
        Ok(Self {
            origin: (first.add_scalar(-(MARGIN - 1.0))) * spacing,
            spacing,
            counts: [nx, ny, nz],
            reachable: Vec::new(),
        })
    }

    fn filled(mut self, robot: &Robot<f64>, reach: &Reach) -> Self {
        let nodes = self.counts.iter().product::<usize>();
        let grid = &self;
        self.reachable = (0..nodes)
            .into_par_iter()
            .map(|node| {
                reach
                    .any_joints(robot, &grid.node(grid.place(node)))
                    .is_ok()
            })
            .collect();
        self
    }

    /// Whether any node of the first and last layer of each axis is reachable; `None` if no node is.
    fn reachable_sides(&self) -> Option<[[bool; 2]; 3]> {
        let mut sides = [[false; 2]; 3];
        let mut any = false;
        for (node, _) in self.reachable.iter().enumerate().filter(|(_, r)| **r) {
            any = true;
            let place = self.place(node);
            for axis in 0..3 {
                sides[axis][0] |= place[axis] == 0;
                sides[axis][1] |= place[axis] + 1 == self.counts[axis];
            }
        }
        any.then_some(sides)
    }

    /// Indices along x, y and z of the node at `index`.
    pub(super) fn place(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.counts;
        [index % nx, index / nx % ny, index / nx / ny]
    }

    /// The index of the node at these indices along x, y and z.
    pub(super) fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        let [nx, ny, _] = self.counts;
        i + nx * (j + ny * k)
    }

    /// Nodes in all.
    pub fn len(&self) -> usize {
        self.reachable.len()
    }

    /// Whether there is no node; there always is.
    pub fn is_empty(&self) -> bool {
        self.reachable.is_empty()
    }

    /// A node's position, mm.
    #[allow(clippy::cast_precision_loss)] // some hundreds
    pub fn node(&self, [i, j, k]: [usize; 3]) -> Vector3<f64> {
        self.origin + Vector3::new(i as f64, j as f64, k as f64) * self.spacing
    }

    /// Whether a node is reachable; what is outside the grid is not.
    pub fn is_reachable(&self, place: [usize; 3]) -> bool {
        let within = place.iter().zip(self.counts).all(|(at, count)| *at < count);
        within && self.reachable[self.index(place)]
    }
}

/// The box of all positions of the forward model swept over the joints' range.
fn swept_box(
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
    if low.x <= high.x {
        Ok((low, high))
    } else {
        Err(WorkspaceError::Empty {
            poses: SWEPT,
            forearms_forbid,
        })
    }
}
