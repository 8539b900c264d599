//! The reachable workspace: its boundary, the limits that form it, its size, and how it moves with the 24 parameters.
//!
//! ```text
//! Robot, Reach ─→ Grid ─→ lines, inside and outside ─→ BoundaryPoint ─→ influence of the parameters
//!                                │                └→ volume   └→ mesh ─→ STL
//!                                └→ conditioning
//! Robot, Reach ─→ largest cylinders
//! ```
//!
//! A position is reachable if the forward model leads to it from joint angles within the limits: [`Reach::any_joints`].
//! Sweeping the forward model over the joints' range gives a box that contains the workspace; along lines through it,
//! parallel to the axes, the points of entry and exit are found by bisection. The workspace may have any shape: it may
//! be hollow or consist of several parts.

mod analysis;
mod cylinder;
mod grid;
mod influence;
mod mesh;
mod surface;

use crate::geometry::Reach;
pub use analysis::{Analysis, Extent, LimitShare, Singularities};
pub use cylinder::{Cylinder, cylinders};
use delta_cal::Robot;
use grid::Intervals;
pub use grid::{Grid, WorkspaceError};
pub use influence::{Influence, ParameterInfluence, ToleranceBand, unit};
pub use mesh::Mesh;
use nalgebra::Vector3;
use serde::Serialize;
pub use surface::BoundaryPoint;

/// Resolution of the computation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Every boundary point is within this distance of the boundary, mm.
    pub tolerance: f64,
    /// Distance between neighbouring lines, mm; `None` for 1/80 of the longest side.
    pub spacing: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            spacing: None,
        }
    }
}

/// The reachable workspace of a robot.
#[derive(Debug, Clone)]
pub struct Workspace {
    /// The analysed robot.
    pub robot: Robot<f64>,
    /// Joint and forearm limits.
    pub reach: Reach,
    /// Every boundary point is within this distance of the boundary, mm.
    pub tolerance: f64,
    /// The lines along which the boundary is searched.
    pub grid: Grid,
    /// The reachable intervals of all lines along x, y and z.
    lines: [Vec<Intervals>; 3],
    /// Points of entry and exit: line by line, both ends of each interval.
    pub points: Vec<BoundaryPoint>,
}

/// A tolerance below this fraction of the workspace is rounding, which bisection would never reach.
const ROUNDING: f64 = 1e-10;

impl Workspace {
    /// Computes the boundary.
    ///
    /// ```
    /// use delta_cal_host::files::example;
    /// use delta_cal_host::workspace::{Options, Workspace};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let (robot, _) = example::load()?;
    /// let options = Options { spacing: Some(20.0), ..Options::default() };
    /// let workspace = Workspace::compute(&robot.robot, &robot.reach(), &options)?;
    /// println!("{:.1} litres", workspace.volume().litres);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// The workspace is empty, or too thin or too large for the lines.
    pub fn compute(
        robot: &Robot<f64>,
        reach: &Reach,
        options: &Options,
    ) -> Result<Self, WorkspaceError> {
        let (mut low, mut high) = grid::swept_box(robot, reach)?;
        let longest = (high - low).max();
        let spacing = options.spacing.unwrap_or(longest / grid::LINES);
        loop {
            let mut workspace = Self {
                robot: robot.clone(),
                reach: *reach,
                tolerance: options.tolerance.max(ROUNDING * longest),
                grid: Grid::between(&low, &high, spacing)?,
                lines: Default::default(),
                points: Vec::new(),
            };
            workspace.lines = [0, 1, 2].map(|axis| workspace.lines_along(axis));
            let pieces = |axis: usize| workspace.lines[axis].iter().flatten();
            if [0, 1, 2].map(|axis| pieces(axis).count()) == [0; 3] {
                return Err(WorkspaceError::Thin { spacing });
            }
            // If the workspace extends beyond the grid, the sweep missed a part: enlarge the grid.
            let grow = 4.0 * spacing + 0.1 * longest;
            let before = (low, high);
            for axis in 0..3 {
                let length = workspace.grid.length(axis);
                if pieces(axis).any(|at| at.0 <= 0.0) {
                    low[axis] -= grow;
                }
                if pieces(axis).any(|at| at.1 >= length) {
                    high[axis] += grow;
                }
            }
            if (low, high) == before {
                workspace.points = surface::points(&workspace);
                return Ok(workspace);
            }
        }
    }

    /// Whether the platform can reach a position (mm).
    pub fn contains(&self, x: &Vector3<f64>) -> bool {
        self.reach.any_joints(&self.robot, x).is_ok()
    }

    /// Whether the node at these indices is inside, according to its line along z.
    fn has_node(&self, place @ [.., z]: [usize; 3]) -> bool {
        let way = self.grid.way(z);
        let pieces = &self.lines[2][self.grid.line_of(place, 2)];
        pieces.iter().any(|(from, to)| *from <= way && way <= *to)
    }
}

/// A volume and its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Volume {
    /// The volume.
    pub litres: f64,
    /// The error due to the line spacing: the larger of the deviation between the axes from their mean, and half the
    /// rms deviation from it when only every second line is used.
    pub uncertainty_litres: f64,
    /// The area of the boundary.
    pub boundary_m2: f64,
}

impl Workspace {
    /// The volume: spacing² · Σ length of the lines inside, averaged over the axes. The three values differ only by the
    /// error due to the line spacing.
    pub fn volume(&self) -> Volume {
        let litres = self.grid.spacing.powi(2) * 1e-6;
        // Every second line in both directions: four subsets per axis.
        let quarters = [0, 1, 2].map(|axis| self.lengths_along(axis).map(|sum| sum * litres));
        let along = quarters.map(|quarters| quarters.iter().sum::<f64>());
        let volume = along.iter().sum::<f64>() / 3.0;
        let off = along.map(|along| (along - volume).abs());
        let of_quarters = quarters.as_flattened().iter();
        let squares = of_quarters.map(|quarter| (4.0 * quarter - volume).powi(2));
        let spread = (squares.sum::<f64>() / 12.0).sqrt();
        Volume {
            litres: volume,
            uncertainty_litres: off.into_iter().fold(0.5 * spread, f64::max),
            boundary_m2: self.points.iter().map(|point| point.area * 1e-6).sum(),
        }
    }

    /// The reachable length of all lines along an axis, mm, summed over the four subsets of odd and even lines.
    fn lengths_along(&self, axis: usize) -> [f64; 4] {
        let across = self.grid.counts[(axis + 1) % 3];
        let mut sums = [0.0; 4];
        for (index, pieces) in self.lines[axis].iter().enumerate() {
            let length: f64 = pieces.iter().map(|(from, to)| to - from).sum();
            sums[index % across % 2 + 2 * (index / across % 2)] += length;
        }
        sums
    }
}
