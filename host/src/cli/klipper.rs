//! `delta-cal klipper`.

use super::failure::Failure;
use super::import::{length, rods, write};
use super::outputs;
use super::paths::is_stream;
use super::print::print;
use crate::InputError;
use crate::files::output;
use crate::import::imported::Imported;
use crate::import::klipper;
use crate::printer::assess::Assessment;
use crate::printer::error::AssessError;
use crate::render::json;
use crate::report::calibration::RefusalReport;
use crate::report::{self, printer};
use clap::Args;
use std::fmt::Write;
use std::path::{Path, PathBuf};

pub(crate) const HELP: &str = "\
The program imports the configuration (delta-cal import klipper), calibrates, and says what is wrong with this printer, how \
sure that is, what to measure next and what to paste. It never changes the configuration and prints no line of it. \
Measurements that no printer within the tolerance explains are refused. docs/klipper.md has the ten steps.

Examples:
  delta-cal klipper printer.cfg
  delta-cal klipper printer.cfg --rods 345
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
    #[arg(long, value_name = "MM[,MM,MM]", value_delimiter = ',', value_parser = length)]
    rods: Option<Vec<f64>>,
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
    super::paths::refuse_same(
        "--json",
        arguments.json.as_deref(),
        ("the configuration", Some(arguments.file.as_path())),
        "give the output another name",
    )?;
    let imported = klipper::import(&arguments.file, rods(arguments.rods.as_deref())?)?;
    if imported.samples_text.is_none() {
        return Err(nothing_saved(&imported));
    }
    let name = imported.source.clone();
    let json_path = arguments.json.as_deref();
    let assessment = Assessment::of(imported).map_err(|error| failure(json_path, &name, error))?;
    let json = json::text(&printer::json(&assessment));
    let mut text = printer::text(&assessment);
    let json_file = arguments.json.as_deref().filter(|path| !is_stream(path));
    if let Some(path) = json_file {
        output::check(path)?;
    }
    if let Some(folder) = &arguments.output {
        let comment = format!(
            "Calibrated by delta-cal {} from the measurements that {name} holds.",
            env!("CARGO_PKG_VERSION")
        );
        let calibrated = assessment.report.after.to_toml(&comment);
        let paste = printer::to_paste(&assessment);
        let files = [
            ("robot.toml", Some(assessment.imported.robot_text.as_str())),
            ("samples.csv", assessment.imported.samples_text.as_deref()),
            ("calibrated.toml", Some(calibrated.as_str())),
            ("paste.cfg", Some(paste.as_str())),
        ];
        text.push('\n');
        for path in write(folder, &files, arguments.force)? {
            let _ = writeln!(text, "Written: {}", path.display());
        }
    }
    match &arguments.json {
        Some(path) if is_stream(path) => print(&json),
        Some(path) => {
            output::write_all(&[(path.as_path(), &json)])?;
            print(&text)
        }
        None => print(&text),
    }
}

/// Klipper saves what it measured; without it there is nothing to calibrate from.
fn nothing_saved(imported: &Imported) -> Failure {
    let cause = "the configuration holds no saved measurements (height0, … in [delta_calibrate])";
    InputError::new(&imported.source, cause)
        .with_remedy(
            "run DELTA_CALIBRATE in Klipper, then SAVE_CONFIG, and give the file that it wrote; docs/klipper.md has \
             the steps",
        )
        .into()
}

fn failure(json: Option<&Path>, name: &str, error: AssessError) -> Failure {
    match error {
        AssessError::Calibrate(error) if error.refused() => {
            let refusal = report::json(&RefusalReport::from(error.as_ref()));
            outputs::refused(json, &refusal, (*error).into())
        }
        AssessError::Calibrate(error) => (*error).into(),
        AssessError::Unexplained { cause, remedy } => {
            let refusal = report::json(&RefusalReport::new(&cause, &remedy));
            outputs::refused(json, &refusal, Failure::NotDetermined { cause, remedy })
        }
        AssessError::Export(error) => InputError::new(name, error.to_string())
            .with_remedy(error.remedy())
            .into(),
    }
}
