//! What is done with a robot beside its calibration. The package wraps each in a dataclass.

use crate::arrays::{array, with_cores, with_cores_telling};
use crate::calibration::document;
use crate::errors::{
    FRAMES, METHODS, calibrate_error, in_python, input_error, refusal, value_error, word, words,
};
use crate::files::{dict, loads};
use crate::printer::{Part, configuration, included};
use crate::robot::Robot;
use crate::samples::Samples;
use delta_cal_host::campaign::{self, OneCase};
use delta_cal_host::export::error::ExportError;
use delta_cal_host::export::positions::Wanted;
use delta_cal_host::export::{Case, Settings, target as target_of};
use delta_cal_host::halt::Steps;
use delta_cal_host::planning::{
    self, Determined, Kind, LEAST, MOST, PlanError, PlanRequest, Planned, Region, Wishes, labelled,
};
use delta_cal_host::report::{plan as plan_report, validation, workspace as workspace_report};
use delta_cal_host::validation::{Comparison, Request, check_independent};
use delta_cal_host::workspace::{Analysis, Options as Resolution, WorkspaceError};
use delta_cal_host::{InputText, Options, Planned as Rows, RobotFile};
use nalgebra::Vector3;
use numpy::PyReadonlyArrayDyn;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Joint angles, nominal positions, the samples file to fill in, the report for programs and for people. With `samples` what to
/// add to these, and what they determine.
#[pyfunction]
pub(crate) fn plan<'py>(
    py: Python<'py>,
    robot: &Robot,
    count: usize,
    samples: Option<&Samples>,
    measure: Option<&str>,
    frame: &str,
    within: Option<&str>,
    absolute: bool,
    order: &str,
    accuracy: Option<f64>,
    seed: u64,
    names: Option<&str>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let wishes = measure.map_or(Ok(Wishes::only(Kind::XYZ)), str::parse::<Wishes>);
    let wishes = wishes.map_err(|cause| value_error("measure", cause))?;
    let region = within.map(str::parse::<Region>).transpose();
    let region = region.map_err(|cause| value_error("within", cause))?;
    let least = if samples.is_some() { 0 } else { LEAST };
    if accuracy.is_none() && !(least..=MOST).contains(&count) {
        let cause = format!("{count}; {least} to {MOST} measurements can be planned");
        return Err(value_error("count", cause));
    }
    let steps = Steps::default();
    let request = PlanRequest {
        accuracy,
        frame: word("frame", frame, FRAMES)?,
        region,
        absolute,
        order: word("order", order, "\"random\" or \"shortest\"")?,
        seed,
        steps: Some(&steps),
        ..PlanRequest::new(&robot.file, wishes, count)
    };
    if let Some(samples) = samples {
        return added(py, &request, samples, names, progress.as_ref());
    }
    let plan = || planning::plan(&request);
    let found = with_cores_telling(py, progress.as_ref(), plan, || steps.counted())?;
    let mut found = found.map_err(plan_error)?;
    found.measurements = labelled(found.measurements, names, 1);
    let (json, text) = (plan_report::json(&found), plan_report::text(&found));
    planned(py, &robot.file, &found.measurements, &json, in_python(text))
}

/// What samples determine, and what to add.
fn added<'py>(
    py: Python<'py>,
    request: &PlanRequest<'_>,
    samples: &Samples,
    names: Option<&str>,
    progress: Option<&Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let file = with_cores(py, || Rows::read(&samples.text, request.robot))?;
    let file = file.map_err(|mut error| {
        error.line = error.line.map(|own| samples.place_of(own));
        input_error(&error, samples.arrays_name())
    })?;
    let unmeasured = file.unmeasured.iter();
    let unmeasured: Vec<_> = unmeasured.map(|line| samples.place_of(*line)).collect();
    let readings = samples.placed(file.readings);
    let determined = || Determined::by(request, &readings, &unmeasured);
    // Nothing is exchanged.
    let found = with_cores_telling(py, progress, determined, || [0, 0])?;
    let mut found = found.map_err(plan_error)?;
    found.next = labelled(found.next, names, 1);
    let json = plan_report::samples_json(&found);
    let text = words(plan_report::samples_text(&found), samples.in_arrays);
    planned(py, request.robot, &found.next, &json, text)
}

