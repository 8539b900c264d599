//! Whether a calibration still holds: a robot file against independent measurements.
//!
//! ```text
//! RobotFile, SamplesFile, Request ─→ deviations ─→ rms and largest error with their limits ─→ verdict
//! ```

mod deviations;
mod interval;
mod largest;
mod validate;
mod verdict;

pub use interval::{Bounded, RmsError};
pub use validate::{Deviation, Request, Validation, check_independent, validate};
pub use verdict::Verdict;
