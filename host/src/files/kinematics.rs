//! Forward and inverse kinematics of whole files.

use super::columns::Quantity;
use super::input::{InputError, InputText};
use super::robot_file::{RobotFile, Tool};
use super::samples_file::{read_joints, read_positions};
use crate::geometry::hangs_below;
use crate::text::{degrees, joint, list, rounded};
use delta_cal::kinematics::KinematicsError;
use delta_cal::{ArmIndex, Sample};
use nalgebra::Vector3;

/// A point of the platform by the name of its target, by `tool`, or by its coordinates in the axes of the robot file.
///
/// # Errors
/// Neither.
pub fn target(robot: &RobotFile, text: &str) -> Result<Tool, InputError> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|own| own.trim().parse()).collect();
    let stated = || {
        let targets = robot.instruments.targets.iter();
        let targets = targets.map(|own| (own.name.clone(), own.place));
        targets.chain(robot.tool.map(|place| ("tool".to_owned(), place)))
    };
    let place = match numbers.as_deref() {
        Ok([x, y, z]) => Some(robot.convention.vector(&Vector3::new(*x, *y, *z))),
        _ => stated()
            .find(|(name, _)| name == text)
            .map(|(_, place)| place),
    };
    let Some(place) = place else {
        let names: Vec<_> = stated().map(|(name, _)| name).collect();
        let cause = format!("target {text}: neither a target of this file nor x,y,z in mm");
        let remedy = match names.as_slice() {
            [] => "add a section [target], or give three numbers".to_owned(),
            names => format!("its targets are {}", list(names)),
        };
        return Err(InputError::new(&robot.name, cause).with_remedy(remedy));
    };
    Ok(Tool {
        place,
        ..robot.platform_point()
    })
}

/// The position of a point of the platform at each row's joint angles.
///
/// # Errors
/// The first faulty row or impossible pose.
pub fn forward(
    robot: &RobotFile,
    point: &Tool,
    input: &InputText,
) -> Result<Vec<Sample<f64>>, InputError> {
    let rows = read_joints(input, robot)?.into_iter();
    rows.map(|row| {
        let joints = row.value;
        let position = point.position(&robot.robot, &joints);
        let position = position.map_err(|error| no_pose(input, row.line, error))?;
        Ok(Sample { joints, position })
    })
    .collect()
}

/// The joint angles, elbows out, for each row's position of a point of the platform.
///
/// # Errors
/// The first faulty row, or the first position that no joint angles within the limits reach with elbows out.
pub fn inverse(
    robot: &RobotFile,
    point: &Tool,
    input: &InputText,
) -> Result<Vec<Sample<f64>>, InputError> {
    let rows = read_positions(input, &robot.convention)?.into_iter();
    rows.map(|row| {
        let position = row.value;
        let found = point.joints(&robot.robot, &position);
        let (joints, platform) = found.map_err(|error| no_pose(input, row.line, error))?;
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
            None if hangs_below(&robot.robot, &platform, &joints) => {
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

/// Samples as CSV in the convention of the robot file, rounded to 9 decimals; where the platform tilts, with its rotation
/// vector.
pub fn to_csv(robot: &RobotFile, samples: &[Sample<f64>]) -> String {
    let convention = &robot.convention;
    let rods = robot.parallelograms.filter(|own| !own.are_exact());
    let mut header = vec![convention.joint_columns(), convention.position_columns()];
    header.extend(rods.map(|_| Quantity::TURNS.map(|own| convention.column(own))));
    let rows = samples.iter().map(|own| {
        let mut cells = vec![
            convention.joints(&own.joints),
            convention.position(&own.position),
        ];
        let pose = rods.and_then(|rods| rods.pose(&robot.robot, &own.joints).ok());
        if let Some(pose) = pose {
            cells.push(convention.vector(&pose.tilt).map(degrees).into());
        }
        cells
            .into_iter()
            .map(|own: [f64; 3]| own.map(rounded))
            .collect()
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
