//! The files of a printer's configuration.

use crate::errors::{input_error, value_error};
use crate::files::call_python;
use delta_cal_host::import::{Firmware, Stated};
use delta_cal_host::{InputError, InputText};
use pyo3::prelude::*;

/// Name and bytes of a file.
pub(crate) type Part = (String, Vec<u8>);

/// A configuration, whose firmware it is, and what is stated beside it: arguments, which `delta_cal/_stated.py` prepares, as
/// JSON.
pub(crate) fn configuration(
    (name, bytes): Part,
    firmware: Option<&str>,
    stated: &str,
) -> PyResult<(InputText, Firmware, Stated)> {
    let fault = |error| input_error(&error, None);
    let text = InputText::from_bytes(name, &bytes).map_err(fault)?;
    let firmware = match firmware {
        None => Firmware::of(&text).map_err(fault)?,
        Some(name) => Firmware::named(name).ok_or_else(|| {
            let names = Firmware::ALL.map(Firmware::name).join(", ");
            value_error("firmware", format!("one of {names} is needed"))
        })?,
    };
    let stated = serde_json::from_str(stated).map_err(|error| value_error("printer", error))?;
    Ok((text, firmware, stated))
}

/// The files that a line of a configuration includes, beside the file with the line.
pub(crate) fn included(from: &str, wanted: &str) -> Result<Vec<InputText>, InputError> {
    let found = Python::attach(|py| -> PyResult<Vec<Part>> {
        call_python(py, "_pages", "included", (from, wanted))?.extract()
    });
    let found = found.map_err(|error| InputError::new(from, error.to_string()))?;
    let read = |(name, bytes): Part| InputText::from_bytes(name, &bytes);
    found.into_iter().map(read).collect()
}
