//! The reachable workspace.

use super::boundary::{self, BoundaryPoint};
use super::error::WorkspaceError;
use super::grid::{Grid, Intervals};
use super::options::Options;
use crate::geometry::reach::Reach;
use delta_cal::Robot;
use std::sync::OnceLock;

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
    /// The reachable pieces of the grid's lines along each axis, once they have been asked for.
    pub(super) pieces: OnceLock<[Vec<Intervals>; 3]>,
}

impl Workspace {
    /// Computes the boundary.
    ///
    /// ```
    /// use delta_cal::SymmetricRobot;
    /// use delta_cal::kinematics::JointLimits;
    /// use delta_cal_host::geometry::reach::Reach;
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
            pieces: OnceLock::new(),
        })
    }

    /// Whether the platform gets to a position (mm).
    pub fn contains(&self, x: &nalgebra::Vector3<f64>) -> bool {
        self.reach.any_joints(&self.robot, x).is_ok()
    }
}
