//! Samples: files, frames and arrays as tables, which the reader of samples files reads.

use crate::arrays::{array, with_cores};
use crate::errors::{calibrate_error, in_rows, input_error, value_error};
use crate::files::{bytes_of, dict, plain, sha256};
use crate::robot::Robot;
use delta_cal_host::files::columns::ColumnMapping;
use delta_cal_host::files::input::Cells;
use delta_cal_host::{CalibrateError, InputText, Options, Readings, read_samples as read};
use nalgebra::{Matrix3, Vector3};
use numpy::{PyReadonlyArray1, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

/// A table's header and first line.
const ABOVE: u64 = 2;

/// Joint angles and what was measured there: positions, single coordinates, heights, distances, in any mixture.
///
/// Read by `read_samples`; its columns are explained with a robot when it is used.
#[pyclass(frozen, eq, hash, module = "delta_cal")]
#[derive(Clone)]
pub(crate) struct Samples {
    /// Name and bytes of the file, and of the one beside it.
    parts: Vec<(String, Vec<u8>)>,
    columns: Option<String>,
    /// Shapes of the covariances of the rows of arrays.
    shapes: Vec<Option<Matrix3<f64>>>,
    /// Whether they are arrays or a frame, whose rows count from 0, and no file.
    in_arrays: bool,
    pub(crate) text: InputText,
}

impl Samples {
    fn of(
        py: Python<'_>,
        parts: Vec<(String, Vec<u8>)>,
        columns: Option<String>,
    ) -> PyResult<Self> {
        let mapping = match columns.as_deref() {
            Some(columns) => columns.parse::<ColumnMapping>(),
            None => Ok(ColumnMapping::default()),
        };
        let mapping = mapping.map_err(|cause| value_error("columns", cause))?;
        let mut texts = Vec::new();
        for (name, bytes) in &parts {
            let text = with_cores(py, || InputText::from_bytes(name, bytes))?;
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
            shapes: Vec::new(),
            in_arrays: false,
            text,
        })
    }

    /// Of what is already read, which Python does not get.
    pub(crate) fn of_input(text: InputText) -> Self {
        Self {
            parts: Vec::new(),
            columns: None,
            shapes: Vec::new(),
            in_arrays: false,
            text,
        }
    }

    /// A text of these samples.
    pub(crate) fn words(&self, text: &str) -> String {
        let text = plain(text);
        if self.in_arrays { in_rows(&text) } else { text }
    }

    /// The name of arrays, whose rows count from 0; none of a file.
    pub(crate) fn arrays_name(&self) -> Option<&str> {
        self.in_arrays.then(|| self.text.name())
    }

    /// Of a line: of arrays the index of its row.
    pub(crate) fn place_of(&self, line: u64) -> u64 {
        if self.in_arrays {
            line.saturating_sub(ABOVE)
        } else {
            line
        }
    }

    /// The same of all lines of what was read.
    pub(crate) fn placed(&self, mut readings: Readings) -> Readings {
        for row in &mut readings.rows {
            row.line = self.place_of(row.line);
            let place = usize::try_from(row.line).unwrap_or(usize::MAX);
            row.value.shape = self.shapes.get(place).copied().flatten();
        }
        for line in &mut readings.copies {
            *line = self.place_of(*line);
        }
        let labels = readings.labels.into_iter();
        readings.labels = labels
            .map(|(line, own)| (self.place_of(line), own))
            .collect();
        readings
    }

    pub(crate) fn readings(
        &self,
        robot: &Robot,
        options: Options,
    ) -> Result<Readings, CalibrateError> {
        match read(&self.text, &robot.file, &options) {
            Ok(readings) => Ok(self.placed(readings)),
            Err(CalibrateError::Input(mut fault)) => {
                fault.line = fault.line.map(|line| self.place_of(line));
                Err(fault.into())
            }
            refused => refused,
        }
    }
}

