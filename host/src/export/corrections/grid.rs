//! A grid of cubes over a box.

use crate::export::error::ExportError;
use nalgebra::Vector3;

/// More nodes than this are refused.
const MOST_NODES: usize = 2_000_000;

/// The nodes are at whole multiples of the spacing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// The node with the least coordinates, mm.
    pub origin: Vector3<f64>,
    /// Between two nodes along x, y or z, mm.
    pub spacing: f64,
    /// Nodes along x, y and z, two at least.
    pub counts: [usize; 3],
}

/// A place in a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    /// The eight nodes around it, and the weight of each.
    pub(crate) corners: [(usize, f64); 8],
}

impl Grid {
    /// Over a box.
    ///
    /// # Errors
    /// Too many nodes.
    pub(crate) fn over(
        (low, high): (Vector3<f64>, Vector3<f64>),
        spacing: f64,
    ) -> Result<Self, ExportError> {
        let mut origin = Vector3::zeros();
        let mut counts = [0; 3];
        for axis in 0..3 {
            origin[axis] = (low[axis] / spacing).floor() * spacing;
            let cells = ((high[axis] - origin[axis]) / spacing).floor() + 1.0;
            if !(cells < 1e4) {
                return Err(ExportError::TooManyNodes);
            }
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 1 to 10,000
            let cells = cells as usize;
            counts[axis] = cells + 1;
        }
        let grid = Self {
            origin,
            spacing,
            counts,
        };
        if grid.nodes() > MOST_NODES {
            return Err(ExportError::TooManyNodes);
        }
        Ok(grid)
    }

    /// How many nodes there are.
    pub fn nodes(&self) -> usize {
        self.counts.iter().product()
    }

    /// Indices of a node along x, y and z: z runs fastest, then y.
    pub(crate) const fn indices(&self, node: usize) -> [usize; 3] {
        let [_, y, z] = self.counts;
        [node / z / y, node / z % y, node % z]
    }

    /// The node at these indices.
    pub(crate) const fn node(&self, [x, y, z]: [usize; 3]) -> usize {
        let [_, along_y, along_z] = self.counts;
        (x * along_y + y) * along_z + z
    }

    /// Where a node is, mm.
    #[allow(clippy::cast_precision_loss)] // up to 10,000
    pub fn position(&self, node: usize) -> Vector3<f64> {
        self.origin + Vector3::from(self.indices(node).map(|index| index as f64)) * self.spacing
    }

    /// The centres of all cells, mm.
    pub(crate) fn centres(&self) -> impl Iterator<Item = Vector3<f64>> {
        let half = Vector3::repeat(self.spacing / 2.0);
        (0..self.nodes())
            .filter(|node| (0..3).all(|axis| self.indices(*node)[axis] + 1 < self.counts[axis]))
            .map(move |node| self.position(node) + half)
    }

    /// The nodes of the cell that a position is in, with weights that are linear along x, y and z; `None` outside.
    pub(crate) fn place(&self, at: &Vector3<f64>) -> Option<Place> {
        let place = (at - self.origin) / self.spacing;
        let cell = place.map(f64::floor);
        let part = place - cell;
        let mut low = [0; 3];
        for axis in 0..3 {
            if !(cell[axis] >= 0.0) {
                return None;
            }
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // not negative
            let index = cell[axis] as usize;
            if index + 1 >= self.counts[axis] {
                return None;
            }
            low[axis] = index;
        }
        let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|corner: usize| {
            let up = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
            let weight = |axis: usize| {
                if up[axis] == 1 {
                    part[axis]
                } else {
                    1.0 - part[axis]
                }
            };
            let node = self.node([0, 1, 2].map(|axis| low[axis] + up[axis]));
            (node, weight(0) * weight(1) * weight(2))
        });
        Some(Place { corners })
    }
}
