//! A calibration that is refused.

use std::error::Error;
use std::fmt;

/// A calibration that is refused: the robot keeps its parameters. Displayed as one line.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    pub(super) cause: String,
    pub(super) remedy: String,
}

impl fmt::Display for Refused {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.cause)
    }
}

impl Error for Refused {}

impl Refused {
    /// What to do next.
    pub fn remedy(&self) -> &str {
        &self.remedy
    }
}
