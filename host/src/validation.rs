//! Whether a calibration still holds: a robot file against independent measurements.
//!
//! ```text
//! RobotFile, SamplesFile, Request ─→ deviations ─→ rms and largest error with their intervals ─→ verdict
//! ```

mod deviations;
mod interval;
mod validate;

pub use interval::{Bounded, RmsError, Verdict};
pub use validate::{Deviation, Request, Validation, check_independent, validate};
