//! A calibration and everything there is to know of it.

use crate::arrays::{array, hexadecimal, with_cores};
use crate::errors::{calibrate_error, value_error};
use crate::robot::{Robot, parameters_of};
use crate::samples::{Again, Samples};
use delta_cal_host::calibration::report::FrameReport;
use delta_cal_host::files::document::Document;
use delta_cal_host::report::calibration::comment;
use delta_cal_host::{Frame, Method, Options, Readings, Report};
use nalgebra::Vector3;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sha2::{Digest, Sha256};
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

/// A calibrated robot with its uncertainty, residuals and findings.
///
/// A notebook shows its report, `print` its tables. Two calibrations are equal if robot file, samples and options
/// are; a pickled one is computed again, with the same bits.
#[pyclass(frozen, eq, hash, module = "delta_cal")]
pub(crate) struct Calibration {
    report: Report,
    readings: Readings,
    before: Py<Robot>,
    after: Py<Robot>,
    samples: Samples,
    asked: Asked,
}

/// How a calibration was asked for; pickled as a dict.
#[derive(Clone, FromPyObject, IntoPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Asked {
    frame: String,
    method: Option<String>,
    robust: bool,
    limit: Option<f64>,
    /// Seconds since the beginning of 1970.
    written: u64,
}

impl Asked {
    fn options(&self) -> PyResult<Options> {
        Ok(Options {
            method: match self.method.as_deref() {
                None => None,
                Some(method) => Some(method_of(method)?),
            },
            robust: self.robust,
            frame: frame_of(&self.frame)?,
            of_printer: false,
        })
    }

    fn calibrated(self, py: Python<'_>, robot: Robot, samples: Samples) -> PyResult<Calibration> {
        let options = self.options()?;
        if let Some(limit) = self.limit.filter(|own| !(*own > 0.0)) {
            let cause = format!("{limit}; a length above 0 mm is needed");
            return Err(value_error("limit", cause));
        }
        let found = with_cores(py, || {
            let readings = samples.readings(&robot, options)?;
            let report = delta_cal_host::calibrate(&robot.file, &readings, &options)?;
            Ok((readings, report))
        })?;
        let (readings, mut report) =
            found.map_err(|error| calibrate_error(py, &error, samples.rows_of()))?;
        report.document = Some(document(&robot, &samples, self.written));
        if let Some(limit) = self.limit {
            report = report.with_limit(limit);
        }
        let after = Robot::of_file(&report.after, &comment(&report, &readings))?;
        Ok(Calibration {
            report,
            readings,
            before: Py::new(py, robot)?,
            after: Py::new(py, after)?,
            samples,
            asked: self,
        })
    }
}

/// "base" or "sensor".
pub(crate) fn frame_of(frame: &str) -> PyResult<Frame> {
    match frame {
        "base" => Ok(Frame::Base),
        "sensor" => Ok(Frame::Sensor),
        _ => Err(value_error("frame", "\"base\" or \"sensor\" is needed")),
    }
}

/// "joint", "ikm" or "fkm".
pub(crate) fn method_of(method: &str) -> PyResult<Method> {
    match method {
        "joint" => Ok(Method::Joint),
        "ikm" => Ok(Method::Ikm),
        "fkm" => Ok(Method::Fkm),
        _ => {
            let cause = format!("{method}; \"joint\", \"ikm\" or \"fkm\" is needed");
            Err(value_error("method", cause))
        }
    }
}

/// What identifies a report.
pub(crate) fn document(robot: &Robot, samples: &Samples, written: u64) -> Document {
    Document::new(&robot.file, &robot.source, &samples.text, written)
}

/// Seconds since the beginning of 1970, or what the standard for reproducible builds states in their place.
pub(crate) fn now() -> u64 {
    let stated = std::env::var("SOURCE_DATE_EPOCH").ok();
    stated.and_then(|own| own.parse().ok()).unwrap_or_else(|| {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        since.map_or(0, |since| since.as_secs())
    })
}

/// A text as Python's objects.
pub(crate) fn loads<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (json,))
}

/// Without the colours of a terminal.
pub(crate) fn plain(text: &str) -> String {
    let mut parts = text.split('\u{1b}');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| {
        let (_, rest) = part.split_once('m').unwrap_or(("", part));
        text + rest
    })
}

