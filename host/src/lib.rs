//! Calibrates a Delta robot from files: the command `delta-cal`, its reports, and the link to a controller. What is
//! computed is in `delta-cal-compute`, whose items are here under the same names.
//!
//! Each folder uses only those above it in this list, and those of `delta-cal-compute`:
//!
//! ```text
//! render       figures, pages, the terminal
//! report       results for people and for programs
//! device       a controller that calibrates itself, over its link
//! reproduce    the paper's simulations, run again
//! cli          the command `delta-cal`: arguments, help, exit codes, progress
//! ```
//!
//! A calibration of two files, as `calibrate()` gives it, for people and for programs:
//!
//! ```text
//! CalibrationReport ─→ report::calibration::{table, json, html}
//! ```
//!
//! Lengths are millimetres and angles radians; only the files and reports are in degrees.
//!
//! ```
//! use delta_cal_host::{Options, calibrate};
//! use delta_cal_host::files::example;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (robot, samples) = example::load()?;
//! let report = calibrate(&robot, &samples, Options::default())?;
//! assert!(report.error_after.rms < 0.1 * report.error_before.rms);
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]

pub mod cli;
pub mod device;
pub mod render;
pub mod report;
pub mod reproduce;

pub use delta_cal_compute::*;
