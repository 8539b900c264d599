//! Why there is no calibration.

use crate::files::input_error::InputError;
use crate::fit::options::OptionsError;
use std::error::Error;
use std::fmt;

/// A calibration that is refused: the robot keeps its parameters. Displayed as one line.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    pub(in crate::calibration) cause: String,
    pub(in crate::calibration) remedy: String,
}

impl fmt::Display for Refused {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.cause)
    }
}

impl Error for Refused {}

impl Refused {
    /// For this cause, with what to do next.
    pub(crate) fn new(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            cause: cause.into(),
            remedy: remedy.into(),
        }
    }

    /// What to do next.
    pub fn remedy(&self) -> &str {
        &self.remedy
    }
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

impl fmt::Display for Reason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Options(error) => error.fmt(formatter),
            Self::Input(error) => error.fmt(formatter),
            Self::Refused(refused) => refused.fmt(formatter),
        }
    }
}

impl Reason {
    /// What to do next.
    pub(super) fn remedy(&self) -> Option<String> {
        match self {
            Self::Options(error) => Some(error.remedy().to_owned()),
            Self::Input(error) => error.remedy().map(str::to_owned),
            Self::Refused(refused) => Some(refused.remedy().to_owned()),
        }
    }
}

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
