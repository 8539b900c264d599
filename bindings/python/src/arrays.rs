//! Arguments to rows of numbers, frames to tables, rows to arrays, and what identifies them.

use crate::errors::value_error;
use delta_cal::robot::Drive;
use delta_cal_host::{InputText, RobotFile};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use rayon::iter::{IndexedParallelIterator, IntoParallelRefMutIterator, ParallelIterator};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::f64::consts::TAU;
use std::fmt::{Display, Write};
use std::ops::BitOr;
use std::sync::{Arc, Mutex, PoisonError};

/// Rows that one core takes at once.
const CHUNK: usize = 2048;
/// Rows that a message names.
const NAMED: usize = 5;

/// Rows of three numbers, in place where they are contiguous 64-bit numbers.
pub(crate) struct Rows<'py> {
    array: PyReadonlyArrayDyn<'py, f64>,
    /// Whether one row was given, of shape (3,).
    pub(crate) single: bool,
}

impl Rows<'_> {
    pub(crate) fn get(&self) -> PyResult<&[[f64; 3]]> {
        Ok(self.array.as_slice()?.as_chunks().0)
    }
}

/// Numbers of any real type in the shape (n, 3) or (3,).
pub(crate) fn rows<'py>(argument: &str, given: &Bound<'py, PyAny>) -> PyResult<Rows<'py>> {
    let array = numbers(argument, given)?;
    let shape = array.shape();
    if shape.last() != Some(&3) || shape.len() > 2 {
        let cause = format!("shape {shape:?}; an array of shape (n, 3) is needed");
        return Err(value_error(argument, cause));
    }
    let single = shape.len() == 1;
    Ok(Rows { array, single })
}

/// Rows that were read from a frame.
pub(crate) fn rows_of(
    py: Python<'_>,
    rows: impl ExactSizeIterator<Item = [f64; 3]>,
) -> PyResult<Rows<'_>> {
    let shape = [rows.len(), 3];
    let array = array(py, rows.flatten().collect(), &shape)?;
    Ok(Rows {
        array: array.extract()?,
        single: false,
    })
}

/// Contiguous 64-bit numbers of any shape.
pub(crate) fn numbers<'py>(
    argument: &str,
    given: &Bound<'py, PyAny>,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let numpy = given.py().import("numpy")?;
    let array = numpy
        .call_method1("asarray", (given,))
        .map_err(|error| value_error(argument, error.value(given.py())))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["f", "i", "u"].contains(&kind.as_str()) {
        let cause = format!(
            "dtype {}; an array of real numbers is needed",
            array.getattr("dtype")?
        );
        return Err(value_error(argument, cause));
    }
    let array = numpy.call_method1("ascontiguousarray", (array, "float64"))?;
    array.extract()
}

/// An array of this shape.
pub(crate) fn array<'py>(
    py: Python<'py>,
    values: Vec<f64>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    PyArray1::from_vec(py, values).call_method1("reshape", (PyTuple::new(py, shape)?,))
}

/// "row 3 holds NaN", if one holds what is no finite number.
pub(crate) fn finite(argument: &str, rows: &[[f64; 3]]) -> PyResult<()> {
    let faulty = rows
        .iter()
        .enumerate()
        .filter(|(_, row)| !row.iter().all(|own| own.is_finite()));
    let faulty: Vec<String> = faulty.map(|(index, _)| index.to_string()).collect();
    let named = faulty.iter().take(NAMED).cloned().collect::<Vec<_>>();
    let more = if faulty.len() > NAMED { ", …" } else { "" };
    match faulty.len() {
        0 => Ok(()),
        1 => Err(value_error(
            argument,
            format!("row {} holds NaN or infinity; leave it out", named.join("")),
        )),
        count => Err(value_error(
            argument,
            format!(
                "{count} rows hold NaN or infinity; leave them out: {}{more}",
                named.join(", ")
            ),
        )),
    }
}

/// Joint angles of more than a turn are degrees.
pub(crate) fn radians(argument: &str, rows: &[[f64; 3]], drive: Drive) -> PyResult<()> {
    let beyond = |own: &f64| own.abs() > TAU && own.is_finite();
    // Looks at all, which takes a tenth of the time of a search.
    let any = rows
        .as_flattened()
        .iter()
        .map(beyond)
        .fold(false, BitOr::bitor);
    if drive == Drive::Linear || !any {
        return Ok(());
    }
    for (index, row) in rows.iter().enumerate() {
        if let Some(angle) = row.iter().find(|own| beyond(own)) {
            let cause = format!(
                "row {index} holds {angle}, more than a turn; angles are radians (numpy.deg2rad converts)"
            );
            return Err(value_error(argument, cause));
        }
    }
    Ok(())
}

