//! From readings to a good calibration, or to the reasons why there is none.
//!
//! ```text
//! RobotFile, Readings, Options ─→ explain ─→ fit ─→ Solution ─→ judge ─→ Judged ─→ findings ─→ Report
//!                                                                  └→ Objection ─→ refusal, with the diagnosis
//! ```

mod calibrate;
mod findings;
pub mod refusal;
pub mod report;
mod tilt;

pub use calibrate::{calibrate, read_samples};
pub use refusal::{CalibrateError, Refused};
pub use report::Report;
pub(crate) use tilt::{NAMED, unused_rotations};
