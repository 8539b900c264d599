//! From samples to parameters, by any of the three estimators. Judging the result is left to other modules.
//!
//! ```text
//! RobotFile, Readings, Options ─→ instruments, rows ─→ fkm | joint | ikm ─→ Solution
//!                                       ↑   noise of each kind, until it settles  │
//!                                       └─────────────────────────────────────────┘
//! ```

pub(crate) mod checks;
pub(crate) mod datum;
mod estimators;
pub(crate) mod instruments;
pub(crate) mod jointly;
pub mod observations;
mod robust;
pub mod solution;
pub(crate) mod solve;
mod unknowns;

use crate::files::{Readings, RobotFile};
pub(crate) use estimators::{Closure, by_arms};
use serde::{Deserialize, Serialize};
pub use solution::{Solution, Unsolved};
pub use solve::solve;
pub(crate) use solve::{HEIGHTS, solve_with};
pub use unknowns::Unknown;

/// The estimator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// All parameters at once from the closures of the three arms, weighted together. Needs complete positions in
    /// the robot's frame.
    Joint,
    /// Each arm's eight parameters from the closure of its own kinematic chain (paper, 3.2). Needs the same.
    #[default]
    Ikm,
    /// All parameters and the instruments' unknowns at once from any readings (paper, 3.1).
    Fkm,
}

impl Method {
    /// The name for use in a sentence: "{} method".
    pub const fn title(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Ikm => "IKM",
            Self::Fkm => "FKM",
        }
    }
}

/// The frame in which coordinates are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Frame {
    /// The robot's own.
    #[default]
    Base,
    /// The sensor's, which stands anywhere: six more unknowns.
    Sensor,
}

/// Options of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// `None` chooses [`Method::Joint`] for complete positions in the robot's frame, otherwise [`Method::Fkm`].
    pub method: Option<Method>,
    /// Robust fit: Tukey's loss instead of least squares rejects rows that disagree with the others.
    pub robust: bool,
    /// The frame of the coordinates.
    pub frame: Frame,
    /// A printer's heights, from which its firmware was calibrated too: they test the bed alone, so that a chance of harm
    /// elsewhere is not judged.
    pub of_printer: bool,
}

impl Options {
    /// The defaults for coordinates in this frame.
    pub fn in_frame(frame: Frame) -> Self {
        Self {
            frame,
            ..Self::default()
        }
    }
}

/// The data of a calibration. `before` is the original robot file, `robot` may have a wider tolerance.
#[derive(Clone, Copy)]
pub(crate) struct Case<'a> {
    pub(crate) robot: &'a RobotFile,
    pub(crate) before: &'a RobotFile,
    pub(crate) readings: &'a Readings,
    pub(crate) options: Options,
}

impl<'a> Case<'a> {
    /// For the original robot file.
    pub(crate) const fn new(
        robot: &'a RobotFile,
        readings: &'a Readings,
        options: Options,
    ) -> Self {
        Self {
            robot,
            before: robot,
            readings,
            options,
        }
    }
}
