//! Which crossings of a cell's edges belong to one sheet of the boundary.
//!
//! Two crossings on a face of a cell are joined. Of four, where two reachable corners stand across from each
//! other, those beside the same unreachable corner are joined, so that a part thinner than a cell stays
//! connected; in a thin gap those beside the same reachable corner, so that the gap stays open. Both cells of a face
//! join the same crossings. So each join belongs to two cells, a crossing to four sheets, and the sheets around
//! each sheet make a ring: what is dual to them is a closed surface without branches. It has two edges between
//! the same two vertices only where both joins of a face belong to one sheet in each cell; there the other two
//! pairs are joined, which parts that sheet in two.

use super::lattice::{Crossing, Lattice};
use rayon::slice::ParallelSliceMut;
use std::collections::BTreeSet;

/// The sheets, and of which four each crossing is: counter-clockwise seen from its edge's far end.
#[derive(Debug)]
pub(super) struct Sheets {
    /// The crossings of each.
    pub(super) crossings: Vec<Vec<usize>>,
    pub(super) around: Vec<[usize; 4]>,
}

/// How far the four cells about an edge begin before it, along the two other axes.
const BEFORE: [(usize, usize); 4] = [(1, 1), (0, 1), (0, 0), (1, 0)];

/// A face of two cells: the lowest of its nodes, and the axis across it.
type FaceOfCells = (usize, usize);

impl Sheets {
    pub(super) fn of(lattice: &Lattice<'_>, crossings: &[Crossing]) -> Self {
        let mut members: Vec<(usize, usize, usize)> = Vec::with_capacity(4 * crossings.len());
        for (number, crossing) in crossings.iter().enumerate() {
            for (slot, (before_b, before_c)) in BEFORE.into_iter().enumerate() {
                let mut steps = [0; 3];
                steps[(crossing.axis + 1) % 3] = before_b;
                steps[(crossing.axis + 2) % 3] = before_c;
                // The outermost nodes are not reachable, so that there is a cell on each side.
                let back = lattice.next(0, steps);
                members.push((crossing.node - back, number, slot));
            }
        }
        members.par_sort_unstable();
        let mut turned = BTreeSet::new();
        loop {
            let (sheets, doubled) = Self::joined(lattice, crossings, &members, &turned);
            if doubled.is_empty() {
                return sheets;
            }
            // One face of a cell at a time: each turn parts a sheet of both its cells, so that this ends.
            let mut cells = BTreeSet::new();
            for (node, axis) in doubled {
                let mut steps = [0; 3];
                steps[axis] = 1;
                let both = [node, node - lattice.next(0, steps)];
                if both.iter().all(|cell| !cells.contains(cell)) {
                    cells.extend(both);
                    if !turned.remove(&(node, axis)) {
                        turned.insert((node, axis));
                    }
                }
            }
        }
    }

    /// The sheets, and the faces of which both joins are of one sheet in each cell.
    fn joined(
        lattice: &Lattice<'_>,
        crossings: &[Crossing],
        members: &[(usize, usize, usize)],
        turned: &BTreeSet<FaceOfCells>,
    ) -> (Self, Vec<FaceOfCells>) {
        let mut sheets = Self {
            crossings: Vec::new(),
            around: vec![[0; 4]; crossings.len()],
        };
        let (mut once, mut doubled) = (BTreeSet::new(), Vec::new());
        for of_cell in members.chunk_by(|a, b| a.0 == b.0) {
            let mut cell = Cell::of(of_cell[0].0);
            for face in cell.join(lattice, turned) {
                if !once.insert(face) {
                    doubled.push(face);
                }
            }
            let mut numbers = [None; 12];
            for (_, number, slot) in of_cell {
                let (axis, (b, c)) = (crossings[*number].axis, BEFORE[*slot]);
                let root = cell.root(edge(axis, b, c));
                let sheet = *numbers[root].get_or_insert_with(|| {
                    sheets.crossings.push(Vec::new());
                    sheets.crossings.len() - 1
                });
                sheets.crossings[sheet].push(*number);
                sheets.around[*number][*slot] = sheet;
            }
        }
        (sheets, doubled)
    }
}

/// The number of a cell's edge along an axis, at 0 or 1 along the two axes after it.
const fn edge(axis: usize, b: usize, c: usize) -> usize {
    4 * axis + b + 2 * c
}

/// A cell's edges, joined to sheets.
struct Cell {
    node: usize,
    /// An edge of the same sheet, or the edge itself.
    joined: [usize; 12],
}

impl Cell {
    fn of(node: usize) -> Self {
        Self {
            node,
            joined: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11],
        }
    }

    fn root(&self, mut edge: usize) -> usize {
        while self.joined[edge] != edge {
            edge = self.joined[edge];
        }
        edge
    }

    /// Joins the crossings on every face; returns the faces of which both joins are of one sheet.
    fn join(&mut self, lattice: &Lattice<'_>, turned: &BTreeSet<FaceOfCells>) -> Vec<FaceOfCells> {
        let mut of_four = Vec::new();
        for axis in 0..3 {
            let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
            for side in 0..2 {
                let at = |at_b, at_c| {
                    let mut steps = [0; 3];
                    (steps[axis], steps[b], steps[c]) = (side, at_b, at_c);
                    lattice.next(self.node, steps)
                };
                let corners = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
                let inside = corners.map(|corner| lattice.is_inside(corner));
                // From each corner to the next. An edge along b has c before the axis after it.
                let edges = [
                    edge(b, 0, side),
                    edge(c, side, 1),
                    edge(b, 1, side),
                    edge(c, side, 0),
                ];
                let crossed: Vec<usize> = (0..4)
                    .filter(|at| inside[*at] != inside[(at + 1) % 4])
                    .collect();
                match crossed[..] {
                    [one, other] => self.merge(edges[one], edges[other]),
                    [_, _, _, _] => {
                        let face = (corners[0], axis);
                        let thin = |state: bool| {
                            let of_state = (0..4).filter(|at| inside[*at] == state);
                            of_state.filter(|at| lattice.is_moved(corners[*at])).count()
                        };
                        let alone = (thin(false) > thin(true)) != turned.contains(&face);
                        for corner in (0..4).filter(|corner| inside[*corner] == alone) {
                            self.merge(edges[corner], edges[(corner + 3) % 4]);
                        }
                        of_four.push((face, edges));
                    }
                    _ => {}
                }
            }
        }
        of_four.retain(|(_, edges)| self.root(edges[0]) == self.root(edges[2]));
        of_four.into_iter().map(|(face, _)| face).collect()
    }

    fn merge(&mut self, one: usize, other: usize) {
        let (one, other) = (self.root(one), self.root(other));
        self.joined[one.max(other)] = one.min(other);
    }
}
