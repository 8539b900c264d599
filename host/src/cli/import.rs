//! `delta-cal import`.

use super::failure::Failure;
use super::output::{self, deliver};
use super::paths::{in_folder, is_stream};
use crate::files::{length::Measured, length::measured};
use crate::import::{Firmware, Imported, Stated, printed, shrinkage};
use crate::{InputError, InputText};
use clap::Args;
use delta_cal::robot::Drive;
use std::fmt::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/import.txt"))]
pub(crate) struct ImportArguments {
    /// The configuration, after the name of its firmware where that is not evident
    #[arg(value_name = "[CONTROLLER] FILE", num_args = 1..=2, required = true)]
    configuration: Vec<PathBuf>,
    /// The folder to write to; the program makes it if it does not exist
    #[arg(long = "output", value_name = "FOLDER")]
    folder: PathBuf,
    #[command(flatten)]
    stated: StatedArguments,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

/// What the owner of a printer knows beside its configuration.
#[derive(Debug, Args)]
pub(crate) struct StatedArguments {
    /// A printer's rods: 345mm as made, 345±0.1mm as measured
    #[arg(long, value_name = "LENGTH", value_parser = measured, value_delimiter = ',')]
    rods: Option<Vec<Measured>>,
    /// Its delta radius
    #[arg(long, value_name = "LENGTH", value_parser = measured)]
    radius: Option<Measured>,
    /// Lengths as designed and as printed, mm
    #[arg(long, value_name = "100=98.5", value_parser = printed)]
    printed: Vec<[f64; 2]>,
    /// Shrinkage of prints: 0.3%
    #[arg(long, value_name = "PERCENT", value_parser = shrinkage)]
    shrinkage: Option<f64>,
}

impl StatedArguments {
    pub(crate) fn stated(&self) -> Result<Stated, Failure> {
        let stated = Stated {
            printed: self.printed.clone(),
            shrinkage: self.shrinkage,
            ..Stated::default()
        };
        let rods = self.rods.as_deref().unwrap_or_default();
        let stated = stated.with_rods(rods).map_err(|cause| {
            Failure::usage(
                format!("--rods {cause}"),
                "write for example --rods 345mm or --rods 345.1mm,344.9mm,345.0mm",
            )
        })?;
        Ok(stated.with_radius(self.radius))
    }
}

/// Reads a configuration file, or the one in a folder.
pub(crate) fn configuration(path: &Path) -> Result<InputText, InputError> {
    InputText::from_file(&in_folder(path))
}

/// The files included by a line of the configuration `from`, relative to its folder; patterns follow Python's `glob`.
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
    let names = arguments.configuration.as_slice();
    let (file, controller) = names.split_last().unwrap_or((&arguments.folder, &[]));
    if is_stream(file) || is_stream(&arguments.folder) {
        return Err(Failure::usage(
            "the configuration and the folder need names",
            "write for example delta-cal import klipper printer.cfg --output mine",
        ));
    }
    let stated = arguments.stated.stated()?;
    let input = configuration(file)?;
    let firmware = match controller {
        [] => Firmware::of(&input)?,
        [name, ..] => Firmware::named(&name.to_string_lossy()).ok_or_else(|| {
            let known = Firmware::ALL.map(Firmware::name).join(", ");
            Failure::usage(
                format!("{} is no controller to import from", name.display()),
                format!("write the file alone, or after one of {known}"),
            )
        })?,
    };
    let imported = firmware.import(&input, &stated, &includes)?;
    let imported = imported.with_prints(&stated, &[])?;
    let folder = arguments.folder.as_path();
    let (robot, samples) = (folder.join("robot.toml"), folder.join("samples.csv"));
    let samples_text = imported.samples_text();
    let files = [
        (Some(robot.as_path()), imported.robot_text()),
        (
            samples_text.as_ref().map(|_| samples.as_path()),
            samples_text.unwrap_or_default(),
        ),
    ];
    let mut paths = files.iter().filter_map(|(path, _)| *path);
    if let Some(path) = paths.find(|path| !arguments.force && path.exists()) {
        return Err(Failure::output(format!(
            "{}: the file exists, and is only replaced with --force",
            path.display()
        )));
    }
    output::make_folder(folder)?;
    deliver(&files, text(&imported, folder))
}

fn text(imported: &Imported, folder: &Path) -> String {
    let mut text = String::new();
    for note in &imported.notes {
        let _ = writeln!(text, "{note}");
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
