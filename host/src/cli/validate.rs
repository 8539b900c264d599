//! `delta-cal validate`.

use super::choices::FrameArgument;
use super::failure::Failure;
use super::length::Length;
use super::outputs::{self, deliver};
use super::paths::{ColumnsArgument, read, robot_path};
use super::record::RecordArguments;
use crate::render::json;
use crate::report::document::Source;
use crate::report::validation::{self, html, table};
use crate::validation::{Request, Verdict, check_independent, validate};
use crate::{
    CalibrateError, InputError, InputText, Measurements, Options, RobotFile, SamplesFile,
    read_samples,
};
use clap::Args;
use std::path::PathBuf;

pub(crate) const HELP: &str = "\
The program compares where the robot of ROBOT.toml is said to be with where it was measured, and \
removes the [noise] that the file states. CHECK.csv holds joint angles and x, y, z as for delta-cal \
calibrate. The measurements must not be those of the calibration: measure some 20 other poses, spread at random \
over the region in which the robot works.

Pass: the upper limit of the 95 % confidence interval of the rms position error is at most the limit. \
Fail: the lower limit is above it. In between the measurements cannot decide, and the program says \
how many poses would. docs/validate.md says how, and how often such statements are right.

Examples:
  delta-cal validate calibrated.toml check.csv --limit 0.1mm
  delta-cal validate calibrated.toml check.csv --limit 50um \\
      --report certificate.html --operator \"A. Meier\" --measured-on 2026-03-14
  delta-cal validate calibrated.toml tracker.csv --limit 0.1mm --frame sensor
  delta-cal validate calibrated.toml check.csv --limit 0.1mm \\
      --limit-largest 0.3mm
  delta-cal validate calibrated.toml check.csv --limit 0.1mm --json - | jq .verdict

Exit codes:
  0  passed
  1  the measurements cannot validate this robot: too few poses, or wrong as
     a whole (refused)
  2  the command line is wrong
  3  an input file is wrong
  4  a file could not be written
  6  not passed: failed, or the measurements cannot decide; the output files
     are written

With exit codes 1, 2 and 3 no output file is written or changed.";

#[derive(Debug, Args)]
pub(crate) struct ValidateArguments {
    /// The robot as calibrated, or any robot file
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    robot: PathBuf,
    /// Joint angles and measured positions; - reads standard input
    #[arg(value_name = "CHECK.csv")]
    samples: PathBuf,
    /// The largest rms position error that passes, as 0.1mm or 50um
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    limit: Length,
    /// The largest position error of any measured pose that passes as well
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    limit_largest: Option<Length>,
    #[command(flatten)]
    columns: ColumnsArgument,
    /// The frame of the measured positions
    #[arg(long, value_enum, default_value_t = FrameArgument::Base)]
    frame: FrameArgument,
    #[command(flatten)]
    record: RecordArguments,
    /// Write the report as JSON to this file, or with - to standard output in place of the table
    #[arg(long, value_name = "REPORT.json")]
    json: Option<PathBuf>,
    /// Write a certificate to this HTML file, which prints on one page, or with - to standard output
    #[arg(long, value_name = "CERTIFICATE.html")]
    report: Option<PathBuf>,
}

pub(crate) fn run(arguments: &ValidateArguments) -> Result<(), Failure> {
    let robot = ("the robot file", Some(arguments.robot.as_path()));
    let samples = ("the samples file", Some(arguments.samples.as_path()));
    let (json_file, report_file) = (arguments.json.as_deref(), arguments.report.as_deref());
    outputs::check(
        &[robot, samples],
        &[("--json", json_file), ("--report", report_file)],
    )?;
    let robot_text = InputText::from_file(&arguments.robot)?;
    let robot = RobotFile::read(&robot_text)?;
    let samples_text = read(&arguments.samples, &arguments.columns)?;
    let sources = (Source::from(&robot_text), Source::from(&samples_text));
    let document = arguments.record.document(&robot, sources.0, sources.1)?;
    check_independent(&robot_text, &samples_text)?;
    let samples = positions(arguments, &robot, &samples_text)?;
    let request = Request {
        limit: arguments.limit.0,
        largest_limit: arguments.limit_largest.map(|Length(limit)| limit),
        frame: arguments.frame.frame(),
    };
    let found = validate(&robot, &samples, request)?;
    let json = json::text(&validation::json::report(&found, &document));
    let page = match arguments.report {
        Some(_) => html::render(&found, &document)?,
        None => String::new(),
    };
    deliver(
        &[(json_file, &json), (report_file, &page)],
        table::render(&found),
    )?;
    match found.verdict {
        Verdict::Pass => Ok(()),
        Verdict::Fail => Err(Failure::NotPassed("the robot fails its limit".to_owned())),
        Verdict::Undecided => Err(Failure::NotPassed(
            "the measurements cannot decide whether the robot meets its limit".to_owned(),
        )),
    }
}

/// x, y and z in every row.
fn positions(
    arguments: &ValidateArguments,
    robot: &RobotFile,
    text: &InputText,
) -> Result<SamplesFile, CalibrateError> {
    let options = Options {
        frame: arguments.frame.frame(),
        ..Options::default()
    };
    match read_samples(text, robot, options)? {
        Measurements::Positions(samples) => Ok(samples),
        Measurements::Observations(file) => {
            let cause = "a validation needs x, y and z in every row and nothing else, because heights, distances \
                         and single coordinates do not say where the robot is";
            let gap = file.rows.iter().find(|row| {
                let own = &row.value;
                own.position.iter().any(Option::is_none)
                    || own.height.is_some()
                    || own.distance.is_some()
            });
            let error = InputError::new(&file.name, cause).with_remedy(
                "measure x, y and z of every pose, or delete the other rows and columns; delta-cal plan --samples says what \
                 heights and distances are worth",
            );
            Err(match gap {
                Some(row) => error.at_line(row.line),
                None => error,
            }
            .into())
        }
    }
}
