//! A correction at each node of a grid.

use super::extrapolation::extrapolated;
use super::grid::Grid;
use super::kind::{Kind, Pair};
use nalgebra::Vector3;

/// What a node holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Node {
    /// The correction there, mm or degrees.
    Computed(Vector3<f64>),
    /// The robot does not reach this node, or only near a parallel singularity, but one beside it: the correction
    /// extrapolated from the nodes around it.
    Extrapolated(Vector3<f64>),
    /// Nothing: neither the node nor one beside it can be reached.
    Empty,
}

impl Node {
    /// The correction, if there is one.
    pub const fn correction(&self) -> Option<Vector3<f64>> {
        match self {
            Self::Computed(by) | Self::Extrapolated(by) => Some(*by),
            Self::Empty => None,
        }
    }

    /// As in the files.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Computed(_) => "computed",
            Self::Extrapolated(_) => "extrapolated",
            Self::Empty => "empty",
        }
    }
}

/// To be at x the controller adds the correction at x, interpolated between the nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// What is corrected.
    pub kind: Kind,
    /// Where the nodes are.
    pub grid: Grid,
    /// Each node, z running fastest, then y.
    pub nodes: Vec<Node>,
}

impl Table {
    pub(crate) fn of(pair: &Pair<'_>, kind: Kind, grid: Grid) -> Self {
        let computed: Vec<_> = (0..grid.nodes())
            .map(|node| kind.correction(pair, &grid.position(node)))
            .collect();
        let nodes = computed.iter().enumerate().map(|(node, own)| match own {
            Some(by) => Node::Computed(*by),
            None => extrapolated(&grid, &computed, node).map_or(Node::Empty, Node::Extrapolated),
        });
        Self {
            kind,
            grid,
            nodes: nodes.collect(),
        }
    }

    /// The correction at a position; `None` where a node of the cell has none.
    pub fn interpolated(&self, at: &Vector3<f64>) -> Option<Vector3<f64>> {
        let mut sum = Vector3::zeros();
        for (node, weight) in self.grid.place(at)?.corners {
            sum += weight * self.nodes.get(node)?.correction()?;
        }
        Some(sum)
    }

    /// How far the robot is from a position at which it is wanted, mm.
    pub(crate) fn off(&self, pair: &Pair<'_>, at: &Vector3<f64>) -> Option<f64> {
        let is = self.kind.reached(pair, at, &self.interpolated(at)?)?;
        Some((is - at).norm())
    }
}
