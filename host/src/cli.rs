//! The command line: every command, its help, and what becomes of its result.

mod calibrate;
mod device;
mod export;
mod failure;
mod import;
mod kinematics;
mod output;
mod paths;
mod plan;
mod simulate;
mod validate;
mod workspace;

use crate::{RobotFile, files};
use clap::{ArgMatches, Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};
use clap_complete::{Shell, generate};
use delta_cal::robot::Drive;
use failure::Failure;
use std::path::PathBuf;
use std::process::ExitCode;

/// Calibrates Delta robots from positions, heights and distances
#[derive(Debug, Parser)]
#[command(name = "delta-cal", version, max_term_width = 100)]
#[command(after_help = include_str!("cli/help/delta-cal.txt"))]
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
        Command::Init(own) => init(&own),
        Command::Calibrate(own) => calibrate::run(&own, arguments),
        Command::Validate(own) => validate::run(&own),
        Command::Forward(own) => kinematics::run(&own, files::kinematics::forward),
        Command::Inverse(own) => kinematics::run(&own, files::kinematics::inverse),
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
    let help = command.get_after_help().map(ToString::to_string);
    let help = help.map_or_else(String::new, |own| own + "\n");
    command
        .after_help(format!("{help}Exit codes: delta-cal --help"))
        .mut_subcommands(with_exit_codes)
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a robot file to edit, with a comment beside every key
    #[command(after_help = include_str!("cli/help/init.txt"))]
    Init(InitArguments),
    /// Find the robot's geometric parameters from measurements
    #[command(after_help = include_str!("cli/help/calibrate.txt"))]
    Calibrate(calibrate::CalibrateArguments),
    /// Check a calibrated robot against independent measurements and a limit
    #[command(after_help = include_str!("cli/help/validate.txt"))]
    Validate(validate::ValidateArguments),
    /// Compute positions from joint angles
    #[command(after_help = include_str!("cli/help/forward.txt"))]
    Forward(kinematics::KinematicsArguments),
    /// Compute joint angles from positions
    #[command(after_help = include_str!("cli/help/inverse.txt"))]
    Inverse(kinematics::KinematicsArguments),
    /// Choose what to measure, and predict the accuracy
    #[command(after_help = include_str!("cli/help/plan.txt"))]
    Plan(plan::PlanArguments),
    /// Calibrate many simulated robots, to predict how accurate a calibration will be
    #[command(after_help = include_str!("cli/help/simulate.txt"))]
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
    #[command(after_help = include_str!("cli/help/completions.txt"))]
    Completions {
        /// The shell that is to complete commands and options
        shell: Shell,
    },
    /// Write the manual pages into a folder
    #[cfg(feature = "man")]
    #[command(hide = true)]
    Man {
        /// The folder, which must exist
        folder: PathBuf,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Motors turn the upper arms
    Rotary,
    /// Carriages run along towers, as in most printers
    Linear,
}

#[derive(Debug, Args)]
struct InitArguments {
    /// What moves the elbows
    #[arg(long, value_enum, default_value = "rotary")]
    kind: Kind,
    /// The file to write; - writes to standard output
    #[arg(long, value_name = "ROBOT.toml", default_value = "robot.toml")]
    output: PathBuf,
}

/// Writes the template of a robot file.
fn init(arguments: &InitArguments) -> Result<(), Failure> {
    let path = arguments.output.as_path();
    if !paths::is_stream(path) && path.exists() {
        let path = path.display();
        return Err(Failure::output(format!("{path}: the file exists")));
    }
    let template = RobotFile::template(match arguments.kind {
        Kind::Rotary => Drive::Rotary,
        Kind::Linear => Drive::Linear,
    });
    output::deliver(&[(Some(path), template)], "")
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
