//! Samples that come one by one for as long as the robot works: a [`Gate`] that rejects wrong ones before
//! they are taken in, and [`Forgetting`] for a robot that changes. [`StreamCalibrator`] combines them with either
//! estimator, as a controller needs it.

mod forgetting;
mod gate;
mod stream_calibrator;
mod stream_options;
mod stream_outcome;
mod stream_refusal;

pub use forgetting::{Forgetting, ForgettingError};
pub use gate::{Alarm, Gate, GateCounts, GateError, Innovation, Untested, Verdict};
pub use stream_calibrator::StreamCalibrator;
pub use stream_options::{Estimator, Selection, StreamOptions};
pub use stream_outcome::{AddError, Added, StreamOutcome};
pub use stream_refusal::StreamRefusal;
