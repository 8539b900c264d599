//! `delta-cal import`.

use super::failure::Failure;
use super::length::Length;
use super::output;
use super::output::print;
use super::paths::is_stream;
use crate::import::{Firmware, Imported};
use crate::{InputError, InputText};
use clap::Args;
use clap::builder::PossibleValuesParser;
use delta_cal::robot::Drive;
use std::fmt::Write;
use std::path::{Path, PathBuf};

pub(crate) const HELP: &str = "\
CONTROLLER is one of:
  klipper           printer.cfg: kinematics: delta or rotary_delta, and the
                    measurements that DELTA_CALIBRATE and DELTA_ANALYZE saved
  reprapfirmware    config.g or config-override.g: M665 and M666
  marlin            what M503 prints: M665 and M666

The program writes robot.toml and, if the configuration holds measurements, samples.csv. It never changes the configuration, \
keeps nothing of sections that the geometry does not need, and prints no line of it.

Examples:
  delta-cal import klipper printer.cfg --rods 345mm --output mine
  delta-cal import reprapfirmware config.g --output mine

Exit codes:
  0  the files are written
  2  the command line is wrong
  3  the configuration is wrong, or it is not of a Delta robot
  4  a file exists, or could not be written

With exit codes 2 and 3 no file is written or changed.";

#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct ImportArguments {
    /// Whose configuration it is; the controllers are listed below
    #[arg(value_name = "CONTROLLER", value_parser = PossibleValuesParser::new(Firmware::ALL.map(Firmware::name)), hide_possible_values = true)]
    controller: String,
    /// The configuration
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The folder to write to; the program makes it if it does not exist
    #[arg(long, value_name = "FOLDER")]
    output: PathBuf,
    /// How long the rods were made, one length or three, in place of those of the configuration
    #[arg(long, value_name = "LENGTH[,LENGTH,LENGTH]", value_delimiter = ',')]
    rods: Option<Vec<Length>>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

/// One length for all rods, or three.
pub(crate) fn rods(values: Option<&[Length]>) -> Result<Option<[f64; 3]>, Failure> {
    match values {
        None => Ok(None),
        Some([Length(all)]) => Ok(Some([*all; 3])),
        Some([Length(a), Length(b), Length(c)]) => Ok(Some([*a, *b, *c])),
        Some(_) => Err(Failure::Usage {
            cause: "--rods needs one length, or three".to_owned(),
            remedy: "write for example --rods 345mm or --rods 345.1mm,344.9mm,345.0mm".to_owned(),
        }),
    }
}

/// The files that a line of a configuration includes, beside the file with the line; patterns as Python's `glob` has
/// them.
pub(crate) fn includes(from: &str, wanted: &str) -> Result<Vec<InputText>, InputError> {
    let folder = Path::new(from).parent().unwrap_or_else(|| Path::new(""));
    let literal = folder.join(wanted);
    if literal.is_file() {
        return Ok(vec![InputText::from_file(&literal)?]);
    }
    let folder = glob::Pattern::escape(&folder.to_string_lossy());
    let pattern = Path::new(&folder).join(wanted);
    let options = glob::MatchOptions {
        require_literal_leading_dot: true,
        require_literal_separator: true,
        ..glob::MatchOptions::new()
    };
    let Ok(found) = glob::glob_with(&pattern.to_string_lossy(), options) else {
        return Ok(Vec::new());
    };
    let files = found.flatten().filter(|path| path.is_file());
    files.map(|path| InputText::from_file(&path)).collect()
}

pub(crate) fn run(arguments: &ImportArguments) -> Result<(), Failure> {
    if is_stream(&arguments.file) || is_stream(&arguments.output) {
        return Err(Failure::Usage {
            cause: "the configuration and the folder need names".to_owned(),
            remedy: "write for example delta-cal import klipper printer.cfg --output mine"
                .to_owned(),
        });
    }
    let rods = rods(arguments.rods.as_deref())?;
    let mut all = Firmware::ALL.into_iter();
    let firmware = all.find(|own| own.name() == arguments.controller);
    let firmware = firmware.unwrap_or(Firmware::Klipper);
    let input = InputText::from_file(&arguments.file)?;
    let imported = firmware.import(&input, rods, &includes)?;
    let files = [
        ("robot.toml", Some(imported.robot_text())),
        ("samples.csv", imported.samples_text()),
    ];
    let written = write(&arguments.output, &files, arguments.force)?;
    print(&text(&imported, &arguments.output, &written))
}

/// Writes those files that have a text into a folder, all or none.
pub(crate) fn write(
    folder: &Path,
    files: &[(&str, Option<String>)],
    force: bool,
) -> Result<Vec<PathBuf>, Failure> {
    let files = files
        .iter()
        .filter_map(|(name, text)| Some((folder.join(name), text.as_deref()?)));
    let files: Vec<_> = files.collect();
    if let Some((path, _)) = files.iter().find(|(path, _)| !force && path.exists()) {
        return Err(Failure::Output(format!(
            "{}: the file exists, and is only replaced with --force",
            path.display()
        )));
    }
    output::make_folder(folder)?;
    let texts: Vec<_> = files
        .iter()
        .map(|(path, text)| (path.as_path(), *text))
        .collect();
    output::write_all(&texts)?;
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

fn text(imported: &Imported, folder: &Path, written: &[PathBuf]) -> String {
    let mut text = String::new();
    for note in &imported.notes {
        let _ = writeln!(text, "{note}");
    }
    for path in written {
        let _ = writeln!(text, "Written: {}", path.display());
    }
    let folder = folder.display();
    let [heights, distances] = imported.counts();
    if heights + distances > 0 {
        let _ = writeln!(
            text,
            "samples.csv holds {heights} heights and {distances} distances.\nNext: delta-cal calibrate \
             {folder}/robot.toml {folder}/samples.csv --output {folder}/calibrated.toml"
        );
    } else {
        if imported.firmware == Firmware::Klipper {
            text.push_str(
                "The configuration holds no saved measurements. Run DELTA_CALIBRATE and SAVE_CONFIG in Klipper and import \
                 the file that it wrote, or plan measurements.\n",
            );
        }
        let _ = writeln!(
            text,
            "Next: delta-cal plan {folder}/robot.toml --measure plane --count 20 --output {folder}/samples.csv"
        );
    }
    let [a, b, c] = match imported.robot.robot.drive() {
        Drive::Linear => imported.home,
        Drive::Rotary => imported.home.map(f64::to_degrees),
    };
    let _ = writeln!(
        text,
        "The end stops, for delta-cal export: --home {a:.6},{b:.6},{c:.6}"
    );
    text
}
