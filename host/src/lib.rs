//! Calibrates a Delta robot from files. The mathematics is the core's, `delta-cal`; this crate
//! reads, judges, reports and writes.
//!
//! The modules follow the data:
//!
//! ```text
//! InputText ─→ RobotFile  ─┐
//! InputText ─→ SamplesFile ┴→ calibrate() ─→ CalibrationReport ─→ report::table, json, html
//!                                  │                          └→ RobotFile::to_toml
//!                                  └→ CalibrateError: InputError or Refused
//! InputText ─→ read_joints / read_positions ─→ kinematics ─→ CSV
//! Robot, Samples, Settings ─→ fkm::calibrate ─→ Outcome ─→ evaluation, where the truth is known
//! InputText ─→ campaign::Plan ─→ campaign::run ─→ CSV, CaseSummary ─→ reproduce: the paper beside it
//! RobotFile ─→ poses::plan ─→ PosePlan;  with SamplesFile ─→ Observability ─→ report::check
//! RobotFile, SamplesFile ─→ device: a controller calibrates ─→ CalibrationReport
//! RobotFile ─→ workspace::report::Analysis ─→ table, JSON, CSV, STL, HTML
//! plot::Figure ─→ SVG, PNG; report::html
//! texts ─→ output::write_all
//! ```
//!
//! Lengths are millimetres and angles radians; only the files and reports are in degrees.
//!
//! ```
//! use delta_cal_host::{Options, calibrate, example};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (robot, samples) = example::load()?;
//! let report = calibrate(&robot, &samples, Options::default())?;
//! assert!(report.error_after.rms < 0.1 * report.error_before.rms);
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]

mod calibrate;
mod calibration_report;
pub mod campaign;
pub mod device;
mod diagnosis;
pub mod evaluation;
pub mod example;
pub mod fkm;
mod information;
mod input_error;
mod input_text;
pub mod kinematics;
mod noise_test;
pub mod observability;
mod outcome;
mod outliers;
pub mod output;
mod plausibility;
pub mod plot;
pub mod poses;
mod position_error;
pub mod position_uncertainty;
pub mod reach;
mod refusal;
pub mod report;
pub mod reproduce;
mod robot_file;
mod robust;
mod samples_file;
mod sensor_frame;
mod stream;
mod units;
mod warnings;
mod words;
pub mod workspace;
mod workspace_comparison;

pub use calibrate::{CalibrateError, CalibrationMethod, Frame, Options, calibrate};
pub use calibration_report::CalibrationReport;
pub use diagnosis::{Diagnosis, DiagnosisEvidence, Explanation};
pub use input_error::InputError;
pub use input_text::InputText;
pub use noise_test::{Estimate, NoiseTest, NoiseVerdict, StatedNoise};
pub use outcome::Outcome;
pub use position_error::{PositionError, SampleErrors};
pub use refusal::Refused;
pub use robot_file::RobotFile;
pub use robust::{RobustFit, SampleWeight, calibrate_robust};
pub use samples_file::{Row, SamplesFile, read_joints, read_positions};
pub use stream::{GateReport, RejectedSample, StreamReport, Streaming};
pub use workspace_comparison::WorkspaceComparison;
