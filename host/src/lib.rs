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

pub mod accuracy;
pub mod calibration;
pub mod campaign;
pub mod device;
pub mod files;
pub mod fit;
pub mod geometry;
pub mod planning;
pub mod render;
pub mod report;
pub mod reproduce;
mod text;
pub mod workspace;

pub use accuracy::position_error::{PositionError, SampleErrors};
pub use accuracy::workspace_comparison::WorkspaceComparison;
pub use calibration::diagnosis::{Diagnosis, DiagnosisEvidence, Explanation};
pub use calibration::error::{CalibrateError, Reason};
pub use calibration::noise_test::{Estimate, NoiseTest, NoiseVerdict, StatedNoise};
pub use calibration::refusal::Refused;
pub use calibration::report::CalibrationReport;
pub use calibration::{calibrate, read_samples};
pub use files::input_error::InputError;
pub use files::input_text::InputText;
pub use files::robot_file::RobotFile;
pub use files::samples_file::{Row, SamplesFile, read_joints, read_positions};
pub use fit::options::{CalibrationMethod, Frame, Options, OptionsError, Streaming};
pub use fit::outcome::Outcome;
pub use fit::robust::calibrate_robust;
pub use fit::stream::{GateReport, RejectedSample, StreamReport};
pub use fit::weights::{Fit, SampleWeight};
