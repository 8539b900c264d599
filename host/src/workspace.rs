//! Where the platform gets: the boundary of the reachable workspace, what limits it, how large it
//! is, and how it moves with the 24 parameters.
//!
//! ```text
//! Robot, Reach ─→ Grid (forward sweep, then which nodes are reachable) ─→ BoundaryPoint ─→ volume
//!                                         │                                   ├→ Face ─→ influence ─→ band
//!                                         └→ Mesh ─→ STL                      └→ displacement to another robot
//! Robot, Reach ─→ largest cylinders
//! Robot, pose ─→ distance from the nearest singularity
//! ```
//!
//! A position is reachable if the forward model leads to it from joint angles within the limits:
//! [`Reach::any_joints`]. The forward model swept over the joints' range finds the box that holds
//! the workspace; lines through it, parallel to the axes, are then bisected where they enter and
//! leave. Nothing is assumed of the workspace's shape: it may be hollow, or in several parts.

mod band;
mod boundary;
mod comparison;
mod conditioning;
mod cylinder;
mod face;
mod grid;
mod influence;
mod line;
mod mesh;
mod path;
pub mod report;
mod singularities;
mod volume;

pub use band::{Band, BandOptions, PointBand, TAIL, band};
pub use boundary::BoundaryPoint;
pub use comparison::{Comparison, compare};
pub use conditioning::{ConditionedPosition, conditioning_map};
pub use cylinder::{Cylinder, cylinders};
pub use face::{ByParameters, Face};
pub use grid::Grid;
pub(crate) use grid::reaches_anywhere;
pub use influence::{ParameterInfluence, influence};
pub use mesh::Mesh;
pub use path::{PathPoint, PathRow, PathSummary, distances_of_path};
pub use singularities::{NearestSingularity, nearest_singularity};
pub use volume::Volume;

use crate::reach::Reach;
use delta_cal::Robot;
use std::fmt;

/// How finely a workspace is computed.
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

/// Why there is no workspace to speak of.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum WorkspaceError {
    /// No pose of the forward sweep is reachable.
    Empty {
        /// How many were tried.
        poses: u32,
        /// How many of them only the ball joints forbid.
        forearms_forbid: u32,
    },
    /// The workspace is so thin that no node of the grid is in it.
    Thin {
        /// The grid's spacing, mm.
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
            Self::Empty {
                poses,
                forearms_forbid: 0,
            } => write!(
                formatter,
                "the workspace is empty: the forearms meet at none of {poses} combinations of joint \
                 angles within the limits"
            ),
            Self::Empty {
                poses,
                forearms_forbid,
            } => write!(
                formatter,
                "the workspace is empty: of {poses} combinations of joint angles within the limits \
                 the forearms meet at {forearms_forbid}, and there forearm_max_deg forbids every one"
            ),
            Self::Thin { spacing } => write!(
                formatter,
                "the workspace is thinner than the distance between the lines, {spacing:.3} mm: no \
                 line meets it"
            ),
            Self::TooFine { spacing, least } => write!(
                formatter,
                "lines {spacing} mm apart would be too many for this workspace; the smallest \
                 possible distance is {least:.3} mm"
            ),
        }
    }
}

impl std::error::Error for WorkspaceError {}

impl WorkspaceError {
    /// What to do next.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::Empty {
                forearms_forbid: 0, ..
            } => "check the lengths (in mm), the arms' azimuths and min_deg, max_deg in [joints]",
            Self::Empty { .. } => "enlarge forearm_max_deg in [joints], or delete the line",
            Self::Thin { .. } => "give a smaller --spacing, or wider limits in [joints]",
            Self::TooFine { .. } => "give a larger --spacing",
        }
    }
}

/// The reachable workspace of a robot.
#[derive(Debug, Clone)]
pub struct Workspace {
    /// The robot.
    pub robot: Robot<f64>,
    /// Its limits.
    pub reach: Reach,
    /// Every boundary point is within this distance of the boundary, mm.
    pub tolerance: f64,
    /// Which nodes of a grid are reachable.
    pub grid: Grid,
    /// Where the grid's lines enter and leave.
    pub points: Vec<BoundaryPoint>,
}

impl Workspace {
    /// Computes the boundary.
    ///
    /// ```
    /// use delta_cal::{JointLimits, SymmetricRobot};
    /// use delta_cal_host::reach::Reach;
    /// use delta_cal_host::workspace::{Options, Workspace};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }
    ///     .robot()?;
    /// let limits = JointLimits::new(-60f64.to_radians(), 90f64.to_radians())?;
    /// let reach = Reach { limits, forearm_limit: None };
    /// let options = Options { spacing: Some(10.0), ..Options::default() };
    /// let workspace = Workspace::compute(&robot, &reach, &options)?;
    /// // Three upper arms straight down: the lowest point of the axis. A line passes within 10/√2 mm of it,
    /// // where the boundary is up to 164/451 as steep.
    /// let lowest = -260.0 - (480f64.powi(2) - 164f64.powi(2)).sqrt();
    /// assert!((workspace.points.iter().map(|p| p.position.z).fold(0.0, f64::min) - lowest).abs() < 3.0);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// A workspace that is empty, or too thin or too large for the lines.
    pub fn compute(
        robot: &Robot<f64>,
        reach: &Reach,
        options: &Options,
    ) -> Result<Self, WorkspaceError> {
        let grid = Grid::of(robot, reach, options.spacing)?;
        let points = boundary::points(robot, reach, &grid, options.tolerance);
        Ok(Self {
            robot: *robot,
            reach: *reach,
            tolerance: options.tolerance,
            grid,
            points,
        })
    }

    /// Whether the platform gets to a position (mm).
    pub fn contains(&self, x: &nalgebra::Vector3<f64>) -> bool {
        self.reach.any_joints(&self.robot, x).is_ok()
    }
}
