//! What is wrong with a request or its files.

use delta_cal_host::{CalibrateError, InputError};
use serde::Serialize;
use tsify::Tsify;

/// As the command says it on standard error.
#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Fault(Box<Details>);

#[derive(Debug, Default, Serialize, Tsify)]
struct Details {
    /// Whether the readings are refused, and not a file wrong.
    refused: bool,
    /// `file:line: cause`.
    message: String,
    file: Option<String>,
    line: Option<u64>,
    excerpt: Option<String>,
    diagnosis: Option<String>,
    remedy: Option<String>,
    /// The refusal for programs.
    json: Option<String>,
}

impl Fault {
    /// For a cause and what to do next.
    pub(crate) fn new(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        let mut fault = Self::of_request(cause);
        fault.0.remedy = Some(remedy.into());
        fault
    }

    /// Readings that cannot be used.
    pub(crate) fn refused(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        let mut fault = Self::new(cause, remedy);
        fault.0.refused = true;
        fault
    }

    /// A value of the page that cannot be read.
    pub(crate) fn of_request(cause: impl Into<String>) -> Self {
        Self(Box::new(Details {
            message: cause.into(),
            ..Details::default()
        }))
    }
}

impl From<InputError> for Fault {
    fn from(error: InputError) -> Self {
        Self(Box::new(Details {
            message: error.to_string(),
            file: Some(error.file.into()),
            line: error.line,
            excerpt: error.excerpt.map(Into::into),
            remedy: error.remedy.map(Into::into),
            ..Details::default()
        }))
    }
}

impl From<CalibrateError> for Fault {
    fn from(error: CalibrateError) -> Self {
        let json = error.refused().then(|| error.to_json());
        let diagnosis = error.diagnosis().map(ToString::to_string);
        let mut fault = match error {
            CalibrateError::Input(error) => error.into(),
            CalibrateError::Refused(own) => Self::refused(own.to_string(), own.remedy()),
        };
        (fault.0.json, fault.0.diagnosis) = (json, diagnosis);
        fault
    }
}
