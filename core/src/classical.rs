//! The classical form of the IKM method: every sample is stored, and the Jacobian (3.21) is built row by
//! row. It is what the constant-memory form is tested and measured against; a robot needs neither its
//! memory nor its time.

mod calibrator;
mod row_by_row;
mod samples;

pub use calibrator::StoredCalibrator;
pub use samples::{StoredArmSamples, StoredError};
