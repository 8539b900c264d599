//! The example's firmware, built from the workspace that delta-cal is run in.

use object::{Architecture, Object};
use std::error::Error;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const TARGET: &str = "thumbv7em-none-eabihf";
const PACKAGE: &str = "delta-cal-firmware-example";
const FOLDER: &str = "firmware-example";
/// Of the workspace: optimised as a whole.
const PROFILE: &str = "firmware";

/// Why there is no firmware.
#[derive(Debug)]
pub enum FirmwareError {
    /// Not run inside the workspace.
    NoWorkspace,
    /// Cargo cannot be started.
    NoCargo(io::Error),
    /// The Rust target is not installed.
    NoTarget,
    /// The build failed; its messages were printed.
    Failed,
    /// The build says nothing of a program.
    NoProgram,
    /// A file that was named cannot be read.
    Unreadable(PathBuf, io::Error),
    /// A file that was named is no program for a Cortex-M.
    NotFirmware(PathBuf),
}

impl fmt::Display for FirmwareError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoWorkspace => write!(
                formatter,
                "there is no firmware: the folder is not in delta-cal's workspace, where {FOLDER} is"
            ),
            Self::NoCargo(error) => {
                write!(formatter, "the firmware cannot be built: cargo: {error}")
            }
            Self::NoTarget => write!(
                formatter,
                "the firmware cannot be built: the Rust target {TARGET} is missing"
            ),
            Self::Failed | Self::NoProgram => formatter.write_str("the firmware's build failed"),
            Self::Unreadable(path, error) => {
                write!(formatter, "{}: cannot be read: {error}", path.display())
            }
            Self::NotFirmware(path) => {
                write!(
                    formatter,
                    "{}: is not a program for a Cortex-M (ELF)",
                    path.display()
                )
            }
        }
    }
}

impl Error for FirmwareError {}

impl FirmwareError {
    /// What to do next.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::NoWorkspace => {
                "run it in a checkout of delta-cal, or name a firmware with --firmware ELF"
            }
            Self::NoCargo(_) => {
                "install Rust (https://rustup.rs), or name a firmware with --firmware ELF"
            }
            Self::NoTarget => "install it: rustup target add thumbv7em-none-eabihf",
            Self::Failed | Self::NoProgram => "see cargo's messages above",
            Self::Unreadable(..) | Self::NotFirmware(_) => "check the name after --firmware",
        }
    }
}

/// Checks that a file is a program for a Cortex-M.
///
/// # Errors
/// It cannot be read, or is none.
pub fn check(file: &Path) -> Result<(), FirmwareError> {
    let program =
        std::fs::read(file).map_err(|error| FirmwareError::Unreadable(file.to_owned(), error))?;
    match object::File::parse(&*program) {
        Ok(elf) if elf.architecture() == Architecture::Arm => Ok(()),
        _ => Err(FirmwareError::NotFirmware(file.to_owned())),
    }
}

/// Builds the firmware, in `f64` if `double`, of the workspace that the current folder is in, once that is found and
/// announced; cargo prints its progress.
///
/// # Errors
/// No workspace, cargo or target; a build that fails.
pub fn build(double: bool, announce: impl FnOnce()) -> Result<PathBuf, FirmwareError> {
    let workspace = workspace().ok_or(FirmwareError::NoWorkspace)?;
    announce();
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command
        .current_dir(&workspace)
        .args(["build", "--profile", PROFILE, "--target", TARGET])
        .args([
            "--package",
            PACKAGE,
            "--bin",
            PACKAGE,
            "--features",
            "board",
        ])
        .args(["--message-format", "json-render-diagnostics"])
        .stdin(Stdio::null())
        .stderr(Stdio::inherit());
    if double {
        // A folder of its own: an emulation of the other firmware may be about to load its program.
        let folder = workspace.join("target").join("double");
        command
            .args(["--features", "double", "--target-dir"])
            .arg(folder);
    }
    let output = command.output().map_err(FirmwareError::NoCargo)?;
    if !output.status.success() {
        return Err(if target_installed(&workspace) {
            FirmwareError::Failed
        } else {
            FirmwareError::NoTarget
        });
    }
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(program)
        .next_back()
        .ok_or(FirmwareError::NoProgram)
}

/// The program that a line of cargo's messages says was built.
fn program(line: &str) -> Option<PathBuf> {
    let message: serde_json::Value = serde_json::from_str(line).ok()?;
    Some(message.get("executable")?.as_str()?.into())
}

/// The nearest folder upwards that holds the workspace.
fn workspace() -> Option<PathBuf> {
    let here = std::env::current_dir().ok()?;
    let found = here.ancestors().find(|folder| {
        folder.join("Cargo.toml").is_file() && folder.join(FOLDER).join("Cargo.toml").is_file()
    })?;
    Some(found.to_owned())
}

fn target_installed(workspace: &Path) -> bool {
    let output = Command::new("rustc")
        .current_dir(workspace)
        .args(["--print", "target-libdir", "--target", TARGET])
        .stdin(Stdio::null())
        .output();
    match output {
        Ok(output) if output.status.success() => {
            Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir()
        }
        // Not to be known: then cargo's messages have to do.
        _ => true,
    }
}
