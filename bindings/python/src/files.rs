//! What Python's own modules do: JSON and files.

use crate::errors::type_error;
use delta_cal_host::InputText;
use pyo3::call::PyCallArgs;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// What is written in Python.
pub(crate) fn call_python<'py, A: PyCallArgs<'py>>(
    py: Python<'py>,
    module: &str,
    name: &str,
    arguments: A,
) -> PyResult<Bound<'py, PyAny>> {
    py.import(format!("delta_cal.{module}"))?
        .call_method1(name, arguments)
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

fn path_of<'py>(path: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = path.py();
    let found = py.import("pathlib")?.call_method1("Path", (path,));
    found.map_err(|error| type_error("path", error.value(py)))
}

/// The bytes of a file; an error has its path and number.
pub(crate) fn bytes_of(path: &Bound<'_, PyAny>) -> PyResult<(String, Vec<u8>)> {
    let path = path_of(path)?;
    Ok((
        path.str()?.to_string(),
        path.call_method0("read_bytes")?.extract()?,
    ))
}

/// SHA-256, 64 hexadecimal digits.
pub(crate) fn sha256(text: &str) -> String {
    InputText::new("", text).sha256().to_owned()
}

/// The fields of a result.
macro_rules! dict {
    ($py:expr, $($name:literal: $value:expr),+ $(,)?) => {{
        let dict = pyo3::types::PyDict::new($py);
        $(dict.set_item($name, $value)?;)+
        dict
    }};
}

pub(crate) use dict;

/// Writes a text; an error has its path and number.
pub(crate) fn write(path: &Bound<'_, PyAny>, text: &str) -> PyResult<()> {
    let path = path_of(path)?;
    path.call_method1("write_bytes", (PyBytes::new(path.py(), text.as_bytes()),))?;
    Ok(())
}
