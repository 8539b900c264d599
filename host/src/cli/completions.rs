//! `delta-cal completions` and `delta-cal man`: generated from the commands themselves.

use super::failure::Failure;
use super::print::print;
use crate::files::output;
use clap::{Args, Command};
use clap_complete::{Shell, generate};
use std::path::{Path, PathBuf};

pub(crate) const COMPLETIONS_HELP: &str = "\
Examples:
  delta-cal completions bash > /etc/bash_completion.d/delta-cal
  delta-cal completions zsh > ~/.zfunc/_delta-cal
  delta-cal completions fish > ~/.config/fish/completions/delta-cal.fish";

pub(crate) const MAN_HELP: &str = "\
Examples:
  delta-cal man --output ~/.local/share/man/man1
  man delta-cal-calibrate";

#[derive(Debug, Args)]
pub(crate) struct CompletionsArguments {
    /// The shell that is to complete commands and options
    #[arg(value_enum)]
    shell: Shell,
}

#[derive(Debug, Args)]
pub(crate) struct ManArguments {
    /// The folder to write to; the program makes it if it does not exist
    #[arg(long, value_name = "FOLDER")]
    output: PathBuf,
}

/// `command`: the whole.
pub(crate) fn completions(
    arguments: &CompletionsArguments,
    mut command: Command,
) -> Result<(), Failure> {
    let mut text = Vec::new();
    generate(arguments.shell, &mut command, "delta-cal", &mut text);
    print(&String::from_utf8_lossy(&text))
}

pub(crate) fn man(arguments: &ManArguments, mut command: Command) -> Result<(), Failure> {
    let mut pages = Vec::new();
    command.build();
    collect(&command, "delta-cal", &mut pages)
        .map_err(|error| Failure::Output(format!("the manual: {error}")))?;
    output::make_folder(&arguments.output)?;
    let paths = pages.iter().map(|(name, _)| arguments.output.join(name));
    let paths: Vec<_> = paths.collect();
    let texts = pages.iter().map(|(_, text)| text.as_slice());
    let files: Vec<(&Path, &[u8])> = paths.iter().map(PathBuf::as_path).zip(texts).collect();
    output::write_all_bytes(&files)?;
    print(&format!(
        "Written: {} pages in {}\n",
        files.len(),
        arguments.output.display()
    ))
}

/// A page of the command, and one of each below it.
fn collect(
    command: &Command,
    name: &str,
    pages: &mut Vec<(String, Vec<u8>)>,
) -> std::io::Result<()> {
    let mut text = Vec::new();
    clap_mangen::Man::new(command.clone())
        .title(name.to_uppercase())
        .render(&mut text)?;
    pages.push((format!("{name}.1"), text));
    for below in command
        .get_subcommands()
        .filter(|own| own.get_name() != "help")
    {
        collect(below, &format!("{name}-{}", below.get_name()), pages)?;
    }
    Ok(())
}
