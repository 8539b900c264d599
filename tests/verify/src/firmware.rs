//! Building programs for the bare target and running them under QEMU.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The Rust target of a Cortex-M with a floating-point unit.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// The target of the Raspberry Pi Pico 2, a Cortex-M33.
pub const BOARD_TARGET: &str = "thumbv8m.main-none-eabihf";

/// Targets of other people's boards, for which the controller builds: a Cortex-M0+, a RISC-V core, and the one above.
pub const OTHER_TARGETS: [&str; 3] = [
    "thumbv6m-none-eabi",
    "riscv32imac-unknown-none-elf",
    BOARD_TARGET,
];
/// The workspace's profile of what is built for it.
pub const PROFILE: &str = "firmware";
/// The programs of this package run on host and target.
pub const PACKAGE: &str = "delta-cal-target-tests";
/// A run takes at most a minute; a firmware that hangs must not hang the tests. What is built takes as long as the
/// machine needs.
const LONGEST_RUN: Duration = Duration::from_secs(600);

/// An emulated board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Board {
    /// Cortex-M4F: single precision in hardware.
    M4,
    /// Cortex-M7: both precisions in hardware.
    M7,
}

impl Board {
    fn machine(self) -> &'static str {
        match self {
            Self::M4 => "mps2-an386",
            Self::M7 => "mps2-an500",
        }
    }
}

/// How a program is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// As fast as it goes.
    Free,
    /// So that the board's timer counts instructions, and every run is the same.
    Instructions,
}

/// Runs cargo at the repository's root with a target directory of its own, so that no other build
/// exchanges the programs meanwhile.
///
/// # Errors
/// What failed, in words; so with all functions here.
pub fn cargo(directory: &Path, arguments: &[&str]) -> Result<String, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = at_root(cargo);
    command
        .args(arguments)
        .arg("--quiet")
        .arg("--target-dir")
        .arg(directory);
    run(command)
}

/// Builds the programs of [`PACKAGE`] for the bare target, and returns where they are.
///
/// # Errors
/// The target that is not installed, or what failed.
pub fn build_for_target(directory: &Path, arguments: &[&str]) -> Result<PathBuf, String> {
    require_target()?;
    let build = ["build", "--profile", PROFILE, "--package", PACKAGE];
    let build = [&build[..], &["--target", TARGET]].concat();
    cargo(directory, &[&build[..], arguments].concat())?;
    Ok(directory.join(TARGET).join(PROFILE))
}

/// Whether the bare target is installed.
///
/// # Errors
/// How to install it.
pub fn require_target() -> Result<(), String> {
    let mut rustc = at_root("rustc");
    rustc.args(["--print", "target-libdir", "--target", TARGET]);
    if Path::new(run(rustc)?.trim()).is_dir() {
        Ok(())
    } else {
        Err(format!(
            "the Rust target is missing; install it: rustup target add {TARGET}"
        ))
    }
}

/// Standard output of a program on a board; it must end itself with success.
///
/// # Errors
/// QEMU that is not installed, or the program's failure.
pub fn emulate(board: Board, clock: Clock, program: &Path) -> Result<String, String> {
    let mut command = Command::new("qemu-system-arm");
    command
        .args(["-machine", board.machine()])
        .args("-nographic -monitor none -serial none".split(' '))
        .args("-semihosting-config enable=on,target=native".split(' '));
    if clock == Clock::Instructions {
        command.args("-icount shift=6,sleep=off".split(' '));
    }
    command.arg("-kernel").arg(program);
    within(command, LONGEST_RUN)
}

fn at_root(program: impl AsRef<std::ffi::OsStr>) -> Command {
    let mut command = Command::new(program);
    command.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    command
}

/// Standard output of a command that must succeed.
///
/// # Errors
/// Its failure, with the end of what it wrote: a failure that was expected leaves no trace on the terminal.
pub fn run(command: Command) -> Result<String, String> {
    within(command, Duration::MAX)
}

fn within(mut command: Command, limit: Duration) -> Result<String, String> {
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| format!("{}: {error}", command.get_program().display()))?;
    let (output, errors) = (reader(child.stdout.take()), reader(child.stderr.take()));
    let start = Instant::now();
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if start.elapsed() > limit => {
                let _ = child.kill();
                return Err(format!("{command:?} has not ended after {limit:?}"));
            }
            Ok(None) => std::thread::sleep(Duration::from_millis(20)),
            Err(error) => return Err(format!("{command:?}: {error}")),
        }
    };
    let (Ok(output), Ok(errors)) = (output.join(), errors.join()) else {
        return Err(format!("{command:?}: its output cannot be read"));
    };
    if status.success() {
        eprint!("{errors}");
        Ok(output)
    } else {
        let (output, errors) = (tail(&output), tail(&errors));
        Err(format!("{command:?}: {status}\n{output}{errors}"))
    }
}

/// Reads a pipe to its end, so that what writes into it never waits.
fn reader(pipe: Option<impl Read + Send + 'static>) -> std::thread::JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            // What came before a fault is still worth showing.
            let _ = pipe.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

fn tail(text: &str) -> &str {
    let start = text.len().saturating_sub(2000);
    text.get(start..).unwrap_or(text)
}
