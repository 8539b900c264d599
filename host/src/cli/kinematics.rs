//! `delta-cal forward` and `delta-cal inverse`.

use super::failure::Failure;
use super::output::deliver;
use super::paths::{ColumnsArgument, read, robot_path};
use crate::files::kinematics;
use crate::files::robot_file::Tool;
use crate::{InputError, InputText, RobotFile};
use clap::Args;
use delta_cal::Sample;
use std::path::{Path, PathBuf};

pub(crate) const FORWARD_HELP: &str = "\
FILE.csv has the columns q1_deg,q2_deg,q3_deg (with towers s1_mm,s2_mm,s3_mm); others are ignored, so that it may be \
a samples file. The output has x_mm,y_mm,z_mm too and, where the rods of an arm differ, the rotation vector of the \
platform in rx_deg,ry_deg,rz_deg. If a row has no solution, nothing is written.

Examples:
  delta-cal forward robot.toml angles.csv
  delta-cal forward robot.toml angles.csv --target 60,0,-40
  printf 'q1_deg,q2_deg,q3_deg\\n10,20,30\\n' | delta-cal forward robot.toml";

pub(crate) const INVERSE_HELP: &str = "\
FILE.csv has the columns x_mm,y_mm,z_mm (or _m, _in ...); others are ignored, so that it may be a samples file. The \
output has the joint angles too. If a row has no solution within the joint limits, nothing is written.

Examples:
  delta-cal inverse robot.toml positions.csv --output angles.csv
  printf 'x_mm,y_mm,z_mm\\n10,-20,-400\\n' | delta-cal inverse robot.toml";

#[derive(Debug, Args)]
pub(crate) struct KinematicsArguments {
    /// The robot
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    pub(crate) robot: PathBuf,
    /// The rows to compute; without it, or with -, the program reads standard input
    #[arg(value_name = "FILE.csv")]
    pub(crate) file: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) columns: ColumnsArgument,
    /// The point of the platform whose position it is: a target of the robot file, tool, or x,y,z in mm
    #[arg(long, value_name = "NAME|X,Y,Z", allow_hyphen_values = true)]
    pub(crate) target: Option<String>,
    /// Write to this file instead of standard output, replacing a file that exists
    #[arg(long, value_name = "OUT.csv")]
    pub(crate) output: Option<PathBuf>,
}

type Solve = fn(&RobotFile, &Tool, &InputText) -> Result<Vec<Sample<f64>>, InputError>;

pub(crate) fn forward(arguments: &KinematicsArguments) -> Result<(), Failure> {
    run(arguments, kinematics::forward)
}

pub(crate) fn inverse(arguments: &KinematicsArguments) -> Result<(), Failure> {
    run(arguments, kinematics::inverse)
}

fn run(arguments: &KinematicsArguments, solve: Solve) -> Result<(), Failure> {
    let output = arguments.output.as_deref();
    let input = arguments.file.as_deref().unwrap_or(Path::new("-"));
    let robot = RobotFile::read(&InputText::from_file(&arguments.robot)?)?;
    let point = match &arguments.target {
        Some(text) => kinematics::target(&robot, text)?,
        None => robot.platform_point(),
    };
    let samples = solve(&robot, &point, &read(input, &arguments.columns)?)?;
    let csv = kinematics::to_csv(&robot, &samples);
    deliver(&[(output.or(Some(Path::new("-"))), &csv)], "")
}
