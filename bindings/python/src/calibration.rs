//! A calibration and everything there is to know of it. The package wraps it in a dataclass.

use crate::arrays::{array, with_cores, with_cores_telling};
use crate::errors::{FRAMES, METHODS, calibrate_error, in_python, input_error, word, words};
use crate::files::{dict, loads};
use crate::printer::{Part, configuration, included};
use crate::robot::Robot;
use crate::samples::Samples;
use delta_cal_host::files::document::Document;
use delta_cal_host::import::Imported;
use delta_cal_host::printer;
use delta_cal_host::report::calibration::comment;
use delta_cal_host::report::printer::PrinterReport;
use delta_cal_host::{InputText, Options, Readings, Report as Calibrated};
use nalgebra::Vector3;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde_json::json;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// A report in three forms, made when it is asked for.
#[pyclass(frozen, module = "delta_cal._native")]
pub(crate) struct Report(Form);

enum Form {
    /// And whether it is of arrays.
    OfRobot(Box<(Calibrated, bool)>),
    OfPrinter(Box<PrinterReport>),
}

#[pymethods]
impl Report {
    fn text(&self) -> String {
        match &self.0 {
            Form::OfRobot(own) => words(own.0.to_text(), own.1),
            Form::OfPrinter(own) => in_python(own.to_text()),
        }
    }

    fn in_arrays(&self) -> bool {
        matches!(&self.0, Form::OfRobot(own) if own.1)
    }

    fn json(&self) -> String {
        match &self.0 {
            Form::OfRobot(own) => own.0.to_json(),
            Form::OfPrinter(own) => own.to_json(),
        }
    }

    fn html(&self, py: Python<'_>) -> String {
        py.detach(|| match &self.0 {
            Form::OfRobot(own) => own.0.to_html(),
            Form::OfPrinter(own) => own.to_html(),
        })
    }
}

/// What identifies a report.
pub(crate) fn document(robot: &Robot, samples: &Samples) -> Document {
    Document::new(&robot.file, &robot.source, &samples.text, now())
}

/// Seconds since the beginning of 1970, or what the standard for reproducible builds states in their place.
fn now() -> u64 {
    let stated = std::env::var("SOURCE_DATE_EPOCH").ok();
    stated.and_then(|own| own.parse().ok()).unwrap_or_else(|| {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        since.map_or(0, |since| since.as_secs())
    })
}

/// The seconds that have passed since.
fn passed() -> impl Fn() -> [f64; 1] + Sync {
    let begin = Instant::now();
    move || [begin.elapsed().as_secs_f64()]
}

/// What is calibrated: a robot from samples, or a printer's configuration with files of readings and what is stated of it.
#[derive(FromPyObject)]
pub(crate) enum Begin {
    OfRobot(Py<Robot>, Py<Samples>),
    OfPrinter(Part, Vec<Part>, String),
}

/// What a calibration found.
#[pyfunction]
pub(crate) fn calibrate<'py>(
    py: Python<'py>,
    begin: Begin,
    frame: &str,
    method: Option<&str>,
    robust: bool,
    limit: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let options = Options {
        method: method.map(|own| word("method", own, METHODS)).transpose()?,
        robust,
        frame: word("frame", frame, FRAMES)?,
        of_printer: false,
    };
    let (file, samples, stated) = match begin {
        Begin::OfPrinter(file, samples, stated) => (file, samples, stated),
        Begin::OfRobot(robot, samples) => {
            let (robot, samples) = (robot.get(), samples.get());
            let work = || {
                let readings = samples.readings(robot, options)?;
                let report = delta_cal_host::calibrate(&robot.file, &readings, &options)?;
                Ok((readings, report))
            };
            let found = with_cores_telling(py, progress.as_ref(), work, passed())?;
            let (readings, report) =
                found.map_err(|error| calibrate_error(&error, samples.arrays_name()))?;
            return result(py, (robot, samples, &readings), limit, report, None);
        }
    };
    let (text, firmware, stated) = configuration(file, None, &stated)?;
    let samples = samples.into_iter().map(|(name, bytes)| {
        InputText::from_bytes(name, &bytes).map_err(|error| input_error(&error, None))
    });
    let samples = samples.collect::<PyResult<Vec<_>>>()?;
    let work = || {
        let imported = printer::read(firmware, &text, &samples, &stated, &included, &options)?;
        let options = Options {
            of_printer: true,
            ..options
        };
        let (robot, readings) = (imported.robot.clone(), imported.readings.clone());
        let report = delta_cal_host::calibrate(&robot, &readings, &options);
        let report = report.map_err(|error| printer::explained(error, Some(&imported)))?;
        Ok((imported, report))
    };
    let found = with_cores_telling(py, progress.as_ref(), work, passed())?;
    let (imported, report) = found.map_err(|error| calibrate_error(&error, None))?;
    let robot = Robot {
        file: imported.robot.clone(),
        source: text.clone(),
    };
    let samples = Samples::of_input(samples.into_iter().next().unwrap_or(text));
    let begin = (&robot, &samples, &imported.readings);
    result(py, begin, limit, report, Some(&imported))
}

