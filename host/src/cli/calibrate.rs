//! `delta-cal calibrate`.

mod arguments;

pub(crate) use arguments::{CalibrateArguments, HELP};

use super::failure::Failure;
use super::paths::{is_stream, read, refuse_same, report_path};
use super::print::print;
use delta_cal::calibration::Solver;
use delta_cal::robust::Loss;
use delta_cal_host::files::{example, output};
use delta_cal_host::render::json;
use delta_cal_host::report::calibration::{self, html, stream, table};
use delta_cal_host::{
    CalibrateError, CalibrationReport, Frame, InputText, RobotFile, SamplesFile, calibrate,
    read_samples,
};
use std::fmt::Write;
use std::path::Path;

const OTHER_NAME: &str = "give the output another name";

pub(crate) fn run(arguments: &CalibrateArguments) -> Result<(), Failure> {
    check_paths(arguments)?;
    arguments.options().check().map_err(CalibrateError::from)?;
    let simulated = arguments.robot.is_none();
    let (robot, samples) = inputs(arguments)?;
    let report = match calibrate(&robot, &samples, arguments.options()) {
        Err(error) if error.refused() => return Err(refusal(arguments, error)),
        result => result?,
    };

    let json = json::text(&calibration::json::report(&report));
    let page = if arguments.report.is_some() {
        let origin = "The built-in example: its measurements are simulated.";
        html::render(&report, simulated.then_some(origin))?
    } else {
        String::new()
    };
    let toml = report.after.to_toml(&comment(&report, simulated));
    let json_file = arguments.json.as_deref().filter(|path| !is_stream(path));
    let mut files: Vec<(&Path, &str)> = Vec::new();
    files.extend(
        arguments
            .output
            .as_deref()
            .map(|path| (path, toml.as_str())),
    );
    files.extend(json_file.map(|path| (path, json.as_str())));
    files.extend(
        arguments
            .report
            .as_deref()
            .map(|path| (path, page.as_str())),
    );
    output::write_all(&files)?;

    if arguments.json.is_some() && json_file.is_none() {
        return print(&json);
    }
    let mut text = String::new();
    if simulated {
        text.push_str(
            "The built-in example; its measurements are simulated. For your own robot:\n\
             delta-cal calibrate ROBOT.toml SAMPLES.csv (see delta-cal calibrate --help)\n\n",
        );
    }
    text.push_str(&table::render(&report));
    for (path, _) in &files {
        let _ = writeln!(text, "Written: {}", path.display());
    }
    print(&text)
}

/// A refusal writes no file; a program that reads standard output is told there as well.
fn refusal(arguments: &CalibrateArguments, refused: CalibrateError) -> Failure {
    if arguments.json.as_deref().is_some_and(is_stream)
        && let Err(failure) = print(&json::text(&calibration::json::refusal(&refused)))
    {
        return failure;
    }
    Failure::Calibrate(refused)
}

fn check_paths(arguments: &CalibrateArguments) -> Result<(), Failure> {
    let robot = ("the robot file", arguments.robot.as_deref());
    let samples = ("the samples file", arguments.samples.as_deref());
    let (output, json) = (arguments.output.as_deref(), arguments.json.as_deref());
    if output.is_some_and(is_stream) {
        return Err(Failure::Usage {
            cause: "--output needs the name of a file".to_owned(),
            remedy: "only --json can write to standard output, as --json -".to_owned(),
        });
    }
    if !arguments.force {
        let remedy = "give the output another name, or --force to replace the robot file";
        refuse_same("--output", output, robot, remedy)?;
    }
    refuse_same("--output", output, samples, OTHER_NAME)?;
    refuse_same("--json", json, robot, OTHER_NAME)?;
    refuse_same("--json", json, samples, OTHER_NAME)?;
    refuse_same("--json", json, ("--output", output), OTHER_NAME)?;
    report_path(
        arguments.report.as_deref(),
        &[robot, samples, ("--output", output), ("--json", json)],
    )
}

fn inputs(arguments: &CalibrateArguments) -> Result<(RobotFile, SamplesFile), CalibrateError> {
    let (Some(robot), Some(samples)) = (&arguments.robot, &arguments.samples) else {
        return Ok(example::load()?);
    };
    let robot = RobotFile::read(&InputText::from_file(robot)?)?;
    let samples = read_samples(&read(samples)?, &robot, arguments.options())?;
    Ok((robot, samples))
}

fn comment(report: &CalibrationReport, simulated: bool) -> String {
    let note = if simulated {
        "\nThe built-in example: simulated, not measured."
    } else {
        ""
    };
    format!(
        "Calibrated by delta-cal {} from {} and {}:\n{} sample{}, position error {:.4} mm rms before and \
         {:.4} mm after.\nOptions: {}{note}",
        env!("CARGO_PKG_VERSION"),
        report.before.name,
        report.samples_file,
        report.samples,
        if report.samples == 1 { "" } else { "s" },
        report.error_before.rms,
        report.error_after.rms,
        options(report),
    )
}

/// The options as they would be typed, and what the robot file states.
fn options(report: &CalibrationReport) -> String {
    let options = &report.options;
    let method = options.method.name();
    let solver = match options.solver {
        Solver::LevenbergMarquardt => "lm",
        Solver::GaussNewton => "gn",
    };
    let frame = match options.frame {
        Frame::Base => "base",
        Frame::Sensor => "sensor",
    };
    let loss = match options.loss {
        None => "",
        Some(Loss::Huber) => " --loss huber",
        Some(Loss::Tukey) => " --loss tukey",
    };
    let streaming = stream::options(options.streaming);
    let no_guess = if options.no_guess { " --no-guess" } else { "" };
    let stated = |known: bool| if known { "stated" } else { "not stated" };
    format!(
        "--method {method} --solver {solver} --frame {frame}{loss}{streaming}{no_guess}; tolerance {}, noise {}.",
        stated(report.before.tolerance.is_some()),
        stated(report.before.noise.is_some()),
    )
}
