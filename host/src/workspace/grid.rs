//! A grid of lines through the box that holds the workspace.

use crate::geometry::reach::{Limit, Reach};
use crate::geometry::sweep::{SWEPT, sweep};
use delta_cal::Robot;
use nalgebra::Vector3;
use std::fmt;

/// Lines across the longest side, if no spacing is given.
pub(super) const LINES: f64 = 80.0;
/// Nodes beyond the box that the sweep found, at each side; the sweep may miss a little.
const MARGIN: f64 = 2.0;
/// Nodes of the largest grid.
const LARGEST: f64 = 6e7;

/// Lines parallel to the axes, all of the same distance from their neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Its first node, mm.
    pub origin: Vector3<f64>,
    /// Between neighbouring nodes, mm.
    pub spacing: f64,
    /// Nodes along x, y and z.
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
        // Whole multiples of the spacing plus an odd part of it: the planes of a robot's symmetry,
        // and its limits in round numbers, do not fall on nodes.
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

    /// From a line's beginning to its node of this index, mm.
    #[allow(clippy::cast_precision_loss)] // some hundreds
    pub(super) fn way(&self, index: usize) -> f64 {
        index as f64 * self.spacing
    }

    /// From the first to the last node along an axis, mm.
    pub(super) fn length(&self, axis: usize) -> f64 {
        self.way(self.counts[axis] - 1)
    }

    /// How many lines there are along an axis.
    pub(super) fn lines(&self, axis: usize) -> usize {
        self.counts[(axis + 1) % 3] * self.counts[(axis + 2) % 3]
    }

    /// Which of the lines along an axis goes through a node.
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

/// The box of all positions of the forward model swept over the joints' range.
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
    if low.x <= high.x {
        Ok((low, high))
    } else {
        Err(WorkspaceError::Empty { forearms_forbid })
    }
}

/// Why there is no workspace to speak of.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum WorkspaceError {
    /// No pose of the forward sweep is reachable.
    Empty {
        /// How many of them only the ball joints forbid.
        forearms_forbid: u32,
    },
    /// The workspace is so thin that no line meets it.
    Thin {
        /// The lines' spacing, mm.
        spacing: f64,
    },
    /// The grid would have too many nodes.
    TooFine {
        /// The spacing asked for, mm.
        spacing: f64,
        /// The smallest possible, mm.
        least: f64,
    },
}

impl fmt::Display for WorkspaceError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty { forearms_forbid: 0 } => write!(
                formatter,
                "the workspace is empty: at none of {SWEPT} poses within the joint limits do the \
                 forearms meet"
            ),
            Self::Empty { forearms_forbid } => write!(
                formatter,
                "the workspace is empty: forearm_max_deg forbids all {forearms_forbid} poses at \
                 which the forearms meet"
            ),
            Self::Thin { spacing } => write!(
                formatter,
                "the workspace is thinner than the line spacing of {spacing:.3} mm"
            ),
            Self::TooFine { spacing, least } => write!(
                formatter,
                "--spacing {spacing}mm is too small for this workspace: the minimum is {:.2}mm",
                // Rounded up, so that it works.
                (least * 100.0).ceil() / 100.0
            ),
        }
    }
}

impl std::error::Error for WorkspaceError {}

impl WorkspaceError {
    /// What to do next.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::Empty { forearms_forbid: 0 } => {
                "check the lengths (in mm), the arms' azimuths and min_deg, max_deg in [joints]"
            }
            Self::Empty { .. } => "increase forearm_max_deg in [joints], or delete the line",
            Self::Thin { .. } => "set a smaller --spacing, or wider limits in [joints]",
            Self::TooFine { .. } => "set a larger --spacing, or omit it",
        }
    }
}
