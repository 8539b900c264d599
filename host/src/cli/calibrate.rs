//! `delta-cal calibrate`.

use super::failure::Failure;
use super::import::{StatedArguments, configuration, includes};
use super::output::{self, Progress, command, deliver, now};
use super::paths::{
    ColumnsArgument, given, is_toml, read_samples_texts, robot_path, without_table,
};
use crate::files::{Document, example, length::length};
use crate::import::{Firmware, Imported};
use crate::printer;
use crate::report::calibration::comment;
use crate::report::printer::PrinterReport;
use crate::{Frame, InputText, Method, Options, Readings, RobotFile, calibrate, read_samples};
use clap::{ArgMatches, Args};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct CalibrateArguments {
    /// The robot before calibration, or a printer's configuration
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    robot: Option<PathBuf>,
    /// Joint angles and what was measured there; - reads standard input
    #[arg(value_name = "SAMPLES.csv")]
    samples: Option<PathBuf>,
    /// The measurements, if SAMPLES.csv holds only joint angles; for printers more readings
    #[arg(value_name = "POSITIONS.csv")]
    second: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnsArgument,
    /// joint or ikm (each arm by itself) for positions in the robot's frame, fkm for any readings
    #[arg(long, value_enum, hide_possible_values = true)]
    method: Option<Method>,
    /// Leave out and name samples that disagree (Tukey's loss)
    #[arg(long)]
    robust: bool,
    /// The frame of x, y and z: base, or sensor, which is estimated too
    #[arg(long, value_enum, hide_possible_values = true, default_value_t = Frame::Base)]
    frame: Frame,
    /// Largest expanded uncertainty (95 % of positions)
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    limit: Option<f64>,
    #[command(flatten)]
    stated: StatedArguments,
    /// Write the calibrated robot; - is standard output
    #[arg(long, value_name = "CALIBRATED.toml")]
    output: Option<PathBuf>,
    /// Write the lines for a printer's configuration
    #[arg(long, value_name = "FILE")]
    paste: Option<PathBuf>,
    /// Write the report, or the refusal in its place, as JSON
    #[arg(long, value_name = "REPORT.json")]
    json: Option<PathBuf>,
    /// Write the report as one HTML file
    #[arg(long, value_name = "REPORT.html")]
    report: Option<PathBuf>,
    /// Let --output replace ROBOT.toml itself
    #[arg(long = "force")]
    replace_robot: bool,
}

/// The inputs of a calibration, the files they come from, and the imported configuration if the robot is a printer.
type Inputs = (RobotFile, Readings, [InputText; 2], Option<Imported>);

pub(crate) fn run(arguments: &CalibrateArguments, matches: &ArgMatches) -> Result<(), Failure> {
    if let (Some(path), None) = (&arguments.robot, &arguments.samples)
        && is_toml(path)
    {
        return Err(without_samples(path));
    }
    let refused = |error| output::refused(arguments.json.as_deref(), error);
    let mut options = Options {
        method: arguments.method,
        robust: arguments.robust,
        frame: arguments.frame,
        of_printer: false,
    };
    let (robot, readings, [file, samples], printer) = inputs(arguments, matches, &options)?;
    options.of_printer = printer.is_some();
    let waiting = Progress::spinner(format!("calibrating from {} rows", readings.rows.len()));
    let calibrated = calibrate(&robot, &readings, &options);
    let mut report =
        calibrated.map_err(|error| refused(printer::explained(error, printer.as_ref())))?;
    drop(waiting);
    report.document = Some(Document::new(&robot, &file, &samples, now()?).with_options(command()));
    if arguments.robot.is_none() {
        report.origin = Some("The built-in example: its measurements are simulated.");
    }
    if let Some(limit) = arguments.limit {
        report = report.with_limit(limit);
    }
    let toml = report.after.to_toml(&comment(&report, &readings));
    let acceptance = report.acceptance;
    let (text, json, page, lines) = match &printer {
        None => (report.to_text(), report.to_json(), report.to_html(), None),
        Some(printer) => {
            let report = PrinterReport::of(printer, report).map_err(refused)?;
            let (text, json, page) = (report.to_text(), report.to_json(), report.to_html());
            (text, json, page, report.printer.lines)
        }
    };
    let (paste, lines) = arguments.paste.as_deref().zip(lines.as_deref()).unzip();
    let outputs = [
        (arguments.output.as_deref(), toml.as_str()),
        (paste, lines.unwrap_or_default()),
        (arguments.json.as_deref(), json.as_str()),
        (arguments.report.as_deref(), page.as_str()),
    ];
    deliver(&outputs, text)?;
    match acceptance.filter(|own| !own.passed) {
        None => Ok(()),
        Some(own) => {
            let cause = format!("the expanded uncertainty exceeds {} mm", own.limit_mm);
            Err(Failure::not_passed(cause))
        }
    }
}

fn inputs(
    arguments: &CalibrateArguments,
    matches: &ArgMatches,
    options: &Options,
) -> Result<Inputs, Failure> {
    if arguments.samples.is_none() {
        without_table(matches, "delta-cal calibrate robot.toml samples.csv")?;
    }
    let Some(path) = &arguments.robot else {
        no_printer(matches)?;
        let (robot, readings) = example::load()?;
        let file = InputText::new(&robot.name, example::ROBOT_TOML);
        let samples = InputText::new(&readings.name, example::SAMPLES_CSV);
        return Ok((robot, readings, [file, samples], None));
    };
    let text = configuration(path)?;
    let read = |own: &PathBuf, second| read_samples_texts(own, second, &arguments.columns);
    if text.is_robot() {
        no_printer(matches)?;
        let robot = RobotFile::read(&text)?;
        let samples = arguments.samples.as_ref();
        let samples = samples.ok_or_else(|| without_samples(path))?;
        let samples = read(samples, arguments.second.as_deref())?;
        let readings = read_samples(&samples, &robot, options)?;
        return Ok((robot, readings, [text, samples], None));
    }
    let stated = arguments.stated.stated()?;
    let firmware = Firmware::of(&text)?;
    let files = arguments.samples.iter().chain(&arguments.second);
    let samples = files.map(|own| read(own, None));
    let samples = samples.collect::<Result<Vec<_>, _>>()?;
    let printer = printer::read(firmware, &text, &samples, &stated, &includes, options)?;
    let (robot, readings) = (printer.robot.clone(), printer.readings.clone());
    let samples = samples.into_iter().next().unwrap_or_else(|| text.clone());
    Ok((robot, readings, [text, samples], Some(printer)))
}

/// The error for a robot file without a samples file; only a printer's configuration can contain samples itself.
fn without_samples(path: &Path) -> Failure {
    Failure::usage(
        format!("{} is given without its samples", path.display()),
        "write for example delta-cal calibrate robot.toml samples.csv",
    )
}

/// Refuses options that apply only to printers.
fn no_printer(matches: &ArgMatches) -> Result<(), Failure> {
    let options = ["rods", "radius", "printed", "shrinkage", "paste"];
    match given(matches, &options) {
        None => Ok(()),
        Some(option) => Err(Failure::usage(
            format!("--{option} needs a printer's configuration"),
            format!(
                "write for example delta-cal calibrate printer.cfg --{option} …, or see delta-cal export"
            ),
        )),
    }
}
