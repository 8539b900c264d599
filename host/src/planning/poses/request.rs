//! Which poses are wanted.

use super::region::Region;
use crate::files::robot_file::RobotFile;
use crate::fit::options::CalibrationMethod;
use crate::planning::design::Criterion;

/// Fewer poses determine no arm: it has eight parameters, and a pose is one equation of each.
pub const LEAST_POSES: usize = 8;
/// As many as a plan may have.
pub const MOST_POSES: usize = 500;

/// Which poses are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanRequest<'a> {
    /// The robot as it is known, its limits, and what is stated of noise and tolerance.
    pub robot: &'a RobotFile,
    /// How many poses.
    pub count: usize,
    /// How the robot will be calibrated.
    pub method: CalibrationMethod,
    /// What the poses are judged by.
    pub criterion: Criterion,
    /// Where the platform may be; anywhere if `None`.
    pub region: Option<Region>,
    /// The same seed gives the same poses.
    pub seed: u64,
}

impl<'a> PlanRequest<'a> {
    /// Twenty poses anywhere, for the joint method.
    pub fn new(robot: &'a RobotFile) -> Self {
        Self {
            robot,
            count: 20,
            method: CalibrationMethod::default(),
            criterion: Criterion::default(),
            region: None,
            seed: 1,
        }
    }
}
