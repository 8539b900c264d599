//! Refusals and faults as Python exceptions.

use delta_cal_host::{CalibrateError, InputError};
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::fmt::Display;

pyo3::create_exception!(
    delta_cal,
    Refused,
    PyException,
    "These measurements cannot calibrate or judge this robot, which keeps its parameters.\n\n\
     `findings` is a list of dicts with the keys `level`, `kind`, `text` and `remedy`: the cause first, then what \
     would explain the samples as a whole."
);

/// What the command's messages call its options.
const WORDS: [(&str, &str); 14] = [
    (
        "state zero_deg in [tolerance], how many degrees",
        "state zero, how many radians",
    ),
    ("--frame sensor", "frame=\"sensor\""),
    ("--frame", "frame"),
    (
        "--method joint and ikm",
        "method=\"joint\" and method=\"ikm\"",
    ),
    ("--method fkm", "method=\"fkm\""),
    ("leave out --robust", "leave out robust"),
    ("--robust", "robust=True"),
    ("--measure", "measure"),
    ("--count", "count"),
    ("with --home", "with home"),
    ("with --for", "as target"),
    ("--positions", "positions"),
    ("--limit", "limit"),
    ("--bed", "bed"),
];

/// A message in the names of arguments.
pub(crate) fn in_python(text: impl Display) -> String {
    let mut text = text.to_string();
    for (command, argument) in WORDS {
        text = text.replace(command, argument);
    }
    text
}

/// An argument that cannot be used.
pub(crate) fn value_error(argument: &str, cause: impl Display) -> PyErr {
    PyValueError::new_err(format!("{argument}: {cause}"))
}

/// Cause and remedy of a fault in a file, a frame or an array. Rows of arrays and frames are counted from 0, lines of
/// files from 1.
pub(crate) fn input_error(error: &InputError, rows_of: Option<&str>) -> PyErr {
    let mut text = error.to_string();
    if let (Some(name), Some(line)) = (rows_of, error.line)
        && let Some(rest) = text.strip_prefix(&format!("{name}:{line}:"))
    {
        text = format!("{name}: row {}:{rest}", line.saturating_sub(2));
    } else if let Some(excerpt) = &error.excerpt {
        text = format!("{text}\n{excerpt}");
    }
    let remedy = error.remedy.as_ref().map(|own| format!("\n{own}"));
    PyValueError::new_err(in_python(text + &remedy.unwrap_or_default()))
}

/// A refusal is [`Refused`] with its findings; all else is a `ValueError`.
pub(crate) fn calibrate_error(
    py: Python<'_>,
    error: &CalibrateError,
    rows_of: Option<&str>,
) -> PyErr {
    match error {
        CalibrateError::Input(fault) => input_error(fault, rows_of),
        CalibrateError::Refused(refused) => {
            let mut findings = vec![(
                "refused",
                in_python(refused.as_ref()),
                in_python(refused.remedy()),
            )];
            let diagnosis = refused.diagnosis.as_ref();
            findings.extend(
                diagnosis.map(|own| ("diagnosis", in_python(own), in_python(own.remedy()))),
            );
            refusal(py, &findings)
        }
    }
}

/// Kind, cause and remedy of each finding.
pub(crate) fn refusal(py: Python<'_>, findings: &[(&str, String, String)]) -> PyErr {
    let lines = findings.iter().map(|(kind, text, _)| match *kind {
        "diagnosis" => format!("Explained by: {text}"),
        _ => text.clone(),
    });
    let mut message: Vec<String> = lines.collect();
    message.extend(findings.first().map(|(_, _, remedy)| remedy.clone()));
    let error = Refused::new_err(message.join("\n"));
    let with_findings = || -> PyResult<()> {
        let all = findings.iter().map(|(kind, text, remedy)| {
            let own = PyDict::new(py);
            own.set_item("level", "warning")?;
            own.set_item("kind", kind)?;
            own.set_item("text", text)?;
            own.set_item("remedy", remedy)?;
            Ok(own)
        });
        let all = all.collect::<PyResult<Vec<_>>>()?;
        error.value(py).setattr("findings", all)
    };
    match with_findings() {
        Ok(()) => error,
        Err(other) => other,
    }
}
