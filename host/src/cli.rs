//! The command line.

mod args;
mod calibrate;
mod check;
mod device;
mod failure;
mod kinematics;
mod paths;
mod plan;
mod progress;
mod reproduce;
mod simulate;
mod workspace;

use args::{Arguments, Command};
use clap::Parser;
use failure::Failure;
use std::io::{self, Write};
use std::process::ExitCode;

pub(crate) fn run() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Forward(arguments) => kinematics::forward(&arguments),
        Command::Inverse(arguments) => kinematics::inverse(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Reproduce(arguments) => reproduce::run(&arguments),
        Command::Workspace(arguments) => workspace::run(&arguments),
        Command::Device(arguments) => device::run(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

/// Prints to standard output, with colour only where it is wanted.
fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = anstream::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::Output(format!(
            "standard output: cannot be written: {error}"
        ))),
        _ => Ok(()),
    }
}