/// What a calibration found that began with these.
fn result<'py>(
    py: Python<'py>,
    (robot, samples, readings): (&Robot, &Samples, &Readings),
    limit: Option<f64>,
    mut report: Calibrated,
    printer: Option<&Imported>,
) -> PyResult<Bound<'py, PyDict>> {
    report.document = Some(document(robot, samples));
    if let Some(limit) = limit {
        report = report.with_limit(limit);
    }
    let dict = figures(py, &report)?;
    let fingerprint = robot.fingerprint() + &samples.fingerprint();
    dict.set_item("fingerprint", fingerprint)?;
    let after = Robot::of_file(&report.after, &comment(&report, readings), "robot")?;
    dict.set_item("robot", Py::new(py, after)?)?;
    let report = match printer {
        None => Form::OfRobot(Box::new((report, samples.in_arrays))),
        Some(printer) => {
            let report = with_cores(py, || PrinterReport::of(printer, report.clone()))?;
            let report = report.map_err(|error| calibrate_error(&error, None))?;
            let before = Robot::of_file(&robot.file, "", "robot")?;
            dict.set_item("before", Py::new(py, before)?)?;
            let printer = json!(report.printer).to_string();
            dict.set_item("printer", loads(py, &printer)?)?;
            Form::OfPrinter(Box::new(report))
        }
    };
    dict.set_item("report", Py::new(py, Report(report))?)?;
    Ok(dict)
}

/// The figures of a report.
fn figures<'py>(py: Python<'py>, report: &Calibrated) -> PyResult<Bound<'py, PyDict>> {
    let (solution, before) = (&report.solution, &report.before);
    let unknowns = solution.unknowns(before);
    let covariance = &solution.covariance;
    let size = unknowns.len();
    let stated = |place: usize| {
        let (row, column) = (place / size, place % size);
        // Of one triangle: symmetric to the last bit.
        let own = covariance[(row.max(column), row.min(column))];
        unknowns[row].sign * unknowns[column].sign * own
    };
    let all = (0..size * size).map(stated).collect();
    let named = unknowns.iter().map(|own| (&own.name, own.unit, own.value));
    let rows = &solution.readings.rows;
    let lines = rows.iter().map(|row| row.line).collect();
    let texts = json!({
        "expected_error": report.expected_error,
        "findings": report.findings,
        "frame": report.sensor_frame,
        "method": report.method,
    });
    Ok(dict!(py,
        "covariance": array(py, all, &[size, size])?,
        "unknowns": PyList::new(py, named)?,
        "residuals": residuals(py, report)?,
        "lines": array(py, lines, &[rows.len()])?,
        "json": texts.to_string(),
    ))
}

fn residuals<'py>(py: Python<'py>, report: &Calibrated) -> PyResult<Bound<'py, PyAny>> {
    let solution = &report.solution;
    let rows = &solution.readings.rows;
    let coordinates = rows.iter().all(|row| {
        let [.., height, distance] = row.value.read();
        height.is_none() && distance.is_none()
    });
    let width = if coordinates { 3 } else { 5 };
    let axes = report.before.convention;
    let mut found: Vec<f64> = Vec::with_capacity(width * rows.len());
    for row in rows {
        let expected = solution.places.expected(&solution.robot, &row.value);
        let mut own = [f64::NAN; 5];
        for (place, read) in row.value.read().into_iter().enumerate() {
            if let (Some(read), Some(expected)) = (read, expected[place]) {
                own[place] = read - expected;
            }
        }
        let turned = axes.vector(&Vector3::new(own[0], own[1], own[2]));
        own[..3].copy_from_slice(turned.as_slice());
        found.extend(&own[..width]);
    }
    array(py, found, &[rows.len(), width])
}
