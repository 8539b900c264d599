//! `delta-cal calibrate`.

mod arguments;

pub(crate) use arguments::{CalibrateArguments, HELP};

use super::failure::Failure;
use super::outputs::{self, deliver};
use super::paths::{read, refuse_same};
use super::progress::Waiting;
use super::record;
use crate::accuracy::coverage::Acceptance;
use crate::files::example;
use crate::render::json;
use crate::report::calibration::{self, html, observations, stream, table};
use crate::report::document::{About, Document, Source};
use crate::{
    CalibrateError, CalibrationReport, Frame, InputText, Measurements, ObservationsFile, RobotFile,
    calibrate, calibrate_observations, for_transmissions, read_samples,
};
use delta_cal::calibration::Solver;
use delta_cal::robust::Loss;

pub(crate) fn run(arguments: &CalibrateArguments) -> Result<(), Failure> {
    check_paths(arguments)?;
    arguments.options().check().map_err(CalibrateError::from)?;
    let simulated = arguments.robot.is_none();
    let Inputs {
        robot,
        measurements,
        sources: [robot_file, samples_file],
    } = match inputs(arguments) {
        Ok(inputs) => inputs,
        Err(error) if error.refused() => {
            return Err(refused(arguments, error));
        }
        Err(error) => return Err(error.into()),
    };
    let document = record::document(&robot, robot_file, samples_file)?;
    let samples = match measurements {
        Measurements::Positions(samples) => samples,
        Measurements::Observations(samples) => {
            return observed(arguments, &robot, &samples, &document);
        }
    };
    let waiting = Waiting::for_rows("calibrating from", samples.count());
    let report = match calibrate(&robot, &samples, arguments.options()) {
        Err(error) if error.refused() => {
            return Err(refused(arguments, error));
        }
        result => result?,
    };
    drop(waiting);

    let acceptance = arguments.limit().map(|limit| report.acceptance(limit));
    let origin = "The built-in example: its measurements are simulated.";
    let about = About {
        origin: simulated.then_some(origin),
        document: Some(&document),
        acceptance: acceptance.as_ref(),
    };
    let json = json::text(&calibration::json::report(&report, &about));
    let page = if arguments.report.is_some() {
        html::render(&report, &about)?
    } else {
        String::new()
    };
    let toml = report.after.to_toml(&format!(
        "{}\n{}",
        comment(&report, simulated),
        document.comment()
    ));
    let mut text = String::new();
    if simulated {
        text.push_str(
            "The built-in example; its measurements are simulated. For your own robot:\n\
             delta-cal calibrate ROBOT.toml SAMPLES.csv (see delta-cal calibrate --help)\n\n",
        );
    }
    text.push_str(&table::render(&report, &about));
    deliver(&arguments.outputs(&toml, &json, &page), text)?;
    accepted(acceptance.as_ref())
}

/// A limit that is not met has its exit code, after everything was written.
fn accepted(acceptance: Option<&Acceptance>) -> Result<(), Failure> {
    match acceptance {
        Some(acceptance) if !acceptance.passed() => Err(Failure::NotPassed(format!(
            "the expanded uncertainty is not within the limit of {} mm",
            acceptance.limit
        ))),
        _ => Ok(()),
    }
}

fn refused(arguments: &CalibrateArguments, error: CalibrateError) -> Failure {
    let refusal = calibration::json::refusal(&error);
    outputs::refused(arguments.json.as_deref(), &refusal, error.into())
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

/// What is calibrated, from what, and the files that say so.
struct Inputs {
    robot: RobotFile,
    measurements: Measurements,
    sources: [Source; 2],
}

fn inputs(arguments: &CalibrateArguments) -> Result<Inputs, CalibrateError> {
    let (Some(robot), Some(samples)) = (&arguments.robot, &arguments.samples) else {
        let (robot, samples) = example::load()?;
        let sources = [
            InputText::new(&robot.name, example::ROBOT_TOML),
            InputText::new(&samples.name, example::SAMPLES_CSV),
        ];
        return Ok(Inputs {
            robot,
            measurements: Measurements::Positions(samples),
            sources: sources.each_ref().map(Source::from),
        });
    };
    let robot_text = InputText::from_file(robot)?;
    let robot = RobotFile::read(&robot_text)?;
    let waiting = Waiting::for_file(samples);
    let samples = read(samples, &arguments.columns)?;
    let measurements = read_samples(&samples, &robot, arguments.options())?;
    let measurements = for_transmissions(&robot, measurements)?;
    drop(waiting);
    Ok(Inputs {
        robot,
        measurements,
        sources: [Source::from(&robot_text), Source::from(&samples)],
    })
}

/// From heights, distances and single coordinates.
fn observed(
    arguments: &CalibrateArguments,
    robot: &RobotFile,
    samples: &ObservationsFile,
    document: &Document,
) -> Result<(), Failure> {
    let waiting = Waiting::for_rows("calibrating from", samples.rows.len());
    let report = match calibrate_observations(robot, samples, arguments.options()) {
        Err(error) if error.refused() => {
            return Err(refused(arguments, error));
        }
        result => result?,
    };
    drop(waiting);
    let acceptance = arguments.limit().map(|limit| report.acceptance(limit));
    let about = About {
        origin: None,
        document: Some(document),
        acceptance: acceptance.as_ref(),
    };
    let json = json::text(&observations::json(&report, &about));
    let page = match arguments.report {
        Some(_) => observations::html(&report, &about),
        None => String::new(),
    };
    let comment = format!(
        "Calibrated by delta-cal {} from {} and {}:\n{} rows of heights, distances or coordinates.\n{}",
        env!("CARGO_PKG_VERSION"),
        robot.name,
        samples.name,
        samples.rows.len(),
        document.comment(),
    );
    let toml = report.after.to_toml(&comment);
    let text = observations::text(&report, &about);
    deliver(&arguments.outputs(&toml, &json, &page), text)?;
    accepted(acceptance.as_ref())
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
