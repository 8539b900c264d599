//! `delta-cal completions`: generated from the commands themselves.

use super::failure::Failure;
use super::print::print;
use clap::{Args, Command};
use clap_complete::{Shell, generate};

pub(crate) const HELP: &str = "\
Examples:
  delta-cal completions bash > /etc/bash_completion.d/delta-cal
  delta-cal completions zsh > ~/.zfunc/_delta-cal
  delta-cal completions fish > ~/.config/fish/completions/delta-cal.fish";

#[derive(Debug, Args)]
pub(crate) struct CompletionsArguments {
    /// The shell that is to complete commands and options
    #[arg(value_enum)]
    shell: Shell,
}

/// `command`: the whole.
pub(crate) fn run(arguments: &CompletionsArguments, mut command: Command) -> Result<(), Failure> {
    let mut text = Vec::new();
    generate(arguments.shell, &mut command, "delta-cal", &mut text);
    print(&String::from_utf8_lossy(&text))
}