/// Calibrates a robot.
///
/// Parameters
/// ----------
/// robot : Robot
///     The robot before calibration. State tolerance and noise for a better result and a reliable σ.
/// q : array (n, 3), Samples, or a frame with the columns of a samples file
///     Joint angles, radians. Samples and a frame may hold the readings as well.
/// x : array (n, 3) or frame, optional
///     Measured positions, mm, a row for each of `q`.
/// noise, tolerance, zero : optional
///     In place of the robot's own, as of `Robot.nominal`.
/// frame : {"base", "sensor"}
///     The frame of `x`; the sensor's may stand anywhere and is found with the parameters.
/// method : {"joint", "ikm", "fkm"}, optional
///     Joint for complete positions in the robot's frame, otherwise fkm.
/// robust : bool
///     Leave out and name samples that disagree (Tukey's loss).
/// limit : float, optional
///     Largest expanded uncertainty (95 % of positions), mm; the report says whether it is met.
///
/// Raises
/// ------
/// Refused
///     The samples cannot calibrate this robot; `findings` says why and what to do.
/// ValueError
///     An argument that cannot be used; the message begins with its name. Rows are counted from 0.
#[pyfunction]
#[pyo3(signature = (robot, q, x=None, *, noise=None, tolerance=None, zero=None, frame="base", method=None, robust=false, limit=None))]
pub(crate) fn calibrate(
    py: Python<'_>,
    robot: &Robot,
    q: &Bound<'_, PyAny>,
    x: Option<&Bound<'_, PyAny>>,
    noise: Option<&Bound<'_, PyAny>>,
    tolerance: Option<(f64, f64)>,
    zero: Option<f64>,
    frame: &str,
    method: Option<String>,
    robust: bool,
    limit: Option<f64>,
) -> PyResult<Calibration> {
    let robot = robot.known(noise, tolerance, zero)?;
    let samples = Samples::given(&robot, q, x)?;
    let asked = Asked {
        frame: frame.to_owned(),
        method,
        robust,
        limit,
        written: now(),
    };
    asked.calibrated(py, robot, samples)
}

/// Of a pickled calibration.
#[pyfunction]
pub(crate) fn calibrate_again(
    py: Python<'_>,
    robot: &Robot,
    samples: &Samples,
    asked: Asked,
) -> PyResult<Calibration> {
    asked.calibrated(py, robot.known(None, None, None)?, samples.clone())
}

#[pymethods]
impl Calibration {
    /// The calibrated robot, with all else that its file said.
    #[getter]
    fn robot(&self, py: Python<'_>) -> Py<Robot> {
        self.after.clone_ref(py)
    }

    /// The robot as it was.
    #[getter]
    fn before(&self, py: Python<'_>) -> Py<Robot> {
        self.before.clone_ref(py)
    }

