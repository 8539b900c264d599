//! The files of a printer's configuration.

use crate::errors::{input_error, value_error};
use crate::files::{bytes_of, call_python};
use delta_cal_host::import::{Firmware, Stated};
use delta_cal_host::{InputError, InputText};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A configuration, whose firmware it is, and what is stated beside it.
pub(crate) fn configuration(
    path: &Bound<'_, PyAny>,
    firmware: Option<&str>,
    stated: &Bound<'_, PyDict>,
) -> PyResult<(InputText, Firmware, Stated)> {
    let (name, bytes) = bytes_of(path)?;
    let fault = |error| input_error(&error, false);
    let text = InputText::from_bytes(name, &bytes).map_err(fault)?;
    let firmware = match firmware {
        None => Firmware::of(&text).map_err(fault)?,
        Some(name) => Firmware::named(name).ok_or_else(|| {
            let names = Firmware::ALL.map(Firmware::name).join(", ");
            value_error("firmware", format!("one of {names} is needed"))
        })?,
    };
    let mut own = Stated::default();
    for (name, value) in stated.iter() {
        let name: String = name.extract()?;
        let fault = |_| PyTypeError::new_err(format!("{name}: lengths in mm are needed"));
        match name.as_str() {
            "rods" => own.rods = Some(value.extract().map_err(fault)?),
            "radius" => own.radius = Some(value.extract().map_err(fault)?),
            "rods_sigma" => own.rods_sigma = Some(value.extract().map_err(fault)?),
            "radius_sigma" => own.radius_sigma = Some(value.extract().map_err(fault)?),
            "printed" => own.printed = value.extract().map_err(fault)?,
            "shrinkage" => own.shrinkage = Some(value.extract().map_err(fault)?),
            _ => {
                let cause = format!("{name}: not stated of a printer");
                return Err(PyTypeError::new_err(cause));
            }
        }
    }
    Ok((text, firmware, own))
}

/// The files that a line of a configuration includes, beside the file with the line.
pub(crate) fn included(from: &str, wanted: &str) -> Result<Vec<InputText>, InputError> {
    let found = Python::attach(|py| -> PyResult<Vec<(String, Vec<u8>)>> {
        call_python(py, "_pages", "included", (from, wanted))?.extract()
    });
    let found = found.map_err(|error| InputError::new(from, error.to_string()))?;
    let read = |(name, bytes): (String, Vec<u8>)| InputText::from_bytes(name, &bytes);
    found.into_iter().map(read).collect()
}
