//! What an import gives.

use super::measured::Saved;
use crate::files::robot_file::RobotFile;

/// A robot file, and a samples file if the configuration holds measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The configuration's name.
    pub source: String,
    /// The robot file, read.
    pub robot: RobotFile,
    /// Its text.
    pub robot_text: String,
    /// The samples file's text.
    pub samples_text: Option<String>,
    /// What it holds.
    pub saved: Saved,
    /// The joints at their end stops: radians, or mm of travel.
    pub home: [f64; 3],
    /// The printer, if carriages drive it.
    pub printer: Option<super::linear::LinearPrinter>,
    /// The radius within which the nozzle is wanted, mm.
    pub bed_radius: Option<f64>,
    /// What to know of the import, in sentences.
    pub notes: Vec<String>,
}
