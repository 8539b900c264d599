//! Refusals, faults and wrong words as Python exceptions. `delta_cal/_errors.py` finds the words.

use crate::files::call_python;
use delta_cal_host::{CalibrateError, InputError};
use pyo3::call::PyCallArgs;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use std::fmt::Display;

pub(crate) const FRAMES: &str = "\"base\" or \"sensor\"";
pub(crate) const METHODS: &str = "\"joint\", \"ikm\" or \"fkm\"";

/// A message in the names of arguments; of arrays, which have rows in place of lines.
pub(crate) fn words(text: impl Display, in_arrays: bool) -> String {
    let text = text.to_string();
    let found = Python::attach(|py| {
        call_python(py, "_errors", "words", (text.as_str(), in_arrays))?.extract()
    });
    found.unwrap_or(text)
}

/// A message in the names of arguments.
pub(crate) fn in_python(text: impl Display) -> String {
    words(text, false)
}

/// An argument that cannot be used.
pub(crate) fn value_error(argument: &str, cause: impl Display) -> PyErr {
    PyValueError::new_err(format!("{argument}: {cause}"))
}

/// One of some words.
pub(crate) fn word<T: DeserializeOwned>(argument: &str, given: &str, all: &str) -> PyResult<T> {
    let found = serde_json::from_value(given.into());
    found.map_err(|_| value_error(argument, format!("{given:?}; {all} is needed")))
}

/// An exception that is made in Python.
fn exception(name: &str, arguments: impl for<'py> PyCallArgs<'py>) -> PyErr {
    Python::attach(|py| {
        let error = call_python(py, "_errors", name, arguments);
        error.map_or_else(|other| other, PyErr::from_value)
    })
}

/// Cause and remedy of a fault in a file, a frame or an array; `arrays`: their name, if not all are files.
pub(crate) fn input_error(error: &InputError, arrays: Option<&str>) -> PyErr {
    let (excerpt, remedy) = (error.excerpt.as_deref(), error.remedy.as_deref());
    let place = (&*error.file, error.line, excerpt, remedy);
    exception("fault", (error.to_string(), place, arrays))
}

/// A refusal is `Refused` with its findings; all else is a `ValueError`.
pub(crate) fn calibrate_error(error: &CalibrateError, arrays: Option<&str>) -> PyErr {
    let refused = match error {
        CalibrateError::Input(fault) => return input_error(fault, arrays),
        CalibrateError::Refused(refused) => refused,
    };
    let mut findings = vec![("refused", refused.to_string(), refused.remedy())];
    if let Some(own) = &refused.diagnosis {
        findings.push(("diagnosis", own.to_string(), own.remedy().clone()));
    }
    refusal(findings, arrays.is_some())
}

/// Kind, cause and remedy of each finding.
pub(crate) fn refusal(findings: Vec<(&str, String, String)>, in_arrays: bool) -> PyErr {
    exception("refused", (findings, in_arrays))
}
