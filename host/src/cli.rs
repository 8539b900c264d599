//! The command line: every command, its help, and what becomes of its result.

mod calibrate;
mod device;
mod export;
mod failure;
mod import;
mod init;
mod kinematics;
mod output;
mod paths;
mod plan;
mod progress;
mod simulate;
mod validate;
mod workspace;

use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser, Subcommand};
use clap_complete::{Shell, generate};
use failure::Failure;
use std::process::ExitCode;

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
  6  the --limit is not met, or this is undecided; the output files are written

With exit codes 1 (except plan --samples), 2 and 3 no output file is written or changed.";

const COMPLETIONS: &str = "\
Examples:
  delta-cal completions bash > /etc/bash_completion.d/delta-cal
  delta-cal completions zsh > ~/.zfunc/_delta-cal
  delta-cal completions fish > ~/.config/fish/completions/delta-cal.fish";

/// Calibrates Delta robots from positions, heights and distances
#[derive(Debug, Parser)]
#[command(name = "delta-cal", version, max_term_width = 100)]
#[command(after_help = format!("{EXAMPLES}\n\n{EXIT_CODES}"))]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

/// Runs the command given on this process's command line.
pub fn run() -> ExitCode {
    let command = Arguments::command().mut_subcommands(with_exit_codes);
    let matches = command.get_matches();
    let arguments = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    match run_command(arguments.command, innermost(&matches)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

/// The arguments of a command, or of the command below it.
fn innermost(matches: &ArgMatches) -> &ArgMatches {
    matches
        .subcommand()
        .map_or(matches, |(_, own)| innermost(own))
}

fn run_command(command: Command, arguments: &ArgMatches) -> Result<(), Failure> {
    paths::check_arguments(arguments)?;
    match command {
        Command::Init(own) => init::run(&own),
        Command::Calibrate(own) => calibrate::run(&own, arguments),
        Command::Validate(own) => validate::run(&own),
        Command::Forward(own) => kinematics::forward(&own),
        Command::Inverse(own) => kinematics::inverse(&own),
        Command::Plan(own) => plan::run(&own, arguments),
        Command::Simulate(own) => simulate::run(&own),
        Command::Workspace(own) => workspace::run(&own),
        Command::Export(own) => export::run(&own),
        Command::Import(own) => import::run(&own),
        Command::Device(own) => device::run(&own),
        Command::Completions { shell } => complete(shell),
        #[cfg(feature = "man")]
        Command::Man { folder } => write_manual(&folder),
    }
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
enum Command {
    /// Write a robot file to edit, with a comment beside every key
    #[command(after_help = init::HELP)]
    Init(init::InitArguments),
    /// Find the robot's geometric parameters from measurements
    #[command(after_help = calibrate::HELP)]
    Calibrate(calibrate::CalibrateArguments),
    /// Check a calibrated robot against independent measurements and a limit
    #[command(after_help = validate::HELP)]
    Validate(validate::ValidateArguments),
    /// Compute positions from joint angles
    #[command(after_help = kinematics::FORWARD_HELP)]
    Forward(kinematics::KinematicsArguments),
    /// Compute joint angles from positions
    #[command(after_help = kinematics::INVERSE_HELP)]
    Inverse(kinematics::KinematicsArguments),
    /// Choose what to measure, and predict the accuracy
    #[command(after_help = plan::HELP)]
    Plan(plan::PlanArguments),
    /// Calibrate many simulated robots, to predict how accurate a calibration will be
    #[command(after_help = simulate::HELP)]
    Simulate(simulate::SimulateArguments),
    /// Compute the workspace: boundary, volume, singularities, effect of errors
    Workspace(workspace::WorkspaceArguments),
    /// Write a calibrated robot for another controller
    Export(export::ExportArguments),
    /// Read another controller's configuration and its saved measurements into files for calibrate
    Import(import::ImportArguments),
    /// Let a controller calibrate its robot over a serial link
    Device(device::DeviceArguments),
    /// Print a script that completes commands in a shell
    #[command(after_help = COMPLETIONS)]
    Completions {
        /// The shell that is to complete commands and options
        shell: Shell,
    },
    /// Write the manual pages into a folder
    #[cfg(feature = "man")]
    #[command(hide = true)]
    Man {
        /// The folder, which must exist
        folder: std::path::PathBuf,
    },
}

#[cfg(feature = "man")]
fn write_manual(folder: &std::path::Path) -> Result<(), Failure> {
    clap_mangen::generate_to(Arguments::command(), folder)
        .map_err(|error| Failure::output(format!("{}: {error}", folder.display())))
}

fn complete(shell: Shell) -> Result<(), Failure> {
    let mut text = Vec::new();
    generate(shell, &mut Arguments::command(), "delta-cal", &mut text);
    output::print(&String::from_utf8_lossy(&text))
}
