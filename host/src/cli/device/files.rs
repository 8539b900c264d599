//! What the subcommands read and write.

use super::args::Files;
use crate::cli::failure::Failure;
use crate::cli::outputs::deliver;
use crate::cli::paths::read;
use crate::files::example;
use crate::render::json;
use crate::{CalibrateError, InputError, InputText, Measurements, RobotFile, read_samples};
use delta_cal::robot::Drive;
use serde_json::Value;
use std::path::Path;

/// The two files, or the built-in example.
pub(super) fn inputs(files: &Files) -> Result<(RobotFile, Measurements), CalibrateError> {
    let (Some(robot), Some(samples)) = (&files.robot, &files.samples) else {
        let (robot, samples) = example::load()?;
        return Ok((robot, Measurements::Positions(samples)));
    };
    let robot = RobotFile::read(&InputText::from_file(robot)?)?;
    refuse_linear(&robot)?;
    refuse_unknown_transmissions(&robot)?;
    let measurements = read_samples(&read(samples, &files.columns)?, &robot, files.options())?;
    Ok((robot, measurements))
}

/// How many rows there are.
pub(super) fn rows(measurements: &Measurements) -> usize {
    match measurements {
        Measurements::Positions(samples) => samples.rows.len(),
        Measurements::Observations(samples) => samples.rows.len(),
    }
}

/// The controller's protocol carries robots with rotary drives alone.
pub(super) fn refuse_linear(robot: &RobotFile) -> Result<(), InputError> {
    if robot.robot.drive() == Drive::Rotary {
        return Ok(());
    }
    let cause = "a robot with linear drives cannot be calibrated on the controller";
    Err(InputError::new(&robot.name, cause)
        .with_remedy("calibrate it with delta-cal calibrate, and export the result"))
}

/// The controller uses the transmissions of its robot and does not find them.
fn refuse_unknown_transmissions(robot: &RobotFile) -> Result<(), InputError> {
    if robot.transmission.is_none() {
        return Ok(());
    }
    let cause = "transmissions cannot be found on the controller";
    Err(InputError::new(&robot.name, cause)
        .at_key("[tolerance] transmission_deg")
        .with_remedy(
            "find them with delta-cal calibrate, and send the result with delta-cal device apply",
        ))
}

/// Writes the files and the JSON report, and prints the report for people unless something else goes to standard output.
pub(super) fn publish(
    files: &[(Option<&Path>, &str)],
    json_path: Option<&Path>,
    report: &Value,
    text: String,
) -> Result<(), Failure> {
    let json = json::text(report);
    let mut outputs = files.to_vec();
    outputs.push((json_path, &json));
    deliver(&outputs, text)
}
