//! The lattice that is meshed: the grid, with nodes moved into what is thinner than its spacing.
//!
//! Towards a sharp rim the workspace is thinner than the spacing, and it is chance whether a node lies in it:
//! the rim would be saw-toothed, and pieces of it would be separate. The same holds for the bottom of a groove.
//! The lines of the grid show thin pieces and gaps. The node next to one is moved into it, along the line.

use crate::workspace::boundary::{self, BoundaryPoint};
use crate::workspace::reachable::Workspace;
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::collections::BTreeMap;

/// Nodes that are reachable or not, and where those are that have been moved.
#[derive(Debug)]
pub(super) struct Lattice<'a> {
    pub(super) workspace: &'a Workspace,
    inside: Vec<bool>,
    moved: BTreeMap<usize, Vector3<f64>>,
}

/// Where an edge of the lattice passes the boundary.
#[derive(Debug)]
pub(super) struct Crossing {
    /// The edge's first node.
    pub(super) node: usize,
    /// The edge's axis: 0, 1, 2 for x, y, z.
    pub(super) axis: usize,
    /// Whether the second node is the one that is not reachable.
    pub(super) leaves: bool,
    pub(super) point: BoundaryPoint,
}

impl<'a> Lattice<'a> {
    pub(super) fn of(workspace: &'a Workspace) -> Self {
        let grid = &workspace.grid;
        let inside: Vec<bool> = (0..grid.len())
            .map(|node| grid.is_reachable(grid.place(node)))
            .collect();
        // Of several places that a node could be moved to, the nearest.
        let mut nearest: BTreeMap<usize, (f64, Vector3<f64>)> = BTreeMap::new();
        for (axis, lines) in workspace.lines().iter().enumerate() {
            let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
            for (line, pieces) in lines.iter().enumerate() {
                let gaps = pieces.windows(2).map(|pair| (pair[0].1, pair[1].0));
                for piece in pieces.iter().copied().chain(gaps) {
                    let Some((at, shift)) = beside(piece, grid.spacing) else {
                        continue;
                    };
                    let mut place = [0; 3];
                    (place[b], place[c]) = (line % grid.counts[b], line / grid.counts[b]);
                    place[axis] = at;
                    // The outermost stay, so that every edge has four cells.
                    let inner =
                        |axis: usize| place[axis] > 0 && place[axis] + 1 < grid.counts[axis];
                    let node = grid.index(place);
                    let to = grid.node(place) + Vector3::ith(axis, shift);
                    let nearer = nearest
                        .get(&node)
                        .is_none_or(|(other, _)| shift.abs() < *other);
                    if nearer && (0..3).all(inner) && inside[node] != workspace.contains(&to) {
                        nearest.insert(node, (shift.abs(), to));
                    }
                }
            }
        }
        let mut lattice = Self {
            workspace,
            inside,
            moved: BTreeMap::new(),
        };
        for (node, (_, to)) in nearest {
            lattice.inside[node] = !lattice.inside[node];
            lattice.moved.insert(node, to);
        }
        lattice
    }

    /// Whether a node is reachable where it is now.
    pub(super) fn is_inside(&self, node: usize) -> bool {
        self.inside[node]
    }

    /// Whether a node was moved into what is thinner than the spacing.
    pub(super) fn is_moved(&self, node: usize) -> bool {
        self.moved.contains_key(&node)
    }

    /// The node `steps` nodes further along each axis.
    pub(super) fn next(&self, node: usize, steps: [usize; 3]) -> usize {
        let [nx, ny, _] = self.workspace.grid.counts;
        node + steps[0] + nx * (steps[1] + ny * steps[2])
    }

    fn position(&self, node: usize) -> Vector3<f64> {
        let grid = &self.workspace.grid;
        let moved = self.moved.get(&node).copied();
        moved.unwrap_or_else(|| grid.node(grid.place(node)))
    }

    /// All of them. Where no node was moved they are the points of the workspace.
    pub(super) fn crossings(&self) -> Vec<Crossing> {
        let workspace = self.workspace;
        let known = boundary::edges(&workspace.grid).zip(&workspace.points);
        let known = known.filter_map(|((node, axis), point)| {
            let ends = [node, self.along(node, axis)];
            let kept = ends.iter().all(|end| !self.moved.contains_key(end));
            kept.then(|| Crossing {
                node,
                axis,
                leaves: self.inside[node],
                point: *point,
            })
        });
        let mut crossings: Vec<Crossing> = known.collect();
        let edges = self.moved.keys().flat_map(|moved| {
            (0..3).flat_map(move |axis| {
                let before = moved - (self.along(*moved, axis) - moved);
                [(*moved, axis), (before, axis)]
            })
        });
        let mut edges: Vec<(usize, usize)> = edges
            .filter(|(node, axis)| self.inside[*node] != self.inside[self.along(*node, *axis)])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        let crossing = |(node, axis): (usize, usize)| {
            let (leaves, next) = (self.inside[node], self.along(node, axis));
            let (from, to) = if leaves { (node, next) } else { (next, node) };
            let ends = (self.position(from), self.position(to));
            Crossing {
                node,
                axis,
                leaves,
                point: boundary::between(
                    &workspace.robot,
                    &workspace.reach,
                    ends,
                    workspace.tolerance,
                ),
            }
        };
        let new: Vec<Crossing> = edges.into_par_iter().map(crossing).collect();
        crossings.extend(new);
        crossings
    }

    fn along(&self, node: usize, axis: usize) -> usize {
        let mut steps = [0; 3];
        steps[axis] = 1;
        self.next(node, steps)
    }
}

/// The node next to the middle of a piece or gap between two nodes, and how far that middle is from it.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss
)] // nodes of a line, some hundreds
fn beside((from, to): (f64, f64), spacing: f64) -> Option<(usize, f64)> {
    if (from / spacing).floor() < (to / spacing).floor() {
        return None;
    }
    let middle = f64::midpoint(from, to);
    let node = (middle / spacing).round();
    Some((node as usize, middle - node * spacing))
}
