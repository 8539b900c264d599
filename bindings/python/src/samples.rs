//! Samples: files, frames and arrays as tables, which the reader of samples files reads.

use crate::arrays::{Rows, array, frame, hexadecimal, named, names_of, numbers};
use crate::errors::{calibrate_error, input_error, type_error, value_error};
use crate::files::bytes_of;
use crate::robot::Robot;
use delta_cal::robot::Drive;
use delta_cal_host::files::columns::ColumnMapping;
use delta_cal_host::files::input::Cells;
use delta_cal_host::{CalibrateError, InputText, Options, Readings, read_samples as read};
use nalgebra::{Matrix3, Vector3};
use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyString};
use sha2::{Digest, Sha256};

/// A table's header and first line.
const ABOVE: u64 = 2;

/// One number, or one a row.
fn numbers_of(argument: &str, given: &Bound<'_, PyAny>, count: usize) -> PyResult<Cells> {
    let array = numbers(argument, given)?;
    let all = match array.as_slice()? {
        [one] => vec![*one; count],
        all if array.ndim() == 1 => all.to_vec(),
        _ => {
            let cause = format!(
                "shape {:?}; an array of shape (n,) is needed",
                array.shape()
            );
            return Err(value_error(argument, cause));
        }
    };
    check_count(argument, all.len(), count)?;
    finite(argument, all.iter().copied().enumerate())?;
    Ok(Cells::Numbers(all))
}

/// Whether an argument has more axes than that of the rows.
fn is_above_one(given: &Bound<'_, PyAny>) -> PyResult<bool> {
    let numpy = given.py().import("numpy")?;
    Ok(numpy.call_method1("ndim", (given,))?.extract::<usize>()? > 1)
}

/// σ and shape of the coordinates' covariance of each row.
type Covariances = (Cells, Vec<Option<Matrix3<f64>>>);

/// Of σ of each coordinate (n, 3), or of covariances (n, 3, 3).
fn covariances(
    argument: &str,
    given: &Bound<'_, PyAny>,
    count: usize,
    axes: [f64; 3],
) -> PyResult<Covariances> {
    let array = numbers::<f64>(argument, given)?;
    let all = array.as_slice()?;
    let matrices: Vec<Matrix3<f64>> = match array.shape() {
        [_, 3] => {
            let rows = all.as_chunks::<3>().0.iter();
            rows.map(|own| Matrix3::from_diagonal(&Vector3::from(own.map(|own| own * own))))
                .collect()
        }
        [_, 3, 3] => {
            let rows = all.as_chunks::<9>().0.iter();
            rows.map(|own| Matrix3::from_row_slice(own)).collect()
        }
        shape => {
            let cause = format!("shape {shape:?}; (n,), (n, 3) or (n, 3, 3) is needed");
            return Err(value_error(argument, cause));
        }
    };
    check_count(argument, matrices.len(), count)?;
    let signs = Matrix3::from_diagonal(&Vector3::from(axes));
    let (mut sigmas, mut shapes) = (Vec::new(), Vec::new());
    for (row, own) in matrices.into_iter().enumerate() {
        let square = own.trace() / 3.0;
        let shape = signs * own * signs / square;
        let off = (shape - shape.transpose()).abs().max();
        if !(square.is_finite() && off < SYMMETRIC && shape.cholesky().is_some()) {
            let cause = format!("row {row} is no covariance: symmetric and positive definite");
            return Err(value_error(argument, cause));
        }
        sigmas.push(square.sqrt());
        shapes.push(Some(shape));
    }
    Ok((Cells::Numbers(sigmas), shapes))
}

/// A covariance is as symmetric as rounding leaves it.
const SYMMETRIC: f64 = 1e-9;

