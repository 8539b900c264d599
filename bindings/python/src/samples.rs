//! Samples: files, frames and arrays as one text, which the reader of samples files reads.

use crate::arrays::{array, finite, frame_text, hexadecimal, is_frame};
use crate::errors::{input_error, value_error};
use crate::robot::Robot;
use delta_cal::robot::Drive;
use delta_cal_host::files::columns::ColumnMapping;
use delta_cal_host::{CalibrateError, InputText, Options, Readings, read_samples as read};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use sha2::{Digest, Sha256};
use std::fmt::Write;
use std::path::PathBuf;

/// The name of samples that are arrays.
const ARRAYS: &str = "q, x";
/// The name of samples that are a frame.
const FRAME: &str = "samples";

/// Joint angles and what was measured there: positions, single coordinates, heights, distances, in any mixture.
///
/// Read by `read_samples`; its columns are explained with a robot when it is used.
#[pyclass(frozen, eq, hash, module = "delta_cal")]
#[derive(Clone)]
pub(crate) struct Samples {
    /// Name and bytes of the file, and of the one beside it.
    parts: Vec<(String, Vec<u8>)>,
    columns: Option<String>,
    pub(crate) text: InputText,
}

impl Samples {
    fn of(parts: Vec<(String, Vec<u8>)>, columns: Option<String>) -> PyResult<Self> {
        let mapping = match columns.as_deref() {
            Some(columns) => columns.parse::<ColumnMapping>(),
            None => Ok(ColumnMapping::default()),
        };
        let mapping = mapping.map_err(|cause| value_error("columns", cause))?;
        let mut texts = Vec::new();
        for (name, bytes) in &parts {
            let text = InputText::from_bytes(name, bytes);
            let text = text.map_err(|error| input_error(&error, None))?;
            texts.push(text.with_columns(mapping.clone()));
        }
        let mut texts = texts.into_iter();
        let (Some(first), second) = (texts.next(), texts.next()) else {
            return Err(value_error("samples", "no file is given"));
        };
        let text = match second {
            // Joints in one file, what was measured in the other.
            Some(measured) => measured.with_beside(first),
            None => first,
        };
        Ok(Self {
            parts,
            columns,
            text,
        })
    }

    fn of_text(name: &str, text: String) -> PyResult<Self> {
        Self::of(vec![(name.to_owned(), text.into_bytes())], None)
    }

    /// Whether messages are to count rows from 0: `Some` of samples that are no file.
    pub(crate) fn rows_of(&self) -> Option<&str> {
        let name = self.text.name();
        (name == ARRAYS || name == FRAME).then_some(name)
    }

    pub(crate) fn readings(
        &self,
        robot: &Robot,
        options: Options,
    ) -> Result<Readings, CalibrateError> {
        read(&self.text, &robot.file, &options)
    }

    /// What `calibrate` and `validate` are given: samples, a frame of all columns, or joints and positions.
    pub(crate) fn given(
        robot: &Robot,
        q: &Bound<'_, PyAny>,
        x: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let Some(x) = x else {
            if let Ok(samples) = q.cast::<Self>() {
                return Ok(samples.get().clone());
            }
            if is_frame(q)? {
                return Self::of_text(FRAME, frame_text("samples", q)?);
            }
            return Err(value_error("x", "positions are needed beside joint angles"));
        };
        if q.cast::<Self>().is_ok() {
            return Err(value_error("x", "the samples hold the positions already"));
        }
        let drive = robot.file.robot.drive();
        let (joints, positions) = (robot.joints(q)?, robot.positions(x)?);
        let (joints, positions) = (joints.get()?, positions.get()?);
        if joints.len() != positions.len() {
            let cause = format!("{} rows, and q has {}", positions.len(), joints.len());
            return Err(value_error("x", cause));
        }
        if joints.is_empty() {
            return Err(value_error("q", "no rows"));
        }
        finite("q", joints)?;
        finite("x", positions)?;
        let mut text = match drive {
            Drive::Rotary => "q1_rad,q2_rad,q3_rad,x_mm,y_mm,z_mm\n",
            Drive::Linear => "s1_mm,s2_mm,s3_mm,x_mm,y_mm,z_mm\n",
        }
        .to_owned();
        // The shortest text that reads back as the same number.
        for ([a, b, c], [x, y, z]) in joints.iter().zip(positions) {
            let _ = writeln!(text, "{a:?},{b:?},{c:?},{x:?},{y:?},{z:?}");
        }
        Self::of_text(ARRAYS, text)
    }
}

