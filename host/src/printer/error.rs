//! Why a printer cannot be assessed.

use crate::calibration::CalibrateError;
use crate::export::error::ExportError;

/// Why a printer cannot be assessed.
#[derive(Debug)]
pub enum AssessError {
    /// The files made of the configuration are wrong.
    Calibrate(Box<CalibrateError>),
    /// The measurements contradict every robot within the tolerance.
    Unexplained {
        /// Which, and by how much.
        cause: String,
        /// What to do next.
        remedy: String,
    },
    /// Klipper's parameters cannot be fitted.
    Export(ExportError),
}

impl From<CalibrateError> for AssessError {
    fn from(error: CalibrateError) -> Self {
        Self::Calibrate(Box::new(error))
    }
}

impl From<ExportError> for AssessError {
    fn from(error: ExportError) -> Self {
        Self::Export(error)
    }
}