    /// The 24 parameters, array (3, 8): mm and radians, as `Robot.parameters`.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let robot = &self.report.solution.robot;
        parameters_of(py, robot, &self.report.before.convention)
    }

    /// Their standard uncertainties, array (3, 8): mm and radians.
    #[getter]
    fn sigma<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let covariance = &self.report.solution.covariance;
        let sigma = (0..24).map(|place| covariance[(place, place)].sqrt());
        array(py, sigma.collect(), &[3, 8])
    }

    /// Their covariance, array (24, 24), arm by arm: mm, radians and their products.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let own = self.report.solution.of_parameters();
        let signs = self.report.before.convention.signs();
        let stated = |place: usize| {
            let (row, column) = (place / 24, place % 24);
            // Of one triangle: symmetric to the last bit.
            signs[row % 8] * signs[column % 8] * own[(row.max(column), row.min(column))]
        };
        array(py, (0..576).map(stated).collect(), &[24, 24])
    }

    /// Readings less what the calibrated robot gives, mm, a row a sample: array (n, 3) of x, y, z, with heights or
    /// distances among the readings (n, 5). NaN where nothing was read.
    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let solution = &self.report.solution;
        let rows = &solution.readings.rows;
        let coordinates = rows.iter().all(|row| {
            let [.., height, distance] = row.value.read();
            height.is_none() && distance.is_none()
        });
        let width = if coordinates { 3 } else { 5 };
        let axes = self.report.before.convention;
        let mut found = Vec::with_capacity(width * rows.len());
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

    /// The lines of the samples in the order of `residuals`; the row i of an array has the line i + 2. Rows equal to an
    /// earlier one are left out.
    #[getter]
    fn lines<'py>(&self, py: Python<'py>) -> Bound<'py, numpy::PyArray1<u64>> {
        let lines = self.readings.rows.iter().map(|row| row.line);
        numpy::PyArray1::from_vec(py, lines.collect())
    }

    /// The position error that the calibrated robot is expected to have (σ, rms over the workspace and worst), mm; None
    /// if it cannot be estimated. Keys: `absolute_rms_mm`, `absolute_worst_mm`, `absolute_worst_at_mm`, and the same
    /// of `relative`.
    #[getter]
    fn expected_error<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let json = serde_json::to_string(&self.report.expected_error);
        loads(py, &json.unwrap_or_default())
    }

    /// Everything that was found, the gravest first: dicts with `level` ("warning" or "note"), `text`, `kind` and the
    /// figures. Lines are those of `lines`.
    #[getter]
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let json = serde_json::to_string(&self.report.findings);
        loads(py, &json.unwrap_or_default())
    }

    /// From the robot's frame to the sensor's, array (4, 4): X_sensor = T X_robot, mm; None with `frame="base"`.
    #[getter]
    fn frame<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(FrameReport {
            rotation: [x, y, z],
            translation_mm: [a, b, c],
        }) = self.report.sensor_frame
        else {
            return Ok(None);
        };
        let rows = [
            [x[0], x[1], x[2], a],
            [y[0], y[1], y[2], b],
            [z[0], z[1], z[2], c],
            [0.0, 0.0, 0.0, 1.0],
        ];
        array(py, rows.concat(), &[4, 4]).map(Some)
    }

    /// The estimator: "joint", "ikm" or "fkm".
    #[getter]
    fn method(&self) -> &'static str {
        match self.report.method {
            Method::Joint => "joint",
            Method::Ikm => "ikm",
            Method::Fkm => "fkm",
        }
    }

    /// SHA-256 of robot file, samples and options, 64 hexadecimal digits.
    #[getter]
    pub(crate) fn fingerprint(&self) -> String {
        let asked = &self.asked;
        let mut digest = Sha256::new();
        digest.update(self.before.get().fingerprint());
        digest.update(self.samples.fingerprint());
        digest.update(format!(
            "{} {:?} {} {:?}",
            asked.frame, asked.method, asked.robust, asked.limit
        ));
        hexadecimal(digest.finalize())
    }

    /// The report of `delta-cal calibrate --json`: angles in degrees, keys as docs/calibration.schema.json has them.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        loads(py, &self.report.to_json())
    }

    /// The report as one HTML page.
    fn to_html(&self, py: Python<'_>) -> String {
        py.detach(|| self.report.to_html())
    }

    /// Writes the report, by the name of the file: .html, .json, .txt, or .toml for the calibrated robot.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        let ending = path.extension().and_then(|own| own.to_str());
        let text = match ending.unwrap_or_default() {
            "html" => self.report.to_html(),
            "json" => self.report.to_json(),
            "txt" => plain(&self.report.to_text()),
            "toml" => self.after.get().source.text().to_owned(),
            _ => {
                let cause = "a name that ends in .html, .json, .txt or .toml is needed";
                return Err(value_error("path", cause));
            }
        };
        Ok(std::fs::write(path, text)?)
    }

    /// Draws parameters, residuals and the region where positions are known worst, with matplotlib.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    fn plot<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let drawing = slf.py().import("delta_cal._plot")?;
        drawing.call_method1("calibration", (slf,))
    }

    fn _repr_html_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let escaped = py
            .import("html")?
            .call_method1("escape", (self.report.to_html(),))?;
        let frame = PyDict::new(py);
        frame.set_item("page", escaped)?;
        let page = "<iframe style=\"width:100%;height:40em;border:0\" srcdoc=\"{page}\"></iframe>";
        pyo3::types::PyString::new(py, page).call_method("format", (), Some(&frame))
    }

    fn __repr__(&self) -> String {
        plain(&self.report.to_text())
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Again<'py, (Py<Robot>, Samples, Asked)>> {
        let again = py.import("delta_cal._native")?.getattr("calibrate_again")?;
        let parts = (
            self.before.clone_ref(py),
            self.samples.clone(),
            self.asked.clone(),
        );
        Ok((again, parts))
    }
}
