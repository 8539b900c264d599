use super::args::{CalibrateArguments, LinkArguments};
use super::connect::{Device, Task, with_device};
use super::files::{inputs, publish, rows};
use super::progress::Bar;
use crate::cli::failure::Failure;
use crate::cli::outputs;
use crate::cli::paths::is_stream;
use crate::device::report::{json, text};
use crate::device::{
    Finished, Number, Sending, apply, calibrate_robot, calibrate_robot_from_observations,
};
use crate::files::output;
use crate::report::calibration::{self, html, observations, table};
use crate::report::document::About;
use crate::{CalibrationReport, Measurements, ObservationsReport, RobotFile};
use serde_json::Value;
use std::fmt::Write;

pub(super) fn run(link: &LinkArguments, arguments: &CalibrateArguments) -> Result<(), Failure> {
    check_paths(arguments)?;
    let (robot, measurements) = inputs(&arguments.files)?;
    // Before anything is applied.
    let files = [&arguments.output, &arguments.json, &arguments.report];
    for path in files.into_iter().flatten() {
        if !is_stream(path) {
            output::check(path)?;
        }
    }
    with_device(
        link,
        Calibrate {
            arguments,
            robot,
            measurements,
            kept: link.flash.is_some(),
        },
    )
}

fn check_paths(arguments: &CalibrateArguments) -> Result<(), Failure> {
    let robot = ("the robot file", arguments.files.robot.as_deref());
    let samples = ("the samples file", arguments.files.samples.as_deref());
    let (output, json) = (arguments.output.as_deref(), arguments.json.as_deref());
    // The nominal robot is needed for every further calibration.
    outputs::check(
        &[robot, samples],
        &[
            ("--output", output),
            ("--json", json),
            ("--report", arguments.report.as_deref()),
        ],
    )
}

/// As `delta-cal calibrate` reports it.
enum Report {
    Positions(Box<CalibrationReport>),
    Observations(Box<ObservationsReport>),
}

impl Report {
    const fn after(&self) -> &RobotFile {
        match self {
            Self::Positions(report) => &report.after,
            Self::Observations(report) => &report.after,
        }
    }

    fn text(&self) -> String {
        match self {
            Self::Positions(report) => table::render(report, &About::default()),
            Self::Observations(report) => observations::text(report, &About::default()),
        }
    }

    fn json(&self) -> Value {
        match self {
            Self::Positions(report) => calibration::json::report(report, &About::default()),
            Self::Observations(report) => observations::json(report, &About::default()),
        }
    }

    fn html(&self, origin: &str) -> Result<String, Failure> {
        let about = About {
            origin: Some(origin),
            ..About::default()
        };
        Ok(match self {
            Self::Positions(report) => html::render(report, &about)?,
            Self::Observations(report) => observations::html(report, &about),
        })
    }
}

struct Calibrate<'a> {
    arguments: &'a CalibrateArguments,
    robot: RobotFile,
    measurements: Measurements,
    /// Whether an emulated controller's flash is kept.
    kept: bool,
}

impl Task for Calibrate<'_> {
    fn run<T: Number>(self, device: &mut Device) -> Result<(), Failure> {
        let Self {
            arguments,
            robot,
            measurements,
            kept,
        } = self;
        let options = arguments.files.options();
        let port = device.port.to_string();
        let bar = Bar::new(rows(&measurements));
        let client = &mut device.client;
        let mut progress = |step| bar.show(step);
        let result = match &measurements {
            Measurements::Positions(samples) => {
                calibrate_robot::<T, _>(client, &port, &robot, samples, options, &mut progress)
                    .map(|(finished, report)| (finished, Report::Positions(Box::new(report))))
            }
            Measurements::Observations(samples) => {
                calibrate_robot_from_observations(client, &robot, samples, options, &mut progress)
                    .map(|(finished, report)| (finished, Report::Observations(Box::new(report))))
            }
        };
        bar.finish();
        let (finished, report) = result?;
        let page = if arguments.report.is_some() {
            report.html(&origin(&port, arguments))?
        } else {
            String::new()
        };
        if arguments.apply {
            let sending = match &measurements {
                Measurements::Positions(samples) => Sending::samples(&robot, samples, options),
                Measurements::Observations(samples) => Sending::observations(&robot, samples)?,
            };
            apply(client, &sending, &finished)?;
        }

        let (before, after) = (
            &finished.status_before.control,
            &finished.status_after.control,
        );
        let json = json::calibration(&json::Calibration {
            report: report.json(),
            fingerprint: result_fingerprint(&finished),
            applied: arguments.apply,
            control: [before, after],
            pace: device.pace,
            repeated_requests: client.repetitions(),
        });
        let mut shown = String::new();
        if arguments.files.robot.is_none() {
            shown.push_str("The built-in example; its measurements are simulated.\n\n");
        }
        shown.push_str(&text::identity(&port, &device.identity));
        let _ = writeln!(shown, "\n{}", report.text());
        shown.push_str(&text::while_calibrating(before, after, device.pace));
        match client.repetitions() {
            0 => {}
            repeated => {
                let _ = writeln!(
                    shown,
                    "  {repeated} requests were sent again: something was lost on the link"
                );
            }
        }
        shown.push_str(&text::applied(
            arguments.apply,
            result_fingerprint(&finished),
            kept || device.pace.is_none(),
        ));
        let toml = report.after().to_toml(&comment(&report, &port, arguments));
        let files = [
            (arguments.output.as_deref(), toml.as_str()),
            (arguments.report.as_deref(), page.as_str()),
        ];
        let json = json::of_device(&port, &device.identity, json);
        publish(&files, arguments.json.as_deref(), &json, shown).map_err(|failure| match failure {
            Failure::Output(cause) if arguments.apply => {
                Failure::Output(format!("{cause} (the new parameters were applied)"))
            }
            other => other,
        })
    }
}

fn result_fingerprint<T: Number>(finished: &Finished<T>) -> u32 {
    finished
        .result
        .as_ref()
        .map_or(0, crate::device::Solution::fingerprint)
}

fn comment(report: &Report, port: &str, arguments: &CalibrateArguments) -> String {
    let note = if arguments.files.robot.is_none() {
        "\nThe built-in example: simulated, not measured."
    } else {
        ""
    };
    let from = match report {
        Report::Positions(report) => format!(
            "from {} (delta-cal {}):\n{} samples, position error {:.4} mm rms before and {:.4} mm after.",
            report.samples_file,
            env!("CARGO_PKG_VERSION"),
            report.samples,
            report.error_before.rms,
            report.error_after.rms,
        ),
        Report::Observations(report) => format!(
            "from {} (delta-cal {}):\n{} rows of heights, distances or coordinates.",
            report.samples.name,
            env!("CARGO_PKG_VERSION"),
            report.samples.rows.len(),
        ),
    };
    format!(
        "Calibrated by the controller on {port} {from} {}{note}",
        if arguments.apply {
            "In use by the controller."
        } else {
            "Not applied."
        },
    )
}

fn origin(port: &str, arguments: &CalibrateArguments) -> String {
    let simulated = if arguments.files.robot.is_none() {
        " The built-in example: its measurements are simulated."
    } else {
        ""
    };
    format!(
        "Calibrated by the controller on {port}, {}.{simulated}",
        if arguments.apply {
            "which now uses it"
        } else {
            "not applied"
        }
    )
}
