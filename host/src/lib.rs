//! Calibrates Delta robots from files: robots, measurements, calibrations, plans, campaigns and workspaces. The
//! mathematics is the core's, `delta-cal`; this crate reads, judges, compares and shows.
//!
//! Each folder uses only those above it in this list:
//!
//! ```text
//! text         numbers and lists in sentences
//! geometry     where a robot may be: limits, the sweep of the forward model
//! files        robot file, samples file, their faults, output files
//! import       configurations of other controllers, read into a robot and samples
//! fit          samples to parameters, by either method; no judgement
//! accuracy     how well positions and parameters are known
//! calibration  a case ─→ an attempt ─→ a report, or an objection ─→ a reason in words; diagnosis
//! validation   a calibrated robot against independent measurements and a limit
//! planning     which poses to measure, and whether measured ones suffice
//! campaign     many simulated robots, calibrated in every way that a file asks for
//! workspace    where the robot gets, and what limits it
//! export       what another controller can hold of a robot, and what that loses
//! printer      a printer's configuration: what is wrong, what to measure, what to paste
//! render       figures, pages, the terminal
//! report       results for people and for programs
//! device       a controller that calibrates itself, over its link
//! cli          the command `delta-cal`: arguments, help, exit codes, progress
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
#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "device")]
pub mod device;
pub mod export;
pub mod files;
pub mod fit;
pub mod geometry;
pub mod import;
pub mod planning;
pub mod printer;
pub mod render;
pub mod report;
pub mod text;
pub mod validation;
pub mod workspace;

pub use accuracy::expected_error::ExpectedError;
pub use accuracy::position_error::{PositionError, SampleErrors};
pub use accuracy::workspace_comparison::WorkspaceComparison;
pub use calibration::causes::{Alternative, ArmResiduals, Cause, CauseKind, Causes};
pub use calibration::diagnosis::{Diagnosis, DiagnosisEvidence, Explanation};
pub use calibration::error::CalibrateError;
pub use calibration::noise_test::{Estimate, NoiseTest, NoiseVerdict, StatedNoise};
pub use calibration::observations::{ObservationsReport, calibrate_observations};
pub use calibration::prior_test::PriorTest;
pub use calibration::reason::{Reason, Refused};
pub use calibration::report::CalibrationReport;
pub use calibration::{Accepted, accepted, calibrate, for_transmissions, read_samples};
pub use files::columns::ColumnMapping;
pub use files::input_error::InputError;
pub use files::input_text::InputText;
pub use files::robot_file::{InstrumentFacts, Record, RobotFile};
pub use files::samples_file::{
    ManyRows, Measurements, MeasurementsToCheck, ObservationsFile, ObservationsToCheck,
    PosesToCheck, PositionUnit, Row, SamplesFile, read_joints, read_positions,
};
pub use fit::options::{CalibrationMethod, Frame, Options, OptionsError, Streaming};
pub use fit::outcome::Outcome;
pub use fit::robust::calibrate_robust;
pub use fit::stream::{GateReport, RejectedSample, StreamReport};
pub use fit::weights::{Fit, SampleWeight};
