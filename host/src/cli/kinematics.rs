//! `delta-cal forward` and `delta-cal inverse`.

use super::failure::Failure;
use super::output::deliver;
use super::paths::{ColumnsArgument, read, robot_path};
use crate::files::{Tool, kinematics};
use crate::{InputError, InputText, RobotFile};
use clap::Args;
use delta_cal::Sample;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct KinematicsArguments {
    /// The robot
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    robot: PathBuf,
    /// The rows to compute; without it, or with -, the program reads standard input
    #[arg(value_name = "FILE.csv")]
    file: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnsArgument,
    /// The point of the platform whose position it is: a target of the robot file, tool, or x,y,z in mm
    #[arg(long, value_name = "NAME|X,Y,Z", allow_hyphen_values = true)]
    target: Option<String>,
    /// Write to this file instead of standard output, replacing a file that exists
    #[arg(long, value_name = "OUT.csv")]
    output: Option<PathBuf>,
}

type Solve = fn(&RobotFile, &Tool, &InputText) -> Result<Vec<Sample<f64>>, InputError>;

pub(crate) fn run(arguments: &KinematicsArguments, solve: Solve) -> Result<(), Failure> {
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
