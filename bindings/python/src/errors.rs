//! Refusals and faults as Python exceptions.

use delta_cal_host::{CalibrateError, InputError};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::fmt::Display;

/// What the command's messages call its options, where an argument is not called the same.
const WORDS: [(&str, &str); 10] = [
    (
        "`delta-cal init --output -` prints a robot file with every key (with towers, add --kind linear)",
        "docs/instruments.md lists all keys",
    ),
    (
        "state zero_deg in [tolerance], how many degrees",
        "state zero, how many radians",
    ),
    ("--frame sensor", "frame=\"sensor\""),
    (
        "--method joint and ikm",
        "method=\"joint\" and method=\"ikm\"",
    ),
    ("--method fkm", "method=\"fkm\""),
    ("leave out --robust", "leave out robust"),
    ("--robust", "robust=True"),
    ("with --for", "as target"),
    ("in a column target", "in target"),
    (
        "name its contents with --columns",
        "read_samples takes columns",
    ),
];

/// A message in the names of arguments; a command in it stays one.
pub(crate) fn in_python(text: impl Display) -> String {
    let replaced =
        |text: String, (command, argument): &(&str, &str)| text.replace(command, argument);
    let text = WORDS.iter().fold(text.to_string(), replaced);
    let mut parts = text.split("--");
    let mut found = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let option = part.starts_with(|own: char| own.is_ascii_lowercase());
        let command = found
            .rsplit('`')
            .next()
            .is_some_and(|own| own.starts_with("delta-cal"));
        found += if option && !command { "" } else { "--" };
        found += part;
    }
    found
}

/// An argument that cannot be used.
pub(crate) fn value_error(argument: &str, cause: impl Display) -> PyErr {
    PyValueError::new_err(format!("{argument}: {cause}"))
}

/// A message of arrays, which have rows in place of lines, no names of columns, and are in no file.
pub(crate) fn in_rows(text: &str) -> String {
    if text.starts_with("Name the columns of ") {
        return "Convert the arrays: they are in millimetres and radians.".to_owned();
    }
    let words = [
        (". No file was changed", ""),
        (", but the header says millimetres", ""),
        // Headers stand at the right.
        ("in line\n", " in row\n"),
        ("Line ", "Row "),
        ("line ", "row "),
        ("Lines ", "Rows "),
        ("lines ", "rows "),
    ];
    words
        .iter()
        .fold(text.to_owned(), |text, (line, row)| text.replace(line, row))
}

/// Cause and remedy of a fault in a file, a frame or an array; `arrays`: their name, if not all are files.
pub(crate) fn input_error(error: &InputError, arrays: Option<&str>) -> PyErr {
    let mut text = error.to_string();
    if let (Some(arrays), Some(line)) = (arrays, error.line) {
        let name = &error.file;
        // A robot beside arrays is no file that anybody has.
        let place = if **name == *arrays {
            format!("{name}: row {line}:")
        } else {
            "robot:".to_owned()
        };
        text = in_rows(&text.replacen(&format!("{name}:{line}:"), &place, 1));
    } else if let Some(excerpt) = &error.excerpt {
        text = format!("{text}\n{excerpt}");
    }
    let remedy = error.remedy.as_ref().map(|own| format!("\n{own}"));
    PyValueError::new_err(in_python(text + &remedy.unwrap_or_default()))
}

/// A refusal is `Refused` with its findings; all else is a `ValueError`.
pub(crate) fn calibrate_error(
    py: Python<'_>,
    error: &CalibrateError,
    arrays: Option<&str>,
) -> PyErr {
    let refused = match error {
        CalibrateError::Input(fault) => return input_error(fault, arrays),
        CalibrateError::Refused(refused) => refused,
    };
    let words = |text: String| {
        let text = in_python(text);
        if arrays.is_some() {
            in_rows(&text)
        } else {
            text
        }
    };
    let own = (
        "refused",
        words(refused.to_string()),
        words(refused.remedy()),
    );
    let diagnosis = refused.diagnosis.as_ref();
    let diagnosis = diagnosis.map(|own| {
        let remedy = own.remedy().clone();
        ("diagnosis", words(own.to_string()), words(remedy))
    });
    let findings: Vec<_> = std::iter::once(own).chain(diagnosis).collect();
    refusal(py, findings)
}

/// Kind, cause and remedy of each finding.
pub(crate) fn refusal(py: Python<'_>, findings: Vec<(&str, String, String)>) -> PyErr {
    let module = py.import("delta_cal._errors");
    let error = module.and_then(|own| own.call_method1("refused", (findings,)));
    error.map_or_else(|other| other, PyErr::from_value)
}