fn planned<'py>(
    py: Python<'py>,
    robot: &RobotFile,
    rows: &[Planned],
    json: &str,
    text: String,
) -> PyResult<Bound<'py, PyDict>> {
    let convention = robot.convention;
    let q = rows
        .iter()
        .flat_map(|own| convention.directed(&own.reading.joints));
    let x = rows.iter().flat_map(|own| own.position_mm);
    Ok(dict!(py,
        "q": array(py, q.collect(), &[rows.len(), 3])?,
        "x": array(py, x.collect(), &[rows.len(), 3])?,
        "csv": plan_report::csv(rows, &convention),
        "report": loads(py, json)?,
        "text": text,
    ))
}

fn plan_error(error: PlanError) -> PyErr {
    match error {
        PlanError::Singular | PlanError::NotDetermined { .. } | PlanError::TooAccurate { .. } => {
            let finding = ("plan", error.to_string(), error.remedy().to_string());
            refusal(vec![finding], false)
        }
        _ => {
            let argument = match error {
                PlanError::NoCoordinates => "frame",
                PlanError::NoPlace => "absolute",
                _ => "measure",
            };
            value_error(argument, in_python(format!("{error}\n{}", error.remedy())))
        }
    }
}

/// Verdict, report for programs, certificate and text.
#[pyfunction]
pub(crate) fn validate<'py>(
    py: Python<'py>,
    robot: &Robot,
    samples: &Samples,
    limit: f64,
    frame: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let stored = frame == "stored";
    let request = Request {
        limit,
        frame: word("frame", if stored { "sensor" } else { frame }, FRAMES)?,
        stored,
    };
    check_independent(&robot.source, &samples.text).map_err(|error| input_error(&error, None))?;
    let found = with_cores(py, || {
        let options = Options {
            frame: request.frame,
            ..Options::default()
        };
        let readings = samples.readings(robot, options)?;
        delta_cal_host::validation::validate(&robot.file, &readings, request)
    })?;
    let found = found.map_err(|error| calibrate_error(&error, samples.arrays_name()))?;
    let document = document(robot, samples);
    let deviations = found.rows.iter().map(|own| own.deviation_mm).collect();
    Ok(dict!(py,
        "verdict": found.verdict.name(),
        "rms": found.rms_error.error.value,
        "interval": found.rms_error.error.interval,
        "largest": found.largest_error.value,
        "confidence": found.rms_error.confidence_below_limit,
        "deviations": array(py, deviations, &[found.rows.len()])?,
        "warnings": found.warnings.iter().map(in_python).collect::<Vec<_>>(),
        "report": loads(py, &validation::json(&found, &document))?,
        "html": validation::certificate(&found, &document),
        "text": words(validation::text(&found), samples.in_arrays),
    ))
}

/// The lines to paste, with and without the comment that says what is lost, and the report for programs.
#[pyfunction]
pub(crate) fn export<'py>(
    py: Python<'py>,
    robot: &Robot,
    target: &str,
    nominal: Option<&Robot>,
    x: Option<PyReadonlyArrayDyn<'py, f64>>,
    home: Option<[f64; 3]>,
    height: Option<f64>,
    limit: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let drive = robot.file.robot.drive();
    let found = target_of(target, drive);
    let target = found.map_err(|error| value_error("target", in_python(error)))?;
    if let Some(nominal) = nominal
        && nominal.file.robot.drive() != drive
    {
        let cause = format!("its drives are not {drive:?}, as those of robot are").to_lowercase();
        return Err(value_error("nominal", cause));
    }
    let positions = x.map(|rows| -> PyResult<Vec<Vector3<f64>>> {
        let (rows, _) = rows.as_slice()?.as_chunks::<3>();
        let inside = |own: &[f64; 3]| robot.file.convention.vector(&(*own).into());
        Ok(rows.iter().map(inside).collect())
    });
    let positions = positions.transpose()?;
    let settings = Settings {
        home,
        height,
        limit,
        ..Settings::default()
    };
    let found = with_cores(py, || {
        let wanted = match positions.clone() {
            Some(positions) => Wanted::of("x", positions),
            None => Wanted::in_workspace(&robot.file),
        };
        let case = Case {
            robot: &robot.file,
            nominal: nominal.map(|own| &own.file),
            wanted: &wanted,
            settings,
        };
        case.export(target)
    })?;
    let found = found.map_err(|error| {
        let argument = match error {
            ExportError::Home { .. } | ExportError::HomeOutside { .. } => "home",
            ExportError::TooFewPositions(_) | ExportError::Unreached if positions.is_some() => "x",
            ExportError::LimitNotMet { .. } => "limit",
            _ => "robot",
        };
        value_error(argument, in_python(format!("{error}\n{}", error.remedy())))
    })?;
    let warnings = found.written.warnings.iter().map(in_python);
    Ok(dict!(py,
        "lines": &found.written.lines,
        "text": found.to_text(),
        "kept": found.kept,
        "warnings": warnings.collect::<Vec<_>>(),
        "report": loads(py, &found.to_json())?,
    ))
}

