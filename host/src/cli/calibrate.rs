use super::args::CalibrateArguments;
use super::failure::Failure;
use super::paths::{is_stream, read, refuse_same, report_path};
use super::print;
use delta_cal::{Loss, Method};
use delta_cal_host::report::json::{JsonRefusal, JsonReport};
use delta_cal_host::report::{html, stream, table};
use delta_cal_host::{
    CalibrateError, CalibrationMethod, CalibrationReport, Frame, InputError, InputText, Options,
    Refused, RobotFile, SamplesFile, calibrate, example, output,
};
use std::fmt::Write;
use std::path::Path;

const OTHER_NAME: &str = "give the output another name";

pub(crate) fn run(arguments: &CalibrateArguments) -> Result<(), Failure> {
    check_paths(arguments)?;
    check_streaming(arguments.options())?;
    let simulated = arguments.robot.is_none();
    let (robot, samples) = inputs(arguments)?;
    let report = match calibrate(&robot, &samples, arguments.options()) {
        Err(CalibrateError::Refused(refused)) => return Err(refusal(arguments, refused)),
        result => result?,
    };

    let json_wanted = arguments.json.is_some();
    let json = match json_wanted.then(|| JsonReport::new(&report).to_text()) {
        None => String::new(),
        Some(Ok(text)) => text,
        Some(Err(error)) => return Err(Failure::Output(format!("the JSON report: {error}"))),
    };
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

    if json_wanted && json_file.is_none() {
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
fn refusal(arguments: &CalibrateArguments, refused: Refused) -> Failure {
    if arguments.json.as_deref().is_some_and(is_stream)
        && let Ok(text) = JsonRefusal::new(&refused).to_text()
        && let Err(failure) = print(&text)
    {
        return failure;
    }
    Failure::Refused(refused)
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

fn check_streaming(options: Options) -> Result<(), Failure> {
    let plain = options.method == CalibrationMethod::Ikm && options.loss.is_none();
    if options.streaming.asked() && !plain {
        return Err(Failure::Usage {
            cause:
                "--gate, --held-out and --forget process the samples one after the other, which \
                 only --method ikm with --loss squared can do"
                    .to_owned(),
            remedy: "leave out --method and --loss, or leave out --gate, --held-out and --forget"
                .to_owned(),
        });
    }
    Ok(())
}

fn inputs(arguments: &CalibrateArguments) -> Result<(RobotFile, SamplesFile), InputError> {
    let (Some(robot), Some(samples)) = (&arguments.robot, &arguments.samples) else {
        return example::load();
    };
    let robot = RobotFile::read(&InputText::from_file(robot)?)?;
    let samples = SamplesFile::read_for(&read(samples)?, &robot, arguments.options())?;
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
        Method::LevenbergMarquardt => "lm",
        Method::GaussNewton => "gn",
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
