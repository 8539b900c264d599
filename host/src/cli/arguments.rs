//! The commands.

use super::calibrate::{self, CalibrateArguments};
use super::device::DeviceArguments;
use super::export::ExportArguments;
use super::failure::Failure;
use super::import::ImportArguments;
use super::init::{self, InitArguments};
use super::kinematics::{self, KinematicsArguments};
use super::output::print;
use super::plan::{self, PlanArguments};
use super::simulate::{self, SimulateArguments};
use super::validate::{self, ValidateArguments};
use super::workspace::WorkspaceArguments;
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use clap_complete::{Shell, generate};

const EXAMPLES: &str = "\
Examples:
  delta-cal calibrate
      the built-in, simulated example
  delta-cal init
  delta-cal plan robot.toml --count 12 --output poses.csv
  delta-cal calibrate robot.toml samples.csv --output calibrated.toml
  delta-cal validate calibrated.toml check.csv --limit 0.1mm
  delta-cal export calibrated.toml --for klipper";

const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  refused: the measurements do not determine this robot, or cannot improve it
  2  the command line is wrong
  3  an input file is wrong
  4  a file could not be written
  5  the controller or the link to it failed
  6  the --limit is not met, or not known to be; the output files are written

With exit codes 1, 2 and 3 no output file is written or changed.";

const COMPLETIONS: &str = "\
Examples:
  delta-cal completions bash > /etc/bash_completion.d/delta-cal
  delta-cal completions zsh > ~/.zfunc/_delta-cal
  delta-cal completions fish > ~/.config/fish/completions/delta-cal.fish";

/// Calibrates Delta robots from positions, heights and distances
#[derive(Debug, Parser)]
#[command(name = "delta-cal", version, max_term_width = 100)]
#[command(after_help = format!("{EXAMPLES}\n\n{EXIT_CODES}"))]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// Parses this process's command line.
pub(crate) fn parse() -> Arguments {
    let command = Arguments::command().mut_subcommands(with_exit_codes);
    let parsed = Arguments::from_arg_matches(&command.get_matches());
    parsed.unwrap_or_else(|error| error.exit())
}

/// The help of each command says where the exit codes are listed.
fn with_exit_codes(command: clap::Command) -> clap::Command {
    let help = command.get_after_help();
    let help = help.map_or_else(String::new, |own| format!("{own}\n\n"));
    command
        .after_help(format!("{help}Exit codes: delta-cal --help"))
        .mut_subcommands(with_exit_codes)
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
    #[command(after_help = COMPLETIONS)]
    Completions(CompletionsArguments),
}

#[derive(Debug, Args)]
pub(crate) struct CompletionsArguments {
    /// The shell that is to complete commands and options
    #[arg(value_enum)]
    shell: Shell,
}

/// Prints the completion script.
pub(crate) fn complete(arguments: &CompletionsArguments) -> Result<(), Failure> {
    let mut text = Vec::new();
    generate(
        arguments.shell,
        &mut Arguments::command(),
        "delta-cal",
        &mut text,
    );
    print(&String::from_utf8_lossy(&text))
}
