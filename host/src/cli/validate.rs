//! `delta-cal validate`.

use super::failure::Failure;
use super::output::{command, deliver, now, refused};
use super::paths::{ColumnsArgument, is_toml, read_samples_texts, robot_path};
use crate::files::{Document, length::length};
use crate::report::validation as report;
use crate::validation::{Comparison, Request, Verdict, check_independent, validate};
use crate::{Frame, InputText, Options, RobotFile, read_samples};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(
    override_usage = "delta-cal validate [OPTIONS] --limit <LENGTH> <ROBOT.toml> <CHECK.csv>\n       delta-cal validate [OPTIONS] --limit <LENGTH> <ROBOT.toml> <JOINTS.csv>\n           <POSITIONS.csv>\n       delta-cal validate <OLD.toml> <NEW.toml>"
)]
pub(crate) struct ValidateArguments {
    /// The robot as calibrated, or any robot file
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    robot: PathBuf,
    /// Joint angles and measured positions; - reads standard input
    #[arg(value_name = "CHECK.csv")]
    samples: PathBuf,
    /// The positions, if CHECK.csv holds the joints alone
    #[arg(value_name = "POSITIONS.csv")]
    second: Option<PathBuf>,
    /// Largest rms position error that passes, such as 0.1mm or 50um
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    limit: Option<f64>,
    #[command(flatten)]
    columns: ColumnsArgument,
    /// The frame of the positions: base; sensor, which is fitted; stored, [sensor_frame] of the robot file
    #[arg(long, value_enum, hide_possible_values = true, default_value_t = ValidatedFrame::Base)]
    frame: ValidatedFrame,
    /// Narrow the limit by the uncertainty of the instrument (ISO 14253-1)
    #[arg(long)]
    guard: bool,
    /// Write the report, or the refusal in its place, as JSON to this file, or with - to standard output
    #[arg(long, value_name = "REPORT.json")]
    json: Option<PathBuf>,
    /// Write a certificate, one HTML page to print, to this file, or with - to standard output
    #[arg(long, value_name = "CERTIFICATE.html")]
    report: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ValidatedFrame {
    Base,
    Sensor,
    Stored,
}

impl ValidatedFrame {
    const fn frame(self) -> Frame {
        match self {
            Self::Base => Frame::Base,
            Self::Sensor | Self::Stored => Frame::Sensor,
        }
    }
}

pub(crate) fn run(arguments: &ValidateArguments) -> Result<(), Failure> {
    let (json_file, report_file) = (arguments.json.as_deref(), arguments.report.as_deref());
    let robot_text = InputText::from_file(&arguments.robot)?;
    let robot = RobotFile::read(&robot_text)?;
    if is_toml(&arguments.samples) {
        let newer = RobotFile::read(&InputText::from_file(&arguments.samples)?)?;
        let found = Comparison::of(&robot, &newer)?;
        let json = report::changes_json(&found);
        return deliver(&[(json_file, &json)], report::changes(&found));
    }
    let Some(limit) = arguments.limit else {
        return Err(Failure::usage(
            "--limit is missing: the largest rms position error that passes",
            "write for example delta-cal validate calibrated.toml check.csv --limit 0.1mm",
        ));
    };
    let samples_text = read_samples_texts(
        &arguments.samples,
        arguments.second.as_deref(),
        &arguments.columns,
    )?;
    let document = Document::new(&robot, &robot_text, &samples_text, now()?);
    let document = document.with_options(command());
    check_independent(&robot_text, &samples_text)?;
    let options = Options::in_frame(arguments.frame.frame());
    let samples = read_samples(&samples_text, &robot, &options)?;
    let request = Request {
        limit,
        frame: options.frame,
        stored: matches!(arguments.frame, ValidatedFrame::Stored),
    };
    let found = validate(&robot, &samples, request);
    let mut found = found.map_err(|error| refused(json_file, error))?;
    if arguments.guard {
        found = found.guarded(&robot);
    }
    let json = report::json(&found, &document);
    let page = match arguments.report {
        Some(_) => report::certificate(&found, &document),
        None => String::new(),
    };
    deliver(
        &[(json_file, &json), (report_file, &page)],
        report::text(&found),
    )?;
    Err(Failure::not_passed(match found.verdict {
        Verdict::Pass => return Ok(()),
        Verdict::Fail => "the robot fails its limit",
        Verdict::NotJudged => "something moved during the measurement, so the robot is not judged",
        Verdict::Undecided => "the measurements do not decide whether the robot meets its limit",
    }))
}
