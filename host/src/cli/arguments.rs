//! The commands.

use super::calibrate::{self, CalibrateArguments};
use super::completions::{self, CompletionsArguments};
use super::device::DeviceArguments;
use super::exit_codes::EXIT_CODES;
use super::export::ExportArguments;
use super::import::ImportArguments;
use super::init::{self, InitArguments};
use super::kinematics::{self, KinematicsArguments};
use super::plan::{self, PlanArguments};
use super::simulate::{self, SimulateArguments};
use super::validate::{self, ValidateArguments};
use super::workspace::WorkspaceArguments;
use clap::{Parser, Subcommand};

const EXAMPLES: &str = "\
Examples:
  delta-cal calibrate
      the built-in, simulated example
  delta-cal init
  delta-cal plan robot.toml --count 12 --output poses.csv
  delta-cal calibrate robot.toml samples.csv --output calibrated.toml
  delta-cal validate calibrated.toml check.csv --limit 0.1mm
  delta-cal export calibrated.toml --for klipper";

/// Calibrates Delta robots from positions, heights and distances
#[derive(Debug, Parser)]
#[command(name = "delta-cal", version, max_term_width = 100)]
#[command(after_help = format!("{EXAMPLES}\n\n{EXIT_CODES}"))]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Write a robot file to edit, with a comment beside every key
    #[command(after_help = init::HELP)]
    Init(InitArguments),
    /// Find the robot's geometric parameters from measurements
    #[command(after_help = calibrate::HELP)]
    Calibrate(CalibrateArguments),
    /// Check a calibrated robot against independent measurements and a limit
    #[command(after_help = validate::HELP)]
    Validate(ValidateArguments),
    /// Compute positions from joint angles
    #[command(after_help = kinematics::FORWARD_HELP)]
    Forward(KinematicsArguments),
    /// Compute joint angles from positions
    #[command(after_help = kinematics::INVERSE_HELP)]
    Inverse(KinematicsArguments),
    /// Choose what to measure, and predict the accuracy
    #[command(after_help = plan::HELP)]
    Plan(PlanArguments),
    /// Calibrate many simulated robots, to predict how accurate a calibration will be
    #[command(after_help = simulate::HELP)]
    Simulate(SimulateArguments),
    /// Compute the workspace: boundary, volume, singularities, effect of errors
    Workspace(WorkspaceArguments),
    /// Write a calibrated robot for another controller
    Export(ExportArguments),
    /// Read another controller's configuration and its saved measurements into files for calibrate
    Import(ImportArguments),
    /// Let a controller calibrate its robot over a serial link
    Device(DeviceArguments),
    /// Print a script that completes commands in a shell
    #[command(after_help = completions::HELP)]
    Completions(CompletionsArguments),
}
