//! Why there is no calibration.

use super::diagnosis::Diagnosis;
use super::reason::Reason;
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
        self.reason.remedy()
    }

    /// The measurements cannot calibrate this robot.
    pub fn refused(&self) -> bool {
        matches!(self.reason, Reason::Refused(_))
    }
}

impl fmt::Display for CalibrateError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.reason.fmt(formatter)
    }
}

impl Error for CalibrateError {}

impl<R: Into<Reason>> From<R> for CalibrateError {
    fn from(reason: R) -> Self {
        Self::new(reason, None)
    }
}