/// One word, or one a row; None is none.
fn words_of(argument: &str, given: &Bound<'_, PyAny>, count: usize) -> PyResult<Cells> {
    let all = if let Ok(word) = given.cast::<PyString>() {
        vec![word.to_string(); count]
    } else {
        let words = given
            .try_iter()
            .map_err(|_| type_error(argument, "words are needed"))?;
        let words = words.map(|word| match word? {
            word if word.is_none() => Ok(String::new()),
            word => word.str().map(|own| own.to_string()),
        });
        words.collect::<PyResult<Vec<_>>>()?
    };
    check_count(argument, all.len(), count)?;
    let faulty = |own: &String| own.contains(['"', ',', ';', '\n', '\r', '\t']);
    match all.iter().position(faulty) {
        Some(row) => {
            let cause = format!("row {row}: a word without separators is needed");
            Err(value_error(argument, cause))
        }
        None => Ok(Cells::Words(all)),
    }
}

fn of_column(name: &str, column: &Bound<'_, PyAny>, count: usize) -> PyResult<Cells> {
    let array = column.call_method0("to_numpy")?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    match kind.as_str() {
        "f" => numbers_of(name, &array, count),
        _ => words_of(name, &array, count),
    }
}

fn missing(cells: &Cells, count: usize) -> Cells {
    match cells {
        Cells::Numbers(_) => Cells::Numbers(vec![f64::NAN; count]),
        Cells::Words(_) => Cells::Words(vec![String::new(); count]),
    }
}

/// Adds the cells of more rows.
fn append(argument: &str, own: &mut Cells, more: Cells) -> PyResult<()> {
    match (own, more) {
        (Cells::Numbers(own), Cells::Numbers(more)) => own.extend(more),
        (Cells::Words(own), Cells::Words(more)) => own.extend(more),
        _ => {
            let cause = "numbers in some rows and words in others";
            return Err(type_error(argument, cause));
        }
    }
    Ok(())
}

/// One a row: the argument, the column, and whether it is a number.
const READINGS: [(&str, &str, bool); 7] = [
    ("height", "height_mm", true),
    ("plane", "plane", false),
    ("distance", "distance_mm", true),
    ("point", "point", false),
    ("sigma", "sigma_mm", true),
    ("target", "target", false),
    ("name", "name", false),
];

/// That an argument has a row for each of `q`.
fn check_count(argument: &str, own: usize, count: usize) -> PyResult<()> {
    if own == count {
        return Ok(());
    }
    Err(value_error(
        argument,
        format!("{own} rows, and q has {count}"),
    ))
}

fn rows_for<'py>(count: usize, argument: &str, rows: Rows<'py>) -> PyResult<Rows<'py>> {
    let rows = rows.in_table(argument)?;
    check_count(argument, rows.get()?.len(), count)?;
    Ok(rows)
}

/// Columns of so many rows.
struct Table {
    count: usize,
    columns: Vec<(String, Cells)>,
    shapes: Vec<Option<Matrix3<f64>>>,
}

impl Table {
    /// Of arrays by the names of the arguments.
    fn of_arrays(robot: &Robot, given: &Bound<'_, PyDict>) -> PyResult<Self> {
        for name in given.keys() {
            let name: String = name.extract()?;
            let known =
                ["q", "x", "to"].contains(&&*name) || READINGS.iter().any(|own| own.0 == name);
            if !known {
                return Err(PyTypeError::new_err(format!("{name}: no such reading")));
            }
        }
        let get = |name: &str| {
            given
                .get_item(name)
                .map(|own| own.filter(|own| !own.is_none()))
        };
        let q = get("q")?.ok_or_else(|| value_error("q", "joint angles are needed"))?;
        let joints = robot.joints("q", &q)?.in_table("q")?;
        let count = joints.get()?.len();
        if count == 0 {
            return Err(value_error("q", "no rows"));
        }
        let mut table = Self {
            count,
            columns: Vec::new(),
            shapes: vec![None; count],
        };
        let joint = match robot.file.robot.drive() {
            Drive::Rotary => ["q1_rad", "q2_rad", "q3_rad"],
            Drive::Linear => ["s1_mm", "s2_mm", "s3_mm"],
        };
        table.vectors("q", joint.map(str::to_owned), joints.get()?)?;
        if let Some(x) = get("x")? {
            let rows = rows_for(count, "x", robot.positions(&x)?)?;
            table.vectors(
                "x",
                ["x_mm", "y_mm", "z_mm"].map(str::to_owned),
                rows.get()?,
            )?;
        }
        if let Some(to) = get("to")? {
            let rows = rows_for(count, "to", robot.joints("to", &to)?)?;
            table.vectors("to", joint.map(|own| format!("to_{own}")), rows.get()?)?;
        }
        for (argument, column, is_number) in READINGS {
            let Some(given) = get(argument)? else {
                continue;
            };
            let read = if is_number { numbers_of } else { words_of };
            let cells = if argument == "sigma" && is_above_one(&given)? {
                let axes = robot.file.convention.axes();
                let (sigmas, shapes) = covariances(argument, &given, count, axes)?;
                table.shapes = shapes;
                sigmas
            } else {
                read(argument, &given, count)?
            };
            table.columns.push((column.to_owned(), cells));
        }
        table.leave_out_the_unmeasured();
        Ok(table)
    }

