//! `delta-cal calibrate`.

use super::choices::{FrameArgument, MethodArgument};
use super::failure::Failure;
use super::length::Length;
use super::outputs::{self, deliver};
use super::paths::{ColumnsArgument, read, refuse_same, robot_path};
use super::progress::Waiting;
use super::record::document;
use crate::files::example;
use crate::report;
use crate::report::calibration::{RefusalReport, comment};
use crate::report::document::Source;
use crate::{
    CalibrateError, InputText, Loss, Options, Readings, RobotFile, calibrate, read_samples,
};
use clap::Args;
use std::path::PathBuf;

pub(crate) const HELP: &str = "\
ROBOT.toml describes the robot; delta-cal init writes a commented one. SAMPLES.csv holds joint angles and what was \
measured there, in any mixture and in any order of columns:
  q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm         positions
  q1_deg,q2_deg,q3_deg,height_mm,plane        touches of a plate, gauge blocks
  q1_deg,q2_deg,q3_deg,distance_mm,point      a ball bar, a wire
  q1_deg,q2_deg,q3_deg,distance_mm,to_q1_deg,to_q2_deg,to_q3_deg
                                              a calliper, between two poses
With linear drives s1_mm,s2_mm,s3_mm. Units may be _rad, _m, _cm, _um, _in. Columns whose name begins with _ are ignored, \
# begins a comment, --columns q1_deg=A1,x_mm=X reads columns of other names.

A blank x, y or z is an error with its line unless at least 3 rows, and one row in 10, have the same cells blank. Rows that \
are equal to the last digit count once; repeats that differ show the repeatability.

Where [noise] states no σ of a kind of reading, it is estimated from the residuals. Without x, y and z a [tolerance] is \
needed. With --frame sensor the sensor's frame is found with the parameters, and every σ contains its uncertainty.

A result is refused, and nothing is written, if the samples do not determine the robot, contradict the [noise] or \
[tolerance], or would make the robot worse with a chance above 5 %.

Examples:
  delta-cal calibrate
      the built-in, simulated example
  delta-cal calibrate robot.toml samples.csv --output calibrated.toml
  delta-cal calibrate robot.toml tracker.csv --frame sensor --report report.html
  delta-cal calibrate robot.toml touches.csv --robust --json report.json
  delta-cal calibrate robot.toml samples.csv --limit 0.1mm";

#[derive(Debug, Args)]
pub(crate) struct CalibrateArguments {
    /// The robot before calibration. Without files the program calibrates its built-in example
    #[arg(value_name = "ROBOT.toml", requires = "samples", value_parser = robot_path())]
    robot: Option<PathBuf>,
    /// Joint angles and what was measured there; - reads standard input
    #[arg(value_name = "SAMPLES.csv")]
    samples: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnsArgument,
    /// The estimator [default: joint for complete positions in the robot's frame, otherwise fkm]
    #[arg(long, value_enum)]
    method: Option<MethodArgument>,
    /// Leave out samples that disagree with the others, and name them (Tukey's loss function)
    #[arg(long)]
    robust: bool,
    /// The frame of the coordinates
    #[arg(long, value_enum, default_value_t = FrameArgument::Base)]
    frame: FrameArgument,
    /// Largest expanded uncertainty (rms over the workspace), such as 0.1mm; above it the exit code is 6
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    limit: Option<Length>,
    /// Write the calibrated robot to this file; - is standard output
    #[arg(long, value_name = "CALIBRATED.toml")]
    output: Option<PathBuf>,
    /// Write the report, or the refusal, as JSON; - is standard output
    #[arg(long, value_name = "REPORT.json")]
    json: Option<PathBuf>,
    /// Write the report with figures as one HTML file; - is standard output
    #[arg(long, value_name = "REPORT.html")]
    report: Option<PathBuf>,
    /// Let --output replace ROBOT.toml itself
    #[arg(long, requires = "output")]
    force: bool,
}

/// What is calibrated, from what, and the files that say so.
struct Inputs {
    robot: RobotFile,
    readings: Readings,
    sources: [Source; 2],
}

pub(crate) fn run(arguments: &CalibrateArguments) -> Result<(), Failure> {
    check_paths(arguments)?;
    let refused = |error: CalibrateError| {
        let json = report::json(&RefusalReport::from(&error));
        if error.refused() {
            outputs::refused(arguments.json.as_deref(), &json, error.into())
        } else {
            error.into()
        }
    };
    let options = Options {
        method: arguments.method.map(MethodArgument::method),
        loss: arguments.robust.then_some(Loss::Tukey),
        frame: arguments.frame.frame(),
    };
    let Inputs {
        robot,
        readings,
        sources: [robot_file, samples_file],
    } = inputs(arguments, &options).map_err(refused)?;
    let waiting = Waiting::for_rows("calibrating from", readings.rows.len());
    let mut report = calibrate(&robot, &readings, &options).map_err(refused)?;
    drop(waiting);
    report.document = Some(document(&robot, robot_file, samples_file)?);
    if arguments.robot.is_none() {
        report.origin = Some("The built-in example: its measurements are simulated.");
    }
    if let Some(Length(limit)) = arguments.limit {
        report = report.with_limit(limit);
    }
    let toml = report.after.to_toml(&comment(&report, &readings));
    let json = report.to_json();
    let page = arguments
        .report
        .as_ref()
        .map_or_else(String::new, |_| report.to_html());
    let outputs = [
        (arguments.output.as_deref(), toml.as_str()),
        (arguments.json.as_deref(), json.as_str()),
        (arguments.report.as_deref(), page.as_str()),
    ];
    deliver(&outputs, report.to_text())?;
    match report.acceptance {
        Some(acceptance) if !acceptance.passed => Err(Failure::NotPassed(format!(
            "the expanded uncertainty exceeds {} mm",
            acceptance.limit_mm
        ))),
        _ => Ok(()),
    }
}

fn check_paths(arguments: &CalibrateArguments) -> Result<(), Failure> {
    let robot = ("the robot file", arguments.robot.as_deref());
    let samples = ("the samples file", arguments.samples.as_deref());
    let (output, json) = (arguments.output.as_deref(), arguments.json.as_deref());
    if !arguments.force {
        let remedy = "give the output another name, or --force to replace the robot file";
        refuse_same("--output", output, robot, remedy)?;
    }
    let (json, report) = (("--json", json), ("--report", arguments.report.as_deref()));
    outputs::check(&[robot], &[json, report])?;
    outputs::check(&[samples], &[("--output", output), json, report])
}

fn inputs(arguments: &CalibrateArguments, options: &Options) -> Result<Inputs, CalibrateError> {
    let (Some(robot), Some(samples)) = (&arguments.robot, &arguments.samples) else {
        let (robot, readings) = example::load()?;
        let sources = [
            InputText::new(&robot.name, example::ROBOT_TOML),
            InputText::new(&readings.name, example::SAMPLES_CSV),
        ];
        return Ok(Inputs {
            robot,
            readings,
            sources: sources.each_ref().map(Source::from),
        });
    };
    let robot_text = InputText::from_file(robot)?;
    let robot = RobotFile::read(&robot_text)?;
    let waiting = Waiting::for_file(samples);
    let samples = read(samples, &arguments.columns)?;
    let readings = read_samples(&samples, &robot, options)?;
    drop(waiting);
    Ok(Inputs {
        robot,
        readings,
        sources: [Source::from(&robot_text), Source::from(&samples)],
    })
}
