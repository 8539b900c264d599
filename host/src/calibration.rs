//! From two files to a calibration that is good, or to the reasons why it is not.
//!
//! ```text
//! RobotFile, SamplesFile, Options ─→ Case ─→ attempt: fit ─→ noise, causes ─→ judge ─→ CalibrationReport
//!                                               └→ Objection ─→ investigate ─→ Explainer ─→ Reason
//! and, whatever comes of it, diagnose ─→ Diagnosis
//! ```

mod advice;
mod attempt;
mod calibrate;
pub mod case;
pub mod causes;
pub mod diagnosis;
pub mod error;
mod every_sample;
mod investigation;
mod judgement;
pub mod noise_test;
mod objection;
pub mod observations;
mod outliers;
mod plausibility;
pub mod prior_test;
pub mod reason;
mod refusal;
pub mod report;
pub mod shift;
mod target;
pub mod thresholds;
mod warnings;

pub use calibrate::{Accepted, accepted, calibrate, for_transmissions, read_samples};
pub use calibrate::{Elsewhere, calibrated_elsewhere};
