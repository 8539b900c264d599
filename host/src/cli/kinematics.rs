use super::args::KinematicsArguments;
use super::failure::Failure;
use super::paths::{is_stream, read, refuse_same};
use super::print;
use delta_cal::Sample;
use delta_cal_host::files::{kinematics, output};
use delta_cal_host::{InputError, InputText, RobotFile};
use std::path::Path;

type Solve = fn(&RobotFile, &InputText) -> Result<Vec<Sample<f64>>, InputError>;

pub(crate) fn forward(arguments: &KinematicsArguments) -> Result<(), Failure> {
    run(arguments, kinematics::forward)
}

pub(crate) fn inverse(arguments: &KinematicsArguments) -> Result<(), Failure> {
    run(arguments, kinematics::inverse)
}

fn run(arguments: &KinematicsArguments, solve: Solve) -> Result<(), Failure> {
    let output = arguments.output.as_deref().filter(|path| !is_stream(path));
    let input = arguments.file.as_deref().unwrap_or(Path::new("-"));
    let remedy = "give the output another name";
    let robot = ("the robot file", Some(arguments.robot.as_path()));
    refuse_same("--output", output, robot, remedy)?;
    refuse_same("--output", output, ("the input file", Some(input)), remedy)?;

    let robot = RobotFile::read(&InputText::from_file(&arguments.robot)?)?;
    let csv = kinematics::to_csv(&solve(&robot, &read(input)?)?);
    match output {
        Some(path) => Ok(output::write_all(&[(path, &csv)])?),
        None => print(&csv),
    }
}
