//! Running commands and remembering which failed.

use std::path::Path;
use std::process::{Command, Stdio};

/// What went wrong in one stage.
#[derive(Debug, Default)]
pub(crate) struct Check {
    failures: Vec<String>,
}

impl Check {
    /// Runs a command that must succeed; its output goes to the terminal.
    pub(crate) fn command(&mut self, line: &str) {
        if let Err(why) = attempt(line) {
            self.fail(why);
        }
    }

    /// Notes a failure that is not a command's.
    pub(crate) fn fail(&mut self, what: String) {
        eprintln!("FAILED: {what}");
        self.failures.push(what);
    }

    pub(crate) fn into_failures(self) -> Vec<String> {
        self.failures
    }
}

/// Runs a command that may fail; its output goes to the terminal.
pub(crate) fn attempt(line: &str) -> Result<(), String> {
    println!("$ {line}");
    match command(line).status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{line}: {status}")),
        Err(error) => Err(format!("{line}: {error}")),
    }
}

/// A command at the repository's root, its words separated by spaces.
fn command(line: &str) -> Command {
    let mut words = line.split_whitespace();
    let mut command = Command::new(words.next().unwrap_or_default());
    command
        .args(words)
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
        .stdin(Stdio::null());
    command
}

/// Standard output of a command, `None` if it fails.
pub(crate) fn output(line: &str) -> Option<String> {
    let output = command(line).stderr(Stdio::null()).output().ok()?;
    output
        .status
        .success()
        .then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}
