//! Continuous streams of samples: a gate that rejects wrong ones before they are added, and [`Forgetting`] for a robot
//! that changes. [`StreamCalibrator`] combines them with either estimator.

mod calibrator;
mod gate;
mod options;

pub use crate::samples::Forgetting;
pub use calibrator::StreamCalibrator;
pub(crate) use gate::Gate;
pub use gate::{GateCounts, Innovation, Verdict};
pub use options::Selection;
