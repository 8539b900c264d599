//! Forward and inverse kinematics of whole files.

use super::input::{InputError, InputText};
use super::robot_file::RobotFile;
use super::samples_file::{Row, read_joints, read_positions};
use crate::geometry::{hangs_below, outside_limits};
use crate::text::{joint, rounded};
use delta_cal::kinematics::{JointLimits, KinematicsError, Singularity};
use delta_cal::robot::Drive;
use delta_cal::{ArmIndex, Sample};
use std::fmt::Write;

/// Where the platform is at each row's joint angles.
///
/// # Errors
/// The first faulty row, or the first whose pose does not exist.
pub fn forward(robot: &RobotFile, input: &InputText) -> Result<Vec<Sample<f64>>, InputError> {
    read_joints(input, &robot.limits)?
        .into_iter()
        .map(|row| {
            let position = robot
                .robot
                .forward(&row.value)
                .map_err(|error| no_pose(input, &row, error))?;
            Ok(Sample {
                joints: row.value,
                position,
            })
        })
        .collect()
}

/// The joint angles at which the platform is at each row's position.
///
/// # Errors
/// The first faulty row, or the first that no joint angles within the limits reach, elbows out.
pub fn inverse(robot: &RobotFile, input: &InputText) -> Result<Vec<Sample<f64>>, InputError> {
    read_positions(input)?
        .into_iter()
        .map(|row| {
            let joints = robot
                .robot
                .inverse(&row.value)
                .map_err(|error| no_pose(input, &row, error))?;
            check_limits(input, &row, joints, &robot.limits)?;
            if !hangs_below(&robot.robot, &row.value, &joints) {
                let cause =
                    "the platform would be above its elbows, and no joint angles hold it there";
                return Err(InputError::new(input.name(), cause)
                    .at_line(row.line)
                    .with_remedy(
                        "check the position and its frame: z is negative below the base",
                    ));
            }
            Ok(Sample {
                joints,
                position: row.value,
            })
        })
        .collect()
}

/// The columns of a samples file, in degrees and millimetres, rounded to 9 decimals.
pub fn to_csv(drive: Drive, samples: &[Sample<f64>]) -> String {
    let mut csv = format!("{},x_mm,y_mm,z_mm\n", joint::columns(drive));
    for sample in samples {
        let [q1, q2, q3] = sample.joints.map(|q| rounded(joint::in_file(drive, q)));
        let [x, y, z] = sample.position.data.0[0].map(rounded);
        let _ = writeln!(csv, "{q1},{q2},{q3},{x},{y},{z}");
    }
    csv
}

fn check_limits<T>(
    input: &InputText,
    row: &Row<T>,
    joints: [f64; 3],
    limits: &JointLimits<f64>,
) -> Result<(), InputError> {
    for (angle, arm) in joints.into_iter().zip(ArmIndex::ALL) {
        if let Some(outside) = outside_limits(angle, limits) {
            let cause = format!(
                "unreachable for {arm}: its {} {outside}",
                joint::name(limits.drive())
            );
            return Err(InputError::new(input.name(), cause)
                .at_line(row.line)
                .with_remedy("check the position, its frame and [joints] in the robot file"));
        }
    }
    Ok(())
}

fn no_pose<T>(input: &InputText, row: &Row<T>, error: KinematicsError) -> InputError {
    let remedy = match error {
        KinematicsError::Unreachable(_) => {
            "the robot cannot be there; check the numbers, their units and the robot file"
        }
        KinematicsError::Singular(_, Singularity::Serial) => {
            "this is the edge of the workspace; move the position inwards"
        }
        KinematicsError::Singular(_, Singularity::Parallel) => {
            "at a singularity the joints do not hold the platform; choose another pose"
        }
        _ => "the number is too large to compute with",
    };
    InputError::new(input.name(), error.to_string())
        .at_line(row.line)
        .with_remedy(remedy)
}
