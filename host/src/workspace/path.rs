//! How near a path comes to singularities.

use super::{NearestSingularity, nearest_singularity};
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Pose, read_poses};
use crate::geometry::reach::Limit;
use delta_cal::kinematics::SingularityDistance;
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// A row of the file that the robot can be at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPoint {
    /// mm.
    pub position: Vector3<f64>,
    /// Radians.
    pub q: [f64; 3],
    /// Both kinds; 0 at a singularity.
    pub conditioning: SingularityDistance<f64>,
    /// The nearest singularity.
    pub nearest: NearestSingularity,
}

impl PathPoint {
    /// The conditioning of the arm that is nearest to its singularity.
    pub fn serial(&self) -> f64 {
        self.conditioning.serial.into_iter().fold(1.0, f64::min)
    }
}

/// One row of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathRow {
    /// Its line in the file, counted from 1.
    pub line: u64,
    /// What was found, or what keeps the robot from it.
    pub point: Result<PathPoint, Limit>,
}

/// All rows of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct PathSummary {
    /// The file's name.
    pub name: String,
    /// In the file's order.
    pub rows: Vec<PathRow>,
}

impl PathSummary {
    /// The row that comes nearest to a singularity.
    pub fn nearest(&self) -> Option<(u64, PathPoint)> {
        let points = self
            .rows
            .iter()
            .filter_map(|row| Some((row.line, row.point.ok()?)));
        points.min_by(|a, b| a.1.nearest.distance.total_cmp(&b.1.nearest.distance))
    }

    /// The rows that the robot cannot be at.
    pub fn beyond_reach(&self) -> impl Iterator<Item = (u64, Limit)> + '_ {
        self.rows
            .iter()
            .filter_map(|row| Some((row.line, row.point.err()?)))
    }
}

/// Each row's distance from the nearest singularity. With columns of joint angles the positions are
/// computed from them; otherwise the joint angles from the positions.
///
/// # Errors
/// The first faulty row. A row that the robot cannot be at is none.
pub fn distances_of_path(robot: &RobotFile, input: &InputText) -> Result<PathSummary, InputError> {
    let (poses, reach) = (read_poses(input, &robot.limits)?, robot.reach());
    let rows = poses
        .into_par_iter()
        .map(|row| {
            let pose = match row.value {
                Pose::Joints(q) => reach.position(&robot.robot, &q).map(|x| (x, q)),
                Pose::Position(x) => reach.any_joints(&robot.robot, &x).map(|q| (x, q)),
            };
            PathRow {
                line: row.line,
                point: pose.map(|(position, q)| PathPoint {
                    position,
                    q,
                    conditioning: robot.robot.singularity_distance(&position, &q),
                    nearest: nearest_singularity(&robot.robot, &position, &q),
                }),
            }
        })
        .collect();
    Ok(PathSummary {
        name: input.name().to_owned(),
        rows,
    })
}