/// A function, and the arguments with which it makes an object again.
pub(crate) type Again<'py, T> = (Bound<'py, PyAny>, T);
/// Name and bytes of a file.
type Part<'py> = (String, Bound<'py, PyBytes>);

#[pymethods]
impl Samples {
    /// What the rows hold, as a robot's convention has it.
    ///
    /// Returns
    /// -------
    /// dict of arrays
    ///     `q` (n, 3) radians; `x` (n, 3), `height` (n,) and `distance` (n,) mm, NaN where nothing was read; `line` (n,)
    ///     of the file.
    fn arrays<'py>(&self, py: Python<'py>, robot: &Robot) -> PyResult<Bound<'py, PyDict>> {
        let readings = Readings::read(&self.text, &robot.file);
        let readings = readings.map_err(|error| input_error(&error, self.rows_of()))?;
        let convention = robot.file.convention;
        let rows = &readings.rows;
        let count = rows.len();
        let q = rows
            .iter()
            .flat_map(|row| convention.directed(&row.value.joints));
        let x = rows.iter().flat_map(|row| {
            let own = row.value.position.map(|own| own.unwrap_or(f64::NAN));
            <[f64; 3]>::from(convention.vector(&own.into()))
        });
        let number = |own: Option<f64>| own.unwrap_or(f64::NAN);
        let height = rows.iter().map(|row| number(row.value.read()[3]));
        let distance = rows.iter().map(|row| number(row.value.read()[4]));
        let found = PyDict::new(py);
        found.set_item("q", array(py, q.collect(), &[count, 3])?)?;
        found.set_item("x", array(py, x.collect(), &[count, 3])?)?;
        found.set_item("height", array(py, height.collect(), &[count])?)?;
        found.set_item("distance", array(py, distance.collect(), &[count])?)?;
        let lines: Vec<u64> = rows.iter().map(|row| row.line).collect();
        found.set_item("line", numpy::PyArray1::from_vec(py, lines))?;
        Ok(found)
    }

    /// The name of the file.
    #[getter]
    fn name(&self) -> &str {
        self.text.name()
    }

    /// The text of the file.
    #[getter(text)]
    fn whole_text(&self) -> &str {
        self.text.text()
    }

    /// SHA-256 of the contents, 64 hexadecimal digits.
    #[getter]
    pub(crate) fn fingerprint(&self) -> String {
        let mut digest = Sha256::new();
        for (_, bytes) in &self.parts {
            digest.update(Sha256::digest(bytes));
        }
        digest.update(self.columns.as_deref().unwrap_or_default());
        hexadecimal(digest.finalize())
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Again<'py, (Vec<Part<'py>>, Option<String>)>> {
        let again = py
            .import("delta_cal._native")?
            .getattr("samples_of_bytes")?;
        let parts = self.parts.iter();
        let parts = parts.map(|(name, bytes)| (name.clone(), PyBytes::new(py, bytes)));
        Ok((again, (parts.collect(), self.columns.clone())))
    }

    fn __repr__(&self) -> String {
        let lines = self.text.text().lines().count();
        format!("<delta_cal.Samples {}, {lines} lines>", self.text.name())
    }
}

/// Reads a samples file: CSV in any encoding, units by the names of the columns.
///
/// Parameters
/// ----------
/// path : path
///     Joint angles and what was measured there; or joint angles alone.
/// positions : path, optional
///     What was measured, if the first file has the joint angles alone.
/// columns : str, optional
///     What columns hold whose names do not say it: `"q1_deg=A1,x_mm=Pos X"`.
///
/// Raises
/// ------
/// OSError
///     A file cannot be read.
/// ValueError
///     A file that is no text. Faults of its rows are raised where it is used.
#[pyfunction]
#[pyo3(signature = (path, positions=None, *, columns=None))]
pub(crate) fn read_samples(
    path: PathBuf,
    positions: Option<PathBuf>,
    columns: Option<String>,
) -> PyResult<Samples> {
    let mut parts = Vec::new();
    for path in std::iter::once(path).chain(positions) {
        parts.push((path.display().to_string(), std::fs::read(&path)?));
    }
    Samples::of(parts, columns)
}

/// Of names and bytes.
#[pyfunction]
pub(crate) fn samples_of_bytes(
    parts: Vec<(String, Vec<u8>)>,
    columns: Option<String>,
) -> PyResult<Samples> {
    Samples::of(parts, columns)
}
