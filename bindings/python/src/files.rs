//! What Python's own modules do.

use delta_cal_host::InputText;
use pyo3::call::PyCallArgs;
use pyo3::prelude::*;

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