    fn vectors(&mut self, argument: &str, names: [String; 3], rows: &[[f64; 3]]) -> PyResult<()> {
        let cells = rows.iter().enumerate();
        finite(
            argument,
            cells.flat_map(|(row, own)| own.map(|own| (row, own))),
        )?;
        for (place, name) in names.into_iter().enumerate() {
            let cells = Cells::Numbers(rows.iter().map(|row| row[place]).collect());
            self.columns.push((name, cells));
        }
        Ok(())
    }

    /// Rows without a joint, in the first three columns, or without any reading.
    fn leave_out_the_unmeasured(&mut self) {
        const READ: [&str; 5] = ["x_mm", "y_mm", "z_mm", "height_mm", "distance_mm"];
        let (joints, others) = self.columns.split_at_mut(3);
        let is_read = |(_, cells): &(String, Cells), row: usize| match cells {
            Cells::Numbers(all) => !all[row].is_nan(),
            Cells::Words(_) => false,
        };
        let used = |row: usize| {
            let mut read = others.iter().filter(|(name, _)| READ.contains(&&**name));
            joints.iter().all(|own| is_read(own, row)) && read.any(|own| is_read(own, row))
        };
        let used: Vec<_> = (0..self.count).map(used).collect();
        if used.iter().all(|own| *own) {
            return;
        }
        for (_, cells) in joints {
            if let Cells::Numbers(all) = cells {
                for cell in all.iter_mut().filter(|own| own.is_nan()) {
                    *cell = 0.0;
                }
            }
        }
        let words = used
            .iter()
            .map(|used| if *used { "1" } else { "0" }.to_owned());
        let cells = Cells::Words(words.collect());
        self.columns.push(("use".to_owned(), cells));
    }

    /// Of a frame, by the names of its columns.
    fn of_frame(frame: &Bound<'_, PyAny>) -> PyResult<Self> {
        let count = frame.len()?;
        let columns = names_of(FRAME, frame)?.into_iter().map(|name| {
            let cells = of_column(&name, &frame.get_item(&name)?, count)?;
            Ok((name, cells))
        });
        let columns = columns.collect::<PyResult<_>>()?;
        let shapes = vec![None; count];
        Ok(Self {
            count,
            columns,
            shapes,
        })
    }

    /// With the rows of another below.
    fn with(mut self, other: Self) -> PyResult<Self> {
        for (name, like) in &other.columns {
            if self.columns.iter().all(|(own, _)| own != name) {
                self.columns.push((name.clone(), missing(like, self.count)));
            }
        }
        for (name, own) in &mut self.columns {
            let more = other.columns.iter().find(|(other, _)| other == name);
            let more = more.map_or_else(|| missing(own, other.count), |(_, more)| more.clone());
            append(name, own, more)?;
        }
        self.count += other.count;
        self.shapes.extend(other.shapes);
        Ok(self)
    }
}

