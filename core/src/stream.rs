//! Samples that come one by one for as long as the robot works: a [`Gate`] that rejects wrong ones before
//! they are taken in, and [`Forgetting`] for a robot that changes. [`StreamCalibrator`] combines them with either
//! estimator, as a controller needs it.

mod calibrator;
mod forgetting;
mod gate;
mod options;

pub use calibrator::StreamCalibrator;
pub use forgetting::{Forgetting, ForgettingError};
pub use gate::{Alarm, Gate, GateCounts, GateError, Innovation, Untested, Verdict};
pub use options::{
    AddError, Added, Estimator, Selection, StreamOptions, StreamOutcome, StreamRefusal,
};