/// A function, and the arguments with which it makes an object again.
pub(crate) type Again<'py, T> = (Bound<'py, PyAny>, T);
/// Name and bytes of a file.
type Part<'py> = (String, Bound<'py, PyBytes>);
/// The arguments of `samples_of_bytes`.
type Parts<'py> = (Vec<Part<'py>>, Option<String>);

#[pymethods]
impl Samples {
    /// What the rows hold.
    ///
    /// Parameters
    /// ----------
    /// robot : Robot
    ///     Its convention is that of the rows: `robot=robot`.
    ///
    /// Returns
    /// -------
    /// dict of arrays
    ///     `q` (n, 3) radians; `x` (n, 3), `height` (n,) and `distance` (n,) mm, NaN where nothing was read; `line` (n,)
    ///     of the file, or the index of the row of arrays.
    fn arrays<'py>(&self, py: Python<'py>, robot: &Robot) -> PyResult<Bound<'py, PyDict>> {
        let readings = with_cores(py, || self.readings(robot, Options::default()))?;
        let readings = readings.map_err(|error| calibrate_error(py, &error, self.arrays_name()))?;
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
        let lines = rows.iter().map(|row| row.line).collect();
        Ok(dict!(py,
            "q": array(py, q.collect(), &[count, 3])?,
            "x": array(py, x.collect(), &[count, 3])?,
            "height": array(py, height.collect(), &[count])?,
            "distance": array(py, distance.collect(), &[count])?,
            "line": array(py, lines, &[count])?,
        ))
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
        let beside = self.text.beside().map_or("", InputText::sha256);
        let (own, columns) = (self.text.sha256(), self.columns.as_deref());
        let shapes: Vec<_> = self.shapes.iter().flatten().collect();
        sha256(&format!("{own}{beside}{columns:?}{shapes:?}"))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Again<'py, Parts<'py>>> {
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
///     Joint angles and what was measured there; or joint angles alone: `path="samples.csv"`.
/// positions : path, optional
///     What was measured, if the first file has the joint angles alone: `positions="positions.csv"`.
/// columns : str, optional
///     What columns hold whose names do not say it: `columns="q1_deg=A1,x_mm=Pos X"`.
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
    path: &Bound<'_, PyAny>,
    positions: Option<&Bound<'_, PyAny>>,
    columns: Option<String>,
) -> PyResult<Samples> {
    let parts = std::iter::once(path).chain(positions).map(bytes_of);
    Samples::of(path.py(), parts.collect::<PyResult<_>>()?, columns)
}

/// Of names and bytes.
#[pyfunction]
pub(crate) fn samples_of_bytes(
    py: Python<'_>,
    parts: Vec<(String, Vec<u8>)>,
    columns: Option<String>,
) -> PyResult<Samples> {
    Samples::of(py, parts, columns)
}

/// Of arrays or a frame by the names of the columns, which no text holds, and the shapes (n, 3, 3) of the covariances, NaN
/// of rows without.
#[pyfunction]
pub(crate) fn samples_of_columns(
    robot: &Robot,
    name: &str,
    columns: Vec<(String, Bound<'_, PyAny>)>,
    shapes: Option<PyReadonlyArray3<'_, f64>>,
) -> PyResult<Samples> {
    let columns = columns.into_iter().map(|(name, own)| {
        let cells = match own.extract::<PyReadonlyArray1<'_, f64>>() {
            Ok(numbers) => Cells::Numbers(numbers.as_array().to_vec()),
            Err(_) => Cells::Words(own.extract()?),
        };
        Ok((name, cells))
    });
    let columns = columns.collect::<PyResult<_>>()?;
    let signs = Matrix3::from_diagonal(&Vector3::from(robot.file.convention.axes()));
    let shapes = match &shapes {
        Some(shapes) => shapes.as_slice()?.as_chunks::<9>().0,
        None => &[],
    };
    let shapes = shapes.iter().map(|own| {
        let own = signs * Matrix3::from_row_slice(own) * signs;
        (!own[0].is_nan()).then_some(own)
    });
    Ok(Samples {
        in_arrays: true,
        shapes: shapes.collect(),
        ..Samples::of_input(InputText::of_columns(name, columns))
    })
}
