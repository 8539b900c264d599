//! `delta-cal klipper`.

use super::failure::Failure;
use super::import::{includes, rods, write};
use super::length::Length;
use super::output;
use super::outputs;
use super::paths::is_stream;
use crate::import::Imported;
use crate::printer::{self, Assessment};
use crate::report::calibration::RefusalReport;
use crate::report::json;
use crate::report::printer as report;
use crate::{InputError, InputText, Options, calibrate};
use clap::Args;
use std::fmt::Write;
use std::path::{Path, PathBuf};

pub(crate) const HELP: &str = "\
The program imports the configuration (delta-cal import klipper), calibrates, and says what is wrong with this printer, how \
sure that is, what to measure next and what to paste. It never changes the configuration and prints no line of it. \
Measurements that no printer within the tolerance explains are refused. docs/printers.md has the steps.

Examples:
  delta-cal klipper printer.cfg
  delta-cal klipper printer.cfg --rods 345mm
  delta-cal klipper printer.cfg --output mine
      writes mine/robot.toml, samples.csv, calibrated.toml and paste.cfg
  delta-cal klipper printer.cfg --json -

Exit codes:
  0  done
  1  the measurements contradict every printer within the tolerance (refused)
  2  the command line is wrong
  3  the configuration is wrong, holds no measurements, or is not of a Delta
  4  a file exists, or could not be written

With exit codes 1, 2 and 3 no file is written or changed.";

#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct KlipperArguments {
    /// Klipper's configuration with the block that SAVE_CONFIG wrote
    #[arg(value_name = "printer.cfg")]
    file: PathBuf,
    /// Of a printer with towers: how long the rods were made, one length or three, in place of arm_length
    #[arg(long, value_name = "LENGTH[,LENGTH,LENGTH]", value_delimiter = ',')]
    rods: Option<Vec<Length>>,
    /// Write robot, samples, calibrated robot and the lines to paste into this folder
    #[arg(long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Write all of it as JSON to this file, or with - to standard output in place of the text
    #[arg(long, value_name = "FILE.json")]
    json: Option<PathBuf>,
}

pub(crate) fn run(arguments: &KlipperArguments) -> Result<(), Failure> {
    if is_stream(&arguments.file) || arguments.output.as_deref().is_some_and(is_stream) {
        return Err(Failure::Usage {
            cause: "the configuration and the folder need names".to_owned(),
            remedy: "write for example delta-cal klipper printer.cfg --output mine".to_owned(),
        });
    }
    let json_path = arguments.json.as_deref();
    super::paths::refuse_same(
        "--json",
        json_path,
        ("the configuration", Some(arguments.file.as_path())),
        "give the output another name",
    )?;
    let input = InputText::from_file(&arguments.file)?;
    let printer = printer::read(&input, rods(arguments.rods.as_deref())?, &includes)?;
    if printer.readings.rows.is_empty() {
        return Err(nothing_saved(&printer));
    }
    let found = calibrate(&printer.robot, &printer.readings, &Options::default());
    let found = found.map_err(|error| {
        let refusal = json(&RefusalReport::from(&error));
        if error.refused() {
            outputs::refused(json_path, &refusal, error.into())
        } else {
            error.into()
        }
    })?;
    let residuals = printer::lack_of_fit(&found);
    if residuals > UNEXPLAINED {
        let worst = printer::worst(&printer, &found).unwrap_or("a measurement");
        return Err(unexplained(json_path, residuals, worst));
    }
    let assessment = Assessment::of(&printer, &found).map_err(|error| {
        InputError::new(&printer.robot.name, error.to_string()).with_remedy(error.remedy())
    })?;
    let json = json(&report::Report::of(&assessment));
    let mut text = report::text(&assessment);
    if let Some(path) = json_path.filter(|path| !is_stream(path)) {
        output::check(path)?;
    }
    if let Some(folder) = &arguments.output {
        let comment = format!(
            "Calibrated by delta-cal {} from the measurements that {} holds.",
            env!("CARGO_PKG_VERSION"),
            printer.robot.name
        );
        let files = [
            ("robot.toml", Some(printer.robot_text())),
            ("samples.csv", printer.samples_text()),
            ("calibrated.toml", Some(found.after.to_toml(&comment))),
            ("paste.cfg", Some(report::to_paste(&assessment))),
        ];
        text.push('\n');
        for path in write(folder, &files, arguments.force)? {
            let _ = writeln!(text, "Written: {}", path.display());
        }
    }
    outputs::deliver(&[(json_path, &json)], text)
}

/// The calibrated robot explains nothing if the residuals are more than so many times what noise and tolerance
/// allow.
const UNEXPLAINED: f64 = 3.0;

fn unexplained(json_path: Option<&Path>, residuals: f64, worst: &str) -> Failure {
    let cause = format!(
        "no printer within the tolerance explains these measurements (residuals {residuals:.1} × expected, {worst} most)"
    );
    let remedy = format!(
        "measure {worst} again; check that the rods' length (--rods) and the belts' rotation_distance are right and \
         that nothing is loose"
    );
    let refusal = json(&RefusalReport::new(&cause, &remedy));
    outputs::refused(
        json_path,
        &refusal,
        Failure::NotDetermined { cause, remedy },
    )
}

/// Klipper saves what it measured; without it there is nothing to calibrate from.
fn nothing_saved(printer: &Imported) -> Failure {
    let cause = "the configuration holds no saved measurements (height0, … in [delta_calibrate])";
    InputError::new(&printer.robot.name, cause)
        .with_remedy(
            "run DELTA_CALIBRATE in Klipper, then SAVE_CONFIG, and give the file that it wrote; docs/printers.md has the \
             steps",
        )
        .into()
}
