//! The files of a printer's configuration.

use crate::errors::{input_error, type_error, value_error};
use crate::files::bytes_of;
use delta_cal_host::import::{Firmware, Stated};
use delta_cal_host::{InputError, InputText};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};

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
        let fault = |_| type_error(&name, "lengths in mm are needed");
        match name.as_str() {
            "rods" => own.rods = Some(value.extract().map_err(fault)?),
            "radius" => own.radius = Some(value.extract().map_err(fault)?),
            "rods_sigma" => own.rods_sigma = Some(value.extract().map_err(fault)?),
            "radius_sigma" => own.radius_sigma = Some(value.extract().map_err(fault)?),
            "printed" => own.printed = value.extract().map_err(fault)?,
            "shrinkage" => own.shrinkage = Some(value.extract().map_err(fault)?),
            _ => return Err(type_error(&name, "not stated of a printer")),
        }
    }
    Ok((text, firmware, own))
}

/// The files that a line of a configuration includes, beside the file with the line.
pub(crate) fn included(from: &str, wanted: &str) -> Result<Vec<InputText>, InputError> {
    let found = |py: Python<'_>| -> PyResult<Vec<PathBuf>> {
        let folder = PathBuf::from(from);
        let folder = folder.parent().unwrap_or(Path::new(""));
        let literal = folder.join(wanted);
        if literal.is_file() {
            return Ok(vec![literal]);
        }
        let glob = py.import("glob")?;
        let folder = glob.call_method1("escape", (folder.display().to_string(),))?;
        let pattern = PathBuf::from(folder.extract::<String>()?).join(wanted);
        let found = glob.call_method1("glob", (pattern.display().to_string(),))?;
        let mut paths: Vec<PathBuf> = found.extract()?;
        paths.sort();
        Ok(paths)
    };
    let paths = Python::attach(found);
    let paths = paths.map_err(|error| InputError::new(from, error.to_string()))?;
    let files = paths.iter().filter(|path| path.is_file());
    let read = |path: &PathBuf| {
        let name = path.display().to_string();
        let bytes = std::fs::read(path);
        let bytes = bytes.map_err(|error| InputError::new(&name, error.to_string()))?;
        InputText::from_bytes(name, &bytes)
    };
    files.map(read).collect()
}
