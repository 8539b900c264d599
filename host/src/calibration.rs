//! From readings to a good calibration, or to the reasons why there is none.
//!
//! ```text
//! RobotFile, Readings, Options ─→ fit::solve ─→ Solution ─→ judge ─→ Judged ─→ findings ─→ Report
//!                                                   └→ Objection ─→ refusal, with what explains it
//! and, whatever comes of it, diagnose ─→ Diagnosis
//! ```

mod calibrate;
pub mod causes;
pub mod credibility;
pub mod diagnosis;
pub mod findings;
pub(crate) mod judge;
pub mod known;
mod one_number;
pub mod refusal;
pub mod report;
pub mod step;
pub mod wrong_rows;

pub use calibrate::{calibrate, read_samples};
pub use findings::{Finding, Level};
pub use refusal::{CalibrateError, Refused};
pub use report::Report;