/// The name of samples that are a frame.
const FRAME: &str = "samples";

/// That no number is infinite.
fn finite(argument: &str, numbers: impl Iterator<Item = (usize, f64)>) -> PyResult<()> {
    let faulty = numbers.filter(|(_, own)| own.is_infinite());
    let mut rows: Vec<_> = faulty.map(|(row, _)| row).collect();
    rows.dedup();
    if rows.is_empty() {
        return Ok(());
    }
    Err(value_error(
        argument,
        format!("infinity in {}", named(&rows)),
    ))
}

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
    pub(crate) in_arrays: bool,
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
            let text = text.map_err(|error| input_error(&error, false))?;
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

    /// Rows of arrays or of a frame, which no text holds.
    fn of_table(name: &str, table: Table) -> Self {
        Self {
            in_arrays: true,
            shapes: table.shapes,
            ..Self::of_input(InputText::of_columns(name, table.columns))
        }
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

    /// What `calibrate` and `validate` are given: samples or their file, a frame of all columns, or arrays by name.
    pub(crate) fn given(robot: &Robot, given: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(samples) = given.cast::<Self>() {
            return Ok(samples.get().clone());
        }
        if let Some(frame) = frame(given)? {
            return Ok(Self::of_table(FRAME, Table::of_frame(&frame)?));
        }
        if given.is_instance_of::<PyString>() || given.hasattr("__fspath__")? {
            return read_samples(given, None, None);
        }
        let all = match given.cast::<PyDict>() {
            Ok(one) => PyList::new(given.py(), [one])?,
            Err(_) => given
                .py()
                .import("builtins")?
                .getattr("list")?
                .call1((given,))?
                .cast_into()?,
        };
        let mut names: Vec<String> = Vec::new();
        let mut whole: Option<Table> = None;
        for one in all.iter() {
            let one = one.cast_into::<PyDict>()?;
            for (name, value) in one.iter() {
                let name: String = name.extract()?;
                if !value.is_none() && !names.contains(&name) {
                    names.push(name);
                }
            }
            let table = Table::of_arrays(robot, &one)?;
            whole = Some(match whole {
                Some(whole) => whole.with(table)?,
                None => table,
            });
        }
        let whole = whole.ok_or_else(|| value_error("q", "no rows"))?;
        Ok(Self::of_table(&names.join(", "), whole))
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
    /// What the rows hold, as a robot's convention has it.
    ///
    /// Returns
    /// -------
    /// dict of arrays
    ///     `q` (n, 3) radians; `x` (n, 3), `height` (n,) and `distance` (n,) mm, NaN where nothing was read; `line` (n,)
    ///     of the file, or the index of the row of arrays.
    fn arrays<'py>(&self, py: Python<'py>, robot: &Robot) -> PyResult<Bound<'py, PyDict>> {
        let readings = self.readings(robot, Options::default());
        let readings = readings.map_err(|error| calibrate_error(py, &error, self.in_arrays))?;
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
        digest.update(self.text.sha256());
        digest.update(self.text.beside().map_or("", InputText::sha256));
        digest.update(self.columns.as_deref().unwrap_or_default());
        for own in self.shapes.iter().flatten().flat_map(|own| own.iter()) {
            digest.update(own.to_le_bytes());
        }
        hexadecimal(digest.finalize())
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
    path: &Bound<'_, PyAny>,
    positions: Option<&Bound<'_, PyAny>>,
    columns: Option<String>,
) -> PyResult<Samples> {
    let parts = std::iter::once(path).chain(positions).map(bytes_of);
    Samples::of(parts.collect::<PyResult<_>>()?, columns)
}

/// Of names and bytes.
#[pyfunction]
pub(crate) fn samples_of_bytes(
    parts: Vec<(String, Vec<u8>)>,
    columns: Option<String>,
) -> PyResult<Samples> {
    Samples::of(parts, columns)
}
