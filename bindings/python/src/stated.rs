//! Words that stand for one of several values.

use crate::errors::value_error;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;

pub(crate) const FRAMES: &str = "\"base\" or \"sensor\"";
pub(crate) const METHODS: &str = "\"joint\", \"ikm\" or \"fkm\"";

/// One of some words.
pub(crate) fn word<T: DeserializeOwned>(argument: &str, given: &str, all: &str) -> PyResult<T> {
    let found = serde_json::from_value(given.into());
    found.map_err(|_| value_error(argument, format!("{given:?}; {all} is needed")))
}
