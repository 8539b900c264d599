//! The commands.

use super::calibrate::{self, CalibrateArguments};
use super::completions::{self, CompletionsArguments, ManArguments};
use super::device::DeviceArguments;
use super::exit_codes::EXIT_CODES;
use super::export::ExportArguments;
use super::import::ImportArguments;
use super::init::{self, InitArguments};
use super::kinematics::{self, KinematicsArguments};
use super::klipper::KlipperArguments;
use super::plan::{self, PlanArguments};
use super::simulate::{self, SimulateArguments};
use super::validate::{self, ValidateArguments};
use super::workspace::WorkspaceArguments;
use clap::{Parser, Subcommand};

const EXAMPLES: &str = "\
Examples:
  delta-cal calibrate
      the built-in, simulated example
  delta-cal calibrate robot.toml samples.csv --output calibrated.toml
  delta-cal calibrate robot.toml tracker.csv --frame sensor --json report.json
  delta-cal validate calibrated.toml check.csv --limit 0.1mm
  delta-cal init
  delta-cal forward calibrated.toml angles.csv
  delta-cal inverse calibrated.toml < positions.csv > angles.csv
  delta-cal plan robot.toml --count 20 --output poses.csv
  delta-cal plan robot.toml --samples samples.csv
  delta-cal simulate
  delta-cal workspace robot.toml --output workspace
  delta-cal export calibrated.toml --for klipper
  delta-cal klipper printer.cfg
  delta-cal import klipper printer.cfg --output mine
  delta-cal device --port /dev/ttyACM0 calibrate robot.toml samples.csv --apply";

/// Calibrates Delta robots from measured positions
#[derive(Debug, Parser)]
#[command(name = "delta-cal", version, max_term_width = 100)]
#[command(after_help = format!("{EXAMPLES}\n\n{EXIT_CODES}"))]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Write a first robot file, with a comment beside every number
    #[command(after_help = init::HELP)]
    Init(InitArguments),
    /// Find the robot's 24 geometric parameters from measured positions
    #[command(after_help = format!("{}\n\n{EXIT_CODES}", calibrate::HELP))]
    Calibrate(CalibrateArguments),
    /// Check whether a calibration still holds: against independent measurements and a limit
    #[command(after_help = validate::HELP)]
    Validate(ValidateArguments),
    /// Compute where the platform is at given joint angles
    #[command(after_help = format!("{}\n\n{}", kinematics::FORWARD_HELP, kinematics::EXIT_CODES))]
    Forward(KinematicsArguments),
    /// Compute the joint angles at which the platform is at given positions
    #[command(after_help = format!("{}\n\n{}", kinematics::INVERSE_HELP, kinematics::EXIT_CODES))]
    Inverse(KinematicsArguments),
    /// Choose the best poses to measure, and predict the accuracy they give
    #[command(after_help = plan::HELP)]
    Plan(PlanArguments),
    /// Calibrate many simulated robots, to predict how accurate a calibration will be
    #[command(after_help = simulate::HELP)]
    Simulate(SimulateArguments),
    /// Compute the robot's workspace: boundary, volume, cylinders, singularities, effect of errors
    Workspace(WorkspaceArguments),
    /// Write a calibrated robot for another controller, and say what that loses
    Export(ExportArguments),
    /// Read another controller's configuration and its saved measurements into files for calibrate
    Import(ImportArguments),
    /// Say what is wrong with a Klipper printer, what to measure next, and what to paste
    Klipper(KlipperArguments),
    /// Let a controller calibrate its robot, over the controller's serial link
    Device(DeviceArguments),
    /// Print what makes a shell complete commands and options
    #[command(after_help = completions::COMPLETIONS_HELP)]
    Completions(CompletionsArguments),
    /// Write manual pages, one for each command
    #[command(after_help = completions::MAN_HELP)]
    Man(ManArguments),
}
