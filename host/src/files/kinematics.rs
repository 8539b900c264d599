//! Forward and inverse kinematics of whole files.

use super::convention::Convention;
use super::input::{InputError, InputText};
use super::robot_file::RobotFile;
use super::samples_file::{read_joints, read_positions};
use crate::geometry::hangs_below;
use crate::text::{joint, rounded};
use delta_cal::kinematics::KinematicsError;
use delta_cal::{ArmIndex, Sample};

/// The platform position at each row's joint angles.
///
/// # Errors
/// The first faulty row or impossible pose.
pub fn forward(robot: &RobotFile, input: &InputText) -> Result<Vec<Sample<f64>>, InputError> {
    let rows = read_joints(input, robot)?.into_iter();
    rows.map(|row| {
        let joints = row.value;
        let position = robot.robot.forward(&joints);
        let position = position.map_err(|error| no_pose(input, row.line, error))?;
        Ok(Sample { joints, position })
    })
    .collect()
}

/// The joint angles, elbows out, for each row's position.
///
/// # Errors
/// The first faulty row, or the first position that no joint angles within the limits reach with elbows out.
pub fn inverse(robot: &RobotFile, input: &InputText) -> Result<Vec<Sample<f64>>, InputError> {
    let rows = read_positions(input, &robot.convention)?.into_iter();
    rows.map(|row| {
        let position = row.value;
        let joints = robot.robot.inverse(&position);
        let joints = joints.map_err(|error| no_pose(input, row.line, error))?;
        let mut arms = joints.into_iter().zip(ArmIndex::ALL);
        let outside = arms.find_map(|(own, arm)| Some((arm, robot.outside_limits(own)?)));
        let (cause, remedy) = match outside {
            Some((arm, outside)) => (
                format!(
                    "unreachable for {arm}: its {} {outside}",
                    joint::name(robot.limits.drive())
                ),
                "check the position, its frame and [joints] in the robot file",
            ),
            None if hangs_below(&robot.robot, &position, &joints) => {
                return Ok(Sample { joints, position });
            }
            None => (
                "the platform would be above its elbows, and no joint angles hold it there"
                    .to_owned(),
                if robot.convention.height(1.0) > 0.0 {
                    "check the position and its frame: z is negative below the base"
                } else {
                    "check the position and its frame: z is positive below the base"
                },
            ),
        };
        Err(InputError::new(input.name(), cause)
            .at_line(row.line)
            .with_remedy(remedy))
    })
    .collect()
}

/// Samples as CSV in a convention, rounded to 9 decimals.
pub fn to_csv(convention: &Convention, samples: &[Sample<f64>]) -> String {
    let header = [convention.joint_columns(), convention.position_columns()];
    let rows = samples.iter().map(|own| {
        let own = [
            convention.joints(&own.joints),
            convention.position(&own.position),
        ];
        own.map(|own| own.map(rounded))
    });
    let lines = std::iter::once(header).chain(rows);
    lines.map(|cells| cells.concat().join(",") + "\n").collect()
}

fn no_pose(input: &InputText, line: u64, error: KinematicsError) -> InputError {
    let remedy = match error {
        KinematicsError::Unreachable(_) => {
            "the robot cannot be there; check the numbers, their units and the robot file"
        }
        KinematicsError::Serial(_) => {
            "this is the edge of the workspace; move the position inwards"
        }
        KinematicsError::Parallel(_) => {
            "at a singularity the joints do not hold the platform; choose another pose"
        }
        _ => "the number is too large to compute with",
    };
    InputError::new(input.name(), error.to_string())
        .at_line(line)
        .with_remedy(remedy)
}
