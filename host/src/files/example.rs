//! The built-in example: a simulated robot, to try the command without files.

use super::input::{InputError, InputText};
use super::robot_file::RobotFile;
use super::samples_file::Readings;

/// `robot.toml` of the example.
pub const ROBOT_TOML: &str = include_str!("../../examples/paper-robot/robot.toml");

/// `samples.csv` of the example. Simulated, not measured.
pub const SAMPLES_CSV: &str = include_str!("../../examples/paper-robot/samples.csv");

/// Reads both files.
///
/// # Errors
/// None: a test checks the built-in files.
pub fn load() -> Result<(RobotFile, Readings), InputError> {
    let robot = RobotFile::read(&InputText::new("built-in robot.toml", ROBOT_TOML))?;
    let samples = Readings::read(&InputText::new("built-in samples.csv", SAMPLES_CSV), &robot)?;
    Ok((robot, samples))
}
