//! `delta-cal calibrate`.

use crate::fault::Fault;
use crate::folder::Folder;
use crate::inputs::{Inputs, Request};
use crate::picture::Bed;
use delta_cal_host::printer::explained;
use delta_cal_host::report::calibration::comment;
use delta_cal_host::report::printer::PrinterReport;
use delta_cal_host::text::joint::in_file;
use delta_cal_host::{Options, Report, calibrate};
use serde::Serialize;
use tsify::Tsify;

/// What the command writes.
#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Calibrated {
    /// The page of `--report`.
    html: String,
    json: String,
    /// The calibrated robot.
    toml: String,
    /// The lines of `--paste`.
    paste: Option<String>,
    /// A printer's bed, before and after.
    bed: Option<Bed>,
    /// The joints at a printer's end stops, in the file's unit, for an export.
    home: Option<[f64; 3]>,
    /// The range of the joints, degrees or mm of travel.
    joints: [f64; 2],
}

/// A calibration, and what it is of.
pub(crate) fn calibrated(files: &Folder, request: &Request) -> Result<(Inputs, Report), Fault> {
    let inputs = request.inputs(files)?;
    let printer = inputs.printer.as_ref();
    let options = Options {
        of_printer: printer.is_some(),
        ..request.options()
    };
    let calibrated = calibrate(&inputs.robot, &inputs.readings, &options);
    let mut report = calibrated.map_err(|error| explained(error, printer))?;
    report.document = Some(inputs.document.clone());
    if let Some(limit) = request.limit {
        report = report.with_limit(limit);
    }
    Ok((inputs, report))
}

pub(crate) fn run(files: &Folder, request: &Request) -> Result<Calibrated, Fault> {
    let (inputs, report) = calibrated(files, request)?;
    let Inputs {
        robot,
        readings,
        printer,
        ..
    } = inputs;
    let toml = report.after.to_toml(&comment(&report, &readings));
    let in_file = |joint| in_file(robot.robot.drive(), joint);
    let home = printer.as_ref().map(|own| own.home.map(in_file));
    let joints = [robot.limits.minimum(), robot.limits.maximum()].map(in_file);
    let (html, json, printed) = match &printer {
        None => (report.to_html(), report.to_json(), None),
        Some(printer) => {
            let report = PrinterReport::of(printer, report)?;
            (report.to_html(), report.to_json(), Some(report.printer))
        }
    };
    Ok(Calibrated {
        html,
        json,
        toml,
        bed: printed.as_ref().and_then(Bed::of),
        paste: printed.and_then(|own| own.lines),
        home,
        joints,
    })
}
