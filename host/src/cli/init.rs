//! `delta-cal init`.

use super::failure::Failure;
use super::output::deliver;
use super::paths::is_stream;
use crate::RobotFile;
use clap::{Args, ValueEnum};
use delta_cal::robot::Drive;
use std::path::PathBuf;

pub(crate) const HELP: &str = "\
The file holds an example robot and every key with a comment. Replace its numbers by those of your robot. An \
existing file is not replaced.

Examples:
  delta-cal init
  delta-cal init --kind linear --output printer.toml
  delta-cal init --output - | less

Next:
  delta-cal plan robot.toml --count 12 --output poses.csv";

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Motors turn the upper arms
    Rotary,
    /// Carriages run along towers, as in most printers
    Linear,
}

#[derive(Debug, Args)]
pub(crate) struct InitArguments {
    /// What moves the elbows
    #[arg(long, value_enum, default_value = "rotary")]
    kind: Kind,
    /// The file to write; - writes to standard output
    #[arg(long, value_name = "ROBOT.toml", default_value = "robot.toml")]
    output: PathBuf,
}

pub(crate) fn run(arguments: &InitArguments) -> Result<(), Failure> {
    let path = arguments.output.as_path();
    if !is_stream(path) && path.exists() {
        let path = path.display();
        return Err(Failure::output(format!("{path}: the file exists")));
    }
    let template = RobotFile::template(match arguments.kind {
        Kind::Rotary => Drive::Rotary,
        Kind::Linear => Drive::Linear,
    });
    deliver(&[(Some(path), template)], "")
}
