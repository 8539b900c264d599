//! Samples that come one by one for as long as the robot works: a gate that rejects wrong ones before
//! they are taken in, and [`Forgetting`] for a robot that changes. [`StreamCalibrator`] puts them in front of either
//! estimator.

mod calibrator;
mod gate;
mod options;

pub use crate::samples::{AddError, Forgetting, ForgettingError};
pub use calibrator::StreamCalibrator;
pub use gate::{Alarm, GateCounts, GateError, Innovation, Untested, Verdict};
pub use options::{Added, Selection, StreamRefusal};
