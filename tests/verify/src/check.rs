//! Running commands and remembering which failed.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What went wrong in one stage.
#[derive(Debug, Default)]
pub(crate) struct Check {
    /// The files that it is about, if not about all.
    pub(crate) files: Vec<String>,
    failures: Vec<String>,
    skipped: Option<String>,
}

impl Check {
    /// Of these files, or of all.
    pub(crate) fn of(files: &[String]) -> Self {
        Self {
            files: files.to_vec(),
            ..Self::default()
        }
    }

    /// Runs a command that must succeed; its output goes to the terminal.
    pub(crate) fn command(&mut self, line: &str) {
        if let Err(why) = attempt(line) {
            self.fail(why);
        }
    }

    /// Runs commands that must succeed, those of each list one after the other, the lists side by side.
    pub(crate) fn side_by_side(&mut self, lists: &[Vec<String>]) {
        let failed = |list: &'_ Vec<String>| -> Vec<String> {
            let failures = list.iter().filter_map(|line| attempt(line).err());
            failures.collect()
        };
        let failures = std::thread::scope(|scope| {
            let running: Vec<_> = lists
                .iter()
                .map(|list| scope.spawn(move || failed(list)))
                .collect();
            let ended = running.into_iter().map(std::thread::ScopedJoinHandle::join);
            ended.collect::<Vec<_>>()
        });
        for list in failures {
            for failure in
                list.unwrap_or_else(|_| vec!["a command could not be watched".to_owned()])
            {
                self.fail(failure);
            }
        }
    }

    /// Runs tests that are chosen by name. So many programs must have some of that name: after a
    /// renaming they would have none, and `cargo test` would succeed.
    pub(crate) fn chosen_tests(&mut self, programs: usize, line: &str) {
        match programs_with_tests(line) {
            Ok(count) if count < programs => self.fail(format!(
                "{line}: of {programs} programs {count} have a test of such a name"
            )),
            Ok(_) => {}
            Err(why) => self.fail(why),
        }
    }

    /// Notes a failure that is not a command's.
    pub(crate) fn fail(&mut self, what: String) {
        eprintln!("FAILED: {what}");
        self.failures.push(what);
    }

    /// Notes why the stage checks nothing here.
    pub(crate) fn skip(&mut self, why: &str) {
        println!("skipped: {why}");
        self.skipped = Some(why.to_owned());
    }

    /// Why nothing was checked.
    pub(crate) fn take_skipped(&mut self) -> Option<String> {
        self.skipped.take()
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

/// Runs tests that must succeed, and counts the programs that held any; their output goes to the terminal.
fn programs_with_tests(line: &str) -> Result<usize, String> {
    println!("$ {line}");
    let mut child = command(line)
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| format!("{line}: {error}"))?;
    let mut count = 0;
    for text in child
        .stdout
        .take()
        .map(BufReader::new)
        .into_iter()
        .flat_map(BufRead::lines)
    {
        let text = text.map_err(|error| format!("{line}: {error}"))?;
        println!("{text}");
        count += usize::from(tests_announced(&text).is_some_and(|tests| tests > 0));
    }
    match child.wait() {
        Ok(status) if status.success() => Ok(count),
        Ok(status) => Err(format!("{line}: {status}")),
        Err(error) => Err(format!("{line}: {error}")),
    }
}

/// `running 3 tests`, the first line of every test program.
fn tests_announced(line: &str) -> Option<u64> {
    let (number, noun) = line.strip_prefix("running ")?.split_once(' ')?;
    matches!(noun, "test" | "tests")
        .then(|| number.parse().ok())
        .flatten()
}

/// A command at the repository's root, its words separated by spaces.
pub(crate) fn command(line: &str) -> Command {
    let mut words = line.split_whitespace();
    let mut command = at_root(words.next().unwrap_or_default());
    command.args(words);
    command
}

/// A program at the repository's root.
pub(crate) fn at_root(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(program);
    command.current_dir(root()).stdin(Stdio::null());
    command
}

/// The repository's root.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Beside the directory that this program was built in.
pub(crate) fn directory(name: &str) -> PathBuf {
    std::env::current_exe()
        .ok()
        .as_deref()
        .and_then(Path::parent)
        .and_then(Path::parent)
        .unwrap_or(Path::new("target"))
        .join(name)
}

/// Standard output of a command, `None` if it fails.
pub(crate) fn output(line: &str) -> Option<String> {
    let output = command(line).stderr(Stdio::null()).output().ok()?;
    output
        .status
        .success()
        .then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_are_counted_by_what_their_programs_announce() {
        assert_eq!(tests_announced("running 0 tests"), Some(0));
        assert_eq!(tests_announced("running 1 test"), Some(1));
        assert_eq!(tests_announced("running 12 tests"), Some(12));
        assert_eq!(tests_announced("running 12 robots"), None);
        assert_eq!(tests_announced("test running ... ok"), None);
    }
}