/// Robot, samples, joints at the end stops, radius of the bed and notes.
#[pyfunction]
pub(crate) fn import_<'py>(
    py: Python<'py>,
    file: Part,
    firmware: Option<&str>,
    stated: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let (text, firmware, stated) = configuration(file, firmware, stated)?;
    let found = firmware.import(&text, &stated, &included);
    let found = found.and_then(|own| own.with_prints(&stated, &[]));
    let found = found.map_err(|error| input_error(&error, None))?;
    let robot = Robot::of_text(InputText::new(&found.robot.name, &found.robot_text()))?;
    let name = format!("{}, readings", found.robot.name);
    Ok(dict!(py,
        "robot": Py::new(py, robot)?,
        "samples": found.samples_text().map(|text| (name, text)),
        "home": found.home,
        "bed_radius": found.bed_radius,
        "notes": &found.notes,
    ))
}

/// The report of the workspace, its text, and its boundary as CSV.
#[pyfunction]
pub(crate) fn workspace<'py>(
    py: Python<'py>,
    robot: &Robot,
    tolerance: f64,
    spacing: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let options = Resolution { tolerance, spacing };
    let found = with_cores(py, || Analysis::compute(&robot.file, &options, &mut |_| {}))?;
    let found = found.map_err(|error| {
        let argument = match error {
            WorkspaceError::Thin { .. } | WorkspaceError::TooFine { .. } => "spacing",
            _ => "robot",
        };
        value_error(argument, in_python(format!("{error}\n{}", error.remedy())))
    })?;
    let convention = robot.file.convention;
    let points = found.workspace.points.iter();
    let points = points.flat_map(|own| <[f64; 3]>::from(convention.vector(&own.position)));
    let points: Vec<f64> = points.collect();
    let shape = [points.len() / 3, 3];
    Ok(dict!(py,
        "boundary": array(py, points, &shape)?,
        "report": loads(py, &workspace_report::to_json(&found))?,
        "text": in_python(workspace_report::to_text(&found)),
    ))
}

/// How positions of two robots differ over the workspace, for programs and for people.
#[pyfunction]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    before: &Robot,
    after: &Robot,
) -> PyResult<Bound<'py, PyDict>> {
    let found = with_cores(py, || Comparison::of(&before.file, &after.file))?;
    let found = found.map_err(|error| input_error(&error, None))?;
    Ok(dict!(py,
        "report": loads(py, &validation::changes_json(&found))?,
        "text": in_python(validation::changes(&found)),
    ))
}

/// The table of a simulated campaign, a row a robot.
#[pyfunction]
pub(crate) fn simulate(
    py: Python<'_>,
    robot: &Robot,
    first: u64,
    count: u64,
    seed: u64,
    poses: u64,
    method: &str,
    planned: bool,
    spread: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let case = OneCase {
        robot: "robot",
        robots: 1,
        seed,
        spread: word("spread", spread, "\"normal\" or \"uniform\"")?,
        poses,
        method: word("method", method, METHODS)?,
        planned,
    };
    if let Err(missing) = case.to_toml(&robot.file) {
        return Err(value_error(missing, "needed, here or in the robot"));
    }
    let plan = case.plan(&robot.file);
    let plan = plan.map_err(|error| input_error(&error, None))?;
    let end = first
        .checked_add(count)
        .ok_or_else(|| value_error("n", "too many robots"))?;
    let counted = AtomicU64::new(0);
    let mut run = |own, _| counted.store(own, Relaxed);
    let run = || campaign::run(&plan, &(first..end), &mut run);
    let told = || [counted.load(Relaxed), count];
    let found = with_cores_telling(py, progress.as_ref(), run, told)?;
    let found = found.map_err(|error| input_error(&error, None))?;
    campaign::rows_csv(&found).map_err(|error| PyRuntimeError::new_err(error.to_string()))
}
