//! The test programs of the workspace, as many at a time as there are cores: `cargo test` runs one after
//! the other, so that one long test keeps all cores but one waiting.

use crate::check::{Check, at_root, command};
use serde_json::Value;
use std::cmp::Reverse;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

const BUILD: &str = "cargo test --no-run --message-format=json-render-diagnostics";
/// The documentation's examples, which are no programs of their own.
const EXAMPLES: &str = "cargo test --no-fail-fast --doc";
/// They need QEMU or LinuxCNC; the stages `firmware` and `linuxcnc` run them.
const NOT_HERE: [&str; 2] = ["on_target::", "in_linuxcnc::"];
/// The C library's folder; the stage `c` runs all of its programs, which would write into the same folders.
const C_LIBRARY: &str = "c";

/// How large the tests' campaigns are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Campaigns {
    Short,
    Long,
}

/// One program with tests.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Program {
    /// `delta-cal-host noise`
    name: String,
    executable: PathBuf,
    /// Where `cargo test` would run it.
    directory: PathBuf,
}

/// What is started as one process.
enum Job {
    Examples,
    Program(Program),
}

impl Job {
    fn name(&self) -> &str {
        match self {
            Self::Examples => EXAMPLES,
            Self::Program(program) => &program.name,
        }
    }

    fn output(&self, campaigns: Campaigns) -> std::io::Result<Output> {
        let mut process = match self {
            Self::Examples => command(EXAMPLES),
            Self::Program(program) => {
                let mut process = at_root(&program.executable);
                process
                    .current_dir(&program.directory)
                    .env("CARGO_MANIFEST_DIR", &program.directory)
                    .args(NOT_HERE.iter().flat_map(|name| ["--skip", name]));
                process
            }
        };
        if campaigns == Campaigns::Long {
            process.env("DELTA_CAL_CAMPAIGNS", "long");
        }
        process.output()
    }
}

/// Builds and runs all of them.
pub(crate) fn run(check: &mut Check, campaigns: Campaigns) {
    let mut programs = match build() {
        Ok(programs) => programs,
        Err(why) => return check.fail(why),
    };
    // The largest hold the longest tests: they begin first, so that none is left over for one core alone.
    programs.sort_by_key(|program| Reverse(size(&program.executable)));
    if programs.is_empty() {
        return check.fail(format!("{BUILD} names no program"));
    }
    println!("{} programs", programs.len());
    // The examples first: they are compiled before they run, which takes longer than most programs.
    let jobs = std::iter::once(Job::Examples).chain(programs.into_iter().map(Job::Program));
    let (waiting, check) = (Mutex::new(jobs), Mutex::new(check));
    let at_once = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..at_once {
            scope.spawn(|| {
                while let Some(job) = next(&waiting) {
                    let start = Instant::now();
                    let output = job.output(campaigns);
                    let time = start.elapsed();
                    let mut check = check.lock().unwrap_or_else(PoisonError::into_inner);
                    judge(*check, job.name(), output, time);
                }
            });
        }
    });
}

fn size(file: &Path) -> u64 {
    file.metadata().map_or(0, |it| it.len())
}

fn next(waiting: &Mutex<impl Iterator<Item = Job>>) -> Option<Job> {
    let mut waiting = waiting.lock().unwrap_or_else(PoisonError::into_inner);
    waiting.next()
}

/// Shows what a process wrote, undisturbed by what runs beside it.
fn judge(check: &mut Check, name: &str, output: std::io::Result<Output>, time: Duration) {
    println!("\n$ {name}  ({:.1} s)", time.as_secs_f64());
    match output {
        Ok(output) => {
            print!("{}", String::from_utf8_lossy(&output.stdout));
            if !output.status.success() {
                eprint!("{}", String::from_utf8_lossy(&output.stderr));
                check.fail(format!("{name}: {}", output.status));
            }
        }
        Err(error) => check.fail(format!("{name}: {error}")),
    }
}

fn build() -> Result<Vec<Program>, String> {
    println!("$ {BUILD}");
    let output = command(BUILD)
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("{BUILD}: {error}"))?;
    if !output.status.success() {
        return Err(format!("{BUILD}: {}", output.status));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    let here = |program: &Program| !program.directory.ends_with(C_LIBRARY);
    Ok(text.lines().filter_map(program).filter(here).collect())
}

/// The program of one of cargo's messages, if it is about one with tests.
fn program(message: &str) -> Option<Program> {
    let message: Value = serde_json::from_str(message).ok()?;
    if message["profile"]["test"] != true {
        return None;
    }
    let executable = message["executable"].as_str()?.into();
    let manifest = PathBuf::from(message["manifest_path"].as_str()?);
    let directory = manifest.parent()?.to_owned();
    let package = directory.file_name()?.to_string_lossy();
    Some(Program {
        name: format!("{package} {}", message["target"]["name"].as_str()?),
        executable,
        directory,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_with_tests_are_read_from_cargos_messages() {
        let message = |test: bool, executable: &str| {
            format!(
                r#"{{"reason":"compiler-artifact","manifest_path":"/a/host/Cargo.toml",
                "target":{{"name":"noise"}},"profile":{{"test":{test}}},"executable":{executable}}}"#
            )
        };
        let noise = Program {
            name: "host noise".to_owned(),
            executable: "/t/noise-1".into(),
            directory: "/a/host".into(),
        };
        assert_eq!(program(&message(true, r#""/t/noise-1""#)), Some(noise));
        assert_eq!(program(&message(false, r#""/t/noise-1""#)), None);
        assert_eq!(program(&message(true, "null")), None);
        assert_eq!(
            program(r#"{"reason":"build-finished","success":true}"#),
            None
        );
    }
}
