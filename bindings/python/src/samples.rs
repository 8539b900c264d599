//! Samples: files, frames and arrays as tables, which the reader of samples files reads.

use crate::arrays::{array, with_cores};
use crate::errors::{calibrate_error, input_error, value_error};
use crate::files::{dict, sha256};
use crate::printer::Part;
use crate::robot::Robot;
use delta_cal_host::files::columns::ColumnMapping;
use delta_cal_host::files::input::Cells;
use delta_cal_host::{CalibrateError, InputText, Options, Readings, read_samples as read};
use nalgebra::{Matrix3, Vector3};
use numpy::{PyReadonlyArray1, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A table's header and first line.
const ABOVE: u64 = 2;

/// The samples of `delta_cal/_robot.py`: joint angles and what was measured there.
#[pyclass(frozen, module = "delta_cal._native")]
#[derive(Clone)]
pub(crate) struct Samples {
    columns: Option<String>,
    /// Shapes of the covariances of the rows of arrays.
    shapes: Vec<Option<Matrix3<f64>>>,
    /// Whether they are arrays or a frame, whose rows count from 0, and no file.
    pub(crate) in_arrays: bool,
    pub(crate) text: InputText,
}

impl Samples {
    /// Of what is already read, which Python does not get.
    pub(crate) fn of_input(text: InputText) -> Self {
        Self {
            columns: None,
            shapes: Vec::new(),
            in_arrays: false,
            text,
        }
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

#[pymethods]
impl Samples {
    /// Of names and bytes of a file, and of the one with what was measured if that has joints alone.
    #[staticmethod]
    pub(crate) fn of_bytes(
        py: Python<'_>,
        parts: Vec<Part>,
        columns: Option<String>,
    ) -> PyResult<Self> {
        let mapping = match columns.as_deref() {
            Some(columns) => columns.parse::<ColumnMapping>(),
            None => Ok(ColumnMapping::default()),
        };
        let mapping = mapping.map_err(|cause| value_error("columns", cause))?;
        let mut texts = parts.iter().map(|(name, bytes)| {
            let text = with_cores(py, || InputText::from_bytes(name, bytes))?;
            let text = text.map_err(|error| input_error(&error, None))?;
            Ok::<_, PyErr>(text.with_columns(mapping.clone()))
        });
        let first = texts.next().transpose()?;
        let first = first.ok_or_else(|| value_error("samples", "no file is given"))?;
        Ok(Self {
            columns,
            ..Self::of_input(first.joined(texts.next().transpose()?))
        })
    }

    fn arrays<'py>(&self, py: Python<'py>, robot: &Robot) -> PyResult<Bound<'py, PyDict>> {
        let readings = with_cores(py, || self.readings(robot, Options::default()))?;
        let readings = readings.map_err(|error| calibrate_error(&error, self.arrays_name()))?;
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

    #[pyo3(name = "text")]
    fn named_text(&self) -> (&str, &str) {
        (self.text.name(), self.text.text())
    }

    /// SHA-256 of the contents, 64 hexadecimal digits.
    pub(crate) fn fingerprint(&self) -> String {
        let beside = self.text.beside().map_or("", InputText::sha256);
        let (own, columns) = (self.text.sha256(), self.columns.as_deref());
        let shapes: Vec<_> = self.shapes.iter().flatten().collect();
        sha256(&format!("{own}{beside}{columns:?}{shapes:?}"))
    }
}

/// Of arrays or a frame by the names of the columns, which no text holds, and the shapes (n, 3, 3) of the covariances, NaN
/// of rows without.
#[pyfunction]
pub(crate) fn samples_of_columns(
    py: Python<'_>,
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
    let text = py.detach(|| InputText::of_columns(name, columns));
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
        ..Samples::of_input(text)
    })
}
