//! The files of a printer's configuration.

use crate::errors::{input_error, length, type_error, value_error};
use crate::files::{bytes_of, call_python};
use delta_cal_host::import::{Firmware, Stated};
use delta_cal_host::{InputError, InputText};
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
        Some(name) => {
            let mut all = Firmware::ALL.into_iter();
            all.find(|own| own.name() == name).ok_or_else(|| {
                let names = Firmware::ALL.map(Firmware::name).join(", ");
                value_error("firmware", format!("one of {names} is needed"))
            })?
        }
    };
    let mut own = Stated::default();
    for (name, value) in stated.iter() {
        let name: String = name.extract()?;
        let fault = |_| type_error(&name, "numbers are needed, lengths in mm");
        let number = || length(&name, value.extract().map_err(fault)?);
        match name.as_str() {
            "rods" => {
                let rods: [f64; 3] = value.extract().map_err(fault)?;
                rods.into_iter()
                    .try_for_each(|rod| length(&name, rod).map(drop))?;
                own.rods = Some(rods);
            }
            "radius" => own.radius = Some(number()?),
            "rods_sigma" => own.rods_sigma = Some(number()?),
            "radius_sigma" => own.radius_sigma = Some(number()?),
            "printed" => {
                let pairs: Vec<[f64; 2]> = value.extract().map_err(fault)?;
                let nearly = |[wanted, is]: &[f64; 2]| (is / wanted - 1.0).abs() < 0.1;
                if !pairs.iter().all(nearly) {
                    let cause = "lengths as designed and as printed, within 10 %, are needed";
                    return Err(value_error(&name, cause));
                }
                own.printed = pairs;
            }
            "shrinkage" => {
                let part: f64 = value.extract().map_err(fault)?;
                if !(part.abs() <= 0.1) {
                    let cause = format!("{part}; a fraction of up to 0.1 is needed");
                    return Err(value_error(&name, cause));
                }
                own.shrinkage = Some(part);
            }
            _ => {
                return Err(type_error(&name, "not stated of a printer"));
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
