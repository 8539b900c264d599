//! The example built into the program: a simulated robot, so that the command can be tried without
//! files. `cargo run -p delta-cal-host --example generate_example` writes both files anew.

use super::input::{InputError, InputText};
use super::robot_file::RobotFile;
use super::samples_file::Readings;

/// `robot.toml` of the example.
pub const ROBOT_TOML: &str = include_str!("../../examples/paper-robot/robot.toml");

/// `samples.csv` of the example. Simulated, not measured.
pub const SAMPLES_CSV: &str = include_str!("../../examples/paper-robot/samples.csv");

/// Reads both.
///
/// # Errors
/// None, as long as the built-in files are in order, which a test assures.
pub fn load() -> Result<(RobotFile, Readings), InputError> {
    let robot = RobotFile::read(&InputText::new("built-in robot.toml", ROBOT_TOML))?;
    let samples = Readings::read(&InputText::new("built-in samples.csv", SAMPLES_CSV), &robot)?;
    Ok((robot, samples))
}
