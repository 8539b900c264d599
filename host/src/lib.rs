//! Calibrates Delta robots from files: robots, measurements, calibrations, plans, campaigns and workspaces. The
//! mathematics is the core's, `delta-cal`; this crate reads, judges, compares and shows.
//!
//! Lengths are millimetres and angles radians; only the files and reports are in degrees.
//!
//! ```
//! use delta_cal_host::{Options, calibrate};
//! use delta_cal_host::files::example;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (robot, readings) = example::load()?;
//! let report = calibrate(&robot, &readings, &Options::default())?;
//! println!("{}", report.to_text());
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]
// Options are passed on as the public functions take them.
#![allow(clippy::trivially_copy_pass_by_ref)]
// Counts, lines and steps are far below 2⁵³.
#![allow(clippy::cast_precision_loss)]
// In tests a panic is the failure.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod accuracy;
pub mod calibration;
pub mod campaign;
#[cfg(feature = "cli")]
pub mod cli;
mod cores;
#[cfg(feature = "device")]
pub mod device;
pub mod effects;
pub mod explain;
pub mod export;
pub mod files;
pub mod finding;
pub mod fit;
pub mod geometry;
pub mod halt;
pub mod import;
pub mod judge;
mod order;
pub mod planning;
pub mod printer;
pub mod render;
pub mod report;
pub mod text;
pub mod validation;
pub mod workspace;

pub use accuracy::improvement::WorkspaceComparison;
pub use accuracy::position_error::PositionError;
pub use accuracy::uncertainty::ExpectedError;
pub use calibration::{CalibrateError, Refused, Report, calibrate, read_samples};
pub use files::columns::ColumnMapping;
pub use files::input::{InputError, InputText};
pub use files::robot_file::{InstrumentFacts, Record, RobotFile};
pub use files::samples_file::{
    Planned, Reading, ReadingFrom, Readings, Row, read_joints, read_positions,
};
pub use finding::{Finding, Level};
pub use fit::{Frame, Method, Options, Solution};
pub use planning::{Plan, PlanRequest, plan};
pub use validation::validate;
