//! Why there is no calibration.

use super::diagnosis::Diagnosis;
use super::refusal::Refused;
use crate::files::input_error::InputError;
use crate::fit::options::OptionsError;
use std::error::Error;
use std::fmt;

/// Why there is no calibration, and what would explain the samples as a whole. Displayed as the
/// reason, in one line.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrateError {
    /// The reason.
    pub reason: Reason,
    /// What would explain the samples as a whole, if anything does.
    pub diagnosis: Option<Box<Diagnosis>>,
}

/// Why there is no calibration.
#[derive(Debug, Clone, PartialEq)]
pub enum Reason {
    /// The options exclude each other.
    Options(OptionsError),
    /// Something in an input file cannot be used.
    Input(InputError),
    /// The measurements cannot calibrate this robot.
    Refused(Refused),
}

impl CalibrateError {
    pub(crate) fn new(reason: impl Into<Reason>, diagnosis: Option<Diagnosis>) -> Self {
        Self {
            reason: reason.into(),
            diagnosis: diagnosis.map(Box::new),
        }
    }

    /// What to do next. A diagnosis says it better than the general advice of a reason.
    pub fn remedy(&self) -> Option<String> {
        if let Some(diagnosis) = &self.diagnosis {
            return Some(diagnosis.remedy());
        }
        match &self.reason {
            Reason::Options(error) => Some(error.remedy().to_owned()),
            Reason::Input(error) => error.remedy().map(str::to_owned),
            Reason::Refused(refused) => Some(refused.remedy().to_owned()),
        }
    }

    /// The measurements cannot calibrate this robot.
    pub fn refused(&self) -> bool {
        matches!(self.reason, Reason::Refused(_))
    }
}

impl fmt::Display for CalibrateError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.reason {
            Reason::Options(error) => error.fmt(formatter),
            Reason::Input(error) => error.fmt(formatter),
            Reason::Refused(refused) => refused.fmt(formatter),
        }
    }
}

impl Error for CalibrateError {}

impl From<OptionsError> for Reason {
    fn from(error: OptionsError) -> Self {
        Self::Options(error)
    }
}

impl From<InputError> for Reason {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

impl From<Refused> for Reason {
    fn from(refused: Refused) -> Self {
        Self::Refused(refused)
    }
}

impl<R: Into<Reason>> From<R> for CalibrateError {
    fn from(reason: R) -> Self {
        Self::new(reason, None)
    }
}
