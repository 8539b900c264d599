//! Paths on the command line: reading them, and finding out which are the same file.

use super::failure::Failure;
use crate::{ColumnMapping, InputError, InputText};
use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::parser::ValueSource;
use clap::{ArgMatches, Args};
use std::fs::File;
use std::io::{IsTerminal, Write};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// Whether a robot file has the usual ending, which no printer's configuration has.
pub(crate) fn is_toml(path: &Path) -> bool {
    path.extension().is_some_and(|own| own == "toml")
}

/// The printer's configuration in a folder; any other path as it is.
pub(crate) fn in_folder(path: &Path) -> PathBuf {
    let own = ["printer.cfg", "config.g", "Configuration.h"].map(|name| path.join(name));
    let own = own.into_iter().find(|own| own.is_file());
    own.unwrap_or_else(|| path.to_owned())
}

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
    /// Column names of the file: STANDARD=NAME, separated by commas
    #[arg(long, value_name = "q1_deg=A1,x_mm=X,...")]
    pub(crate) columns: Option<ColumnMapping>,
    /// Use only the rows in these lines
    #[arg(long, value_name = "FIRST..LAST", value_parser = lines)]
    pub(crate) rows: Option<RangeInclusive<u64>>,
}

/// The first of these options that is on the command line.
pub(crate) fn given<'a>(arguments: &ArgMatches, options: &[&'a str]) -> Option<&'a str> {
    let mut options = options.iter().copied();
    options.find(|own| arguments.value_source(own) == Some(ValueSource::CommandLine))
}

/// Refuses what is said of a table where there is none.
pub(crate) fn without_table(arguments: &ArgMatches, example: &str) -> Result<(), Failure> {
    match given(arguments, &["columns", "rows"]) {
        None => Ok(()),
        Some(option) => Err(Failure::usage(
            format!("--{option} needs a samples file"),
            format!("leave it out, or give one as well: {example}"),
        )),
    }
}

/// `2..23`, `24..` or `..23`: the last line is included.
fn lines(text: &str) -> Result<RangeInclusive<u64>, String> {
    let end = |own: &str, open: u64| match own.trim() {
        "" => Some(open),
        own => own.parse().ok(),
    };
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    match (end(first, 1), end(last, u64::MAX)) {
        (Some(first), Some(last)) if first <= last => Ok(first..=last),
        _ => Err("the first and the last line are needed, such as 2..23".to_owned()),
    }
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
    let text = match &columns.columns {
        Some(columns) => text.with_columns(columns.clone()),
        None => text,
    };
    Ok(match &columns.rows {
        Some(lines) => text.with_lines(lines.clone()),
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
    let second = second.map(|second| read(second, columns)).transpose()?;
    Ok(first.joined(second))
}

/// The folder that a file is in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The file a path leads to, whether or not it exists yet: also that of a symbolic link.
pub(crate) fn identity(path: &Path) -> PathBuf {
    if let Ok(existing) = path.canonicalize() {
        return existing;
    }
    let linked = path.read_link().map(|own| folder_of(path).join(own));
    let path = linked.as_deref().unwrap_or(path);
    match (folder_of(path).canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_owned(),
    }
}

/// A name for a file, or the option that gives it, and its path.
pub(crate) type Place<'a> = (&'static str, &'a Path);

const ROBOT: &str = "the robot file";
/// The arguments for files that commands read, and names for these files.
const INPUTS: [(&str, &str); 9] = [
    ("robot", ROBOT),
    ("samples", "the samples file"),
    ("second", "the positions file"),
    ("nominal", "the nominal robot"),
    ("positions", "the positions"),
    ("bed", "the heights"),
    ("file", "the input file"),
    ("campaign", "the campaign file"),
    ("summary", "a file of rows"),
];
/// The options for files that commands write.
const OUTPUTS: [(&str, &str); 4] = [
    ("output", "--output"),
    ("paste", "--paste"),
    ("json", "--json"),
    ("report", "--report"),
];

/// [Checks](check) the files of a command.
pub(crate) fn check_arguments(arguments: &ArgMatches) -> Result<(), Failure> {
    let places = |of: &[(&str, &'static str)]| -> Vec<Place<'_>> {
        let given = of.iter().flat_map(|(id, what)| {
            let paths = arguments.try_get_many::<PathBuf>(id).ok().flatten();
            let paths = paths.into_iter().flatten();
            paths.map(|path| (*what, path.as_path()))
        });
        given.collect()
    };
    let replaces_robot = arguments
        .try_get_one::<bool>("replace_robot")
        .ok()
        .flatten();
    check(&places(&INPUTS), &places(&OUTPUTS), replaces_robot.copied())
}

/// Checks that no output is an input or another output, and that at most one goes to standard output. `replaces_robot`:
/// whether --output may be the robot file, if the command has an option for that; a printer's configuration is never replaced.
pub(crate) fn check(
    inputs: &[Place<'_>],
    outputs: &[Place<'_>],
    replaces_robot: Option<bool>,
) -> Result<(), Failure> {
    let mut files = inputs.to_vec();
    let mut streams = Vec::new();
    for (option, path) in outputs {
        if is_stream(path) {
            streams.push(option);
            continue;
        }
        for (what, other) in &files {
            let remedy = match replaces_robot {
                Some(replaces) if (*option, *what) == ("--output", ROBOT) && is_toml(other) => {
                    if replaces {
                        continue;
                    }
                    "give the output another name, or --force to replace the robot file"
                }
                _ => "give the output another name",
            };
            if identity(path) == identity(&in_folder(other)) {
                let cause = format!("{option} {} is the same file as {what}", path.display());
                return Err(Failure::usage(cause, remedy));
            }
        }
        files.push((option, path));
    }
    match streams.as_slice() {
        [first, second, ..] => Err(Failure::usage(
            format!("{first} - and {second} - both write to standard output"),
            "give one of them the name of a file",
        )),
        _ => Ok(()),
    }
}