/// Whether a joint is more than a degree or a millimetre outside the limits: encoder zeros differ.
pub(crate) fn outside(robot: &RobotFile, joints: &[f64; 3]) -> bool {
    let margin = match robot.limits.drive() {
        Drive::Rotary => 1f64.to_radians(),
        Drive::Linear => 1.0,
    };
    let (low, high) = (robot.limits.minimum(), robot.limits.maximum());
    joints
        .iter()
        .any(|own| *own < low - margin || *own > high + margin)
}

/// `WIDTH` numbers of this shape for each row, on all cores and without the interpreter's lock. A row that has none is
/// NaN, or with `raise` an error that names it.
pub(crate) fn each_row<'py, const WIDTH: usize, E: Display>(
    py: Python<'py>,
    argument: &str,
    rows: &Rows<'py>,
    each: &[usize],
    raise: bool,
    compute: impl Fn(&[f64; 3]) -> Result<[f64; WIDTH], E> + Sync,
) -> PyResult<Bound<'py, PyAny>> {
    let from = rows.get()?;
    let mut shape = vec![from.len()];
    shape.extend(each);
    let array = PyArrayDyn::<f64>::zeros(py, &shape[usize::from(rows.single)..], false);
    let mut values = array.readwrite();
    let (into, _) = values.as_slice_mut()?.as_chunks_mut::<WIDTH>();
    let fill = |(into, row): (&mut [f64; WIDTH], &[f64; 3])| {
        *into = compute(row).unwrap_or([f64::NAN; WIDTH]);
    };
    if from.len() > CHUNK {
        let pairs = into.par_iter_mut().with_min_len(CHUNK).zip(from);
        with_cores(py, || pairs.for_each(fill))?;
    } else {
        py.detach(|| into.iter_mut().zip(from).for_each(fill));
    }
    let is_nan = |row: &[f64; WIDTH]| row.iter().any(|value| value.is_nan());
    if raise && let Some(row) = into.iter().position(is_nan) {
        compute(&from[row])
            .map_err(|error| value_error(argument, format!("row {row}: {error}")))?;
    }
    drop(values);
    Ok(array.into_any())
}

/// Without the interpreter's lock, on threads of this process: those of a process that forked are not there in its
/// child.
pub(crate) fn with_cores<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let pool = cores()?;
    Ok(py.detach(|| pool.install(work)))
}

fn cores() -> PyResult<Arc<ThreadPool>> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let process = std::process::id();
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, own)) = pool.as_ref().filter(|(of, _)| *of == process) {
        return Ok(Arc::clone(own));
    }
    let new = ThreadPoolBuilder::new()
        .thread_name(|index| format!("delta-cal {index}"))
        .build()
        .map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    let new = Arc::new(new);
    // The pool of the parent process has no threads here that could be told to end.
    std::mem::forget(pool.replace((process, Arc::clone(&new))));
    Ok(new)
}

/// Whether it is a data frame: of pandas, polars, or what has their methods.
pub(crate) fn is_frame(given: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(given.hasattr("columns")? && (given.hasattr("to_csv")? || given.hasattr("write_csv")?))
}

/// Both write each number so that it reads back as the same.
pub(crate) fn frame_text(argument: &str, frame: &Bound<'_, PyAny>) -> PyResult<String> {
    let text = if frame.hasattr("to_csv")? {
        let arguments = PyDict::new(frame.py());
        arguments.set_item("index", false)?;
        frame.call_method("to_csv", (), Some(&arguments))
    } else {
        frame.call_method0("write_csv")
    };
    let text = text.and_then(|text| text.extract());
    text.map_err(|error| value_error(argument, error.value(frame.py())))
}

/// A frame as a table of this name.
pub(crate) fn as_table(argument: &str, frame: &Bound<'_, PyAny>) -> PyResult<InputText> {
    Ok(InputText::new(argument, &frame_text(argument, frame)?))
}

/// A digest in hexadecimal digits.
pub(crate) fn hexadecimal(digest: impl AsRef<[u8]>) -> String {
    let mut digits = String::with_capacity(64);
    for byte in digest.as_ref() {
        let _ = write!(digits, "{byte:02x}");
    }
    digits
}
