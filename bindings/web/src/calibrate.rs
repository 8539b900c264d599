//! `delta-cal calibrate`.

use crate::fault::Fault;
use crate::folder::Folder;
use crate::inputs::{Inputs, Request};
use crate::picture::Pictured;
use delta_cal::robot::Drive;
use delta_cal_host::printer::explained;
use delta_cal_host::report::calibration::comment;
use delta_cal_host::report::printer::PrinterReport;
use delta_cal_host::{CalibrateError, Options, calibrate};
use serde::Serialize;

/// What the command writes.
#[derive(Debug, Serialize)]
pub(crate) struct Calibrated {
    text: String,
    /// The page of `--report`.
    html: String,
    json: String,
    /// The calibrated robot.
    toml: String,
    /// The lines of `--paste`.
    paste: Option<String>,
    /// The joints at a printer's end stops, in the file's unit, for an export.
    home: Option<[f64; 3]>,
    /// The range of the joints, degrees or mm of travel.
    joints: [f64; 2],
}

pub(crate) fn run(files: &Folder, request: &Request) -> Result<(Calibrated, Pictured), Fault> {
    let refused = |error: CalibrateError| {
        let json = error.to_json();
        let fault = Fault::from(error.clone());
        if error.refused() {
            fault.with_json(json)
        } else {
            fault
        }
    };
    let Inputs {
        robot,
        readings,
        document,
        printer,
    } = request.inputs(files)?;
    let options = Options {
        of_printer: printer.is_some(),
        ..request.options()
    };
    let calibrated = calibrate(&robot, &readings, &options);
    let mut report = calibrated.map_err(|error| refused(explained(error, printer.as_ref())))?;
    report.document = Some(document);
    if let Some(limit) = request.limit {
        report = report.with_limit(limit);
    }
    let toml = report.after.to_toml(&comment(&report, &readings));
    let after = report.after.clone();
    let in_file = |joint: f64| match robot.robot.drive() {
        Drive::Rotary => joint.to_degrees(),
        Drive::Linear => joint,
    };
    let home = printer.as_ref().map(|own| own.home.map(in_file));
    let joints = [robot.limits.minimum(), robot.limits.maximum()].map(in_file);
    let mut printed = None;
    let (text, html, json) = match &printer {
        None => (report.to_text(), report.to_html(), report.to_json()),
        Some(printer) => {
            let report = PrinterReport::of(printer, report).map_err(refused)?;
            let texts = (report.to_text(), report.to_html(), report.to_json());
            printed = Some(report.printer);
            texts
        }
    };
    let pictured = Pictured::new(robot, after, printed.as_ref());
    let calibrated = Calibrated {
        text,
        html,
        json,
        toml,
        paste: printed.and_then(|own| own.lines),
        home,
        joints,
    };
    Ok((calibrated, pictured))
}
