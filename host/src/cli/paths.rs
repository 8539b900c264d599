//! Paths on the command line: reading them, and finding out which are the same file.

use super::failure::Failure;
use crate::{ColumnMapping, InputError, InputText};
use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser};
use std::fs::File;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

/// Whether the path means standard input or output.
pub(crate) fn is_stream(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Parses the name of a robot file.
pub(crate) fn robot_path() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| {
        if is_stream(&path) {
            Err("the robot file cannot come from standard input: give its name")
        } else {
            Ok(path)
        }
    })
}

/// What the columns of a table hold.
#[derive(Debug, Args)]
pub(crate) struct ColumnsArgument {
    /// Other column names: the standard name before each =, the name in the file after it
    #[arg(long, value_name = "q1_deg=A1,x_mm=X,...")]
    columns: Option<ColumnMapping>,
}

impl InputText {
    /// Reads a robot or campaign file.
    ///
    /// # Errors
    /// Same as [`of_settings`](Self::of_settings).
    pub fn from_file(path: &Path) -> Result<Self, InputError> {
        Self::of_settings(path.display().to_string(), opened(path)?)
    }

    /// Reads a table: samples, joint angles, positions.
    ///
    /// # Errors
    /// Same as [`from_reader`](Self::from_reader).
    pub fn from_table(path: &Path) -> Result<Self, InputError> {
        Self::from_reader(path.display().to_string(), opened(path)?)
    }
}

fn opened(path: &Path) -> Result<File, InputError> {
    File::open(path).map_err(|error| InputError::unreadable(&path.display().to_string(), &error))
}

/// Reads a table from a file, or from standard input for `-`.
pub(crate) fn read(path: &Path, columns: &ColumnsArgument) -> Result<InputText, InputError> {
    let text = if is_stream(path) {
        let stdin = std::io::stdin().lock();
        if stdin.is_terminal() {
            let _ = writeln!(
                anstream::stderr(),
                "reading CSV from standard input; end it with Ctrl-D"
            );
        }
        InputText::from_reader("standard input", stdin)?
    } else {
        InputText::from_table(path)?
    };
    Ok(match &columns.columns {
        Some(columns) => text.with_columns(columns.clone()),
        None => text,
    })
}

/// Reads samples from one file, or joints and positions from two.
pub(crate) fn read_samples_texts(
    samples: &Path,
    second: Option<&Path>,
    columns: &ColumnsArgument,
) -> Result<InputText, InputError> {
    let first = read(samples, columns)?;
    match second {
        None => Ok(first),
        Some(second) => Ok(read(second, columns)?.with_beside(first)),
    }
}

/// The folder that a file is in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The file a path leads to, whether or not it exists yet.
fn identity(path: &Path) -> PathBuf {
    if let Ok(existing) = path.canonicalize() {
        return existing;
    }
    match (folder_of(path).canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_owned(),
    }
}

/// Refuses an output file that is one of the command's other files.
pub(crate) fn refuse_same(
    option: &str,
    output: Option<&Path>,
    (what, other): (&str, Option<&Path>),
    remedy: &str,
) -> Result<(), Failure> {
    match (output, other) {
        (Some(output), Some(other))
            if !is_stream(output) && identity(output) == identity(other) =>
        {
            Err(Failure::usage(
                format!("{option} {} is the same file as {what}", output.display()),
                remedy,
            ))
        }
        _ => Ok(()),
    }
}
