//! The command line.

mod arguments;
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

use arguments::Command;
use std::process::ExitCode;

/// Runs the command given on this process's command line.
pub fn run() -> ExitCode {
    let result = match arguments::parse().command {
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Validate(arguments) => validate::run(&arguments),
        Command::Forward(arguments) => kinematics::forward(&arguments),
        Command::Inverse(arguments) => kinematics::inverse(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Import(arguments) => import::run(&arguments),
        Command::Workspace(arguments) => workspace::run(&arguments),
        Command::Device(arguments) => device::run(&arguments),
        Command::Init(arguments) => init::run(&arguments),
        Command::Completions(arguments) => arguments::complete(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
