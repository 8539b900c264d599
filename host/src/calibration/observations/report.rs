//! What there is to know of a calibration from observations.

use super::known::Known;
use super::transmissions::TransmissionFound;
use crate::accuracy::coverage::{Acceptance, CoverageFactor, ExpandedUncertainty};
use crate::accuracy::expected_error::ExpectedError;
use crate::accuracy::workspace_comparison::WorkspaceComparison;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::ObservationsFile;
use crate::fit::observations::ObservedFit;
use crate::fit::options::Frame;

/// A calibration from observations, and what there is to know of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationsReport {
    /// The robot file.
    pub before: RobotFile,
    /// The calibrated robot with everything else of the file, and the frame of the coordinates if that
    /// was asked for.
    pub after: RobotFile,
    /// The measurements.
    pub samples: ObservationsFile,
    /// The frame of the coordinates.
    pub frame: Frame,
    /// The robot, the instruments and the residuals; every σ widened.
    pub fit: ObservedFit,
    /// Σ residual² + the tolerance's share over the degrees of freedom, its root: 1 is expected.
    pub lack_of_fit: f64,
    /// By what every σ is multiplied: the lack of fit, or that of the residuals by themselves, if it is improbably large;
    /// otherwise 1.
    pub widening: f64,
    /// The position error that the robot of the file is expected to have; `None` without a tolerance.
    pub expected_before: Option<ExpectedError>,
    /// The same of the calibrated robot.
    pub expected_after: Option<ExpectedError>,
    /// What the calibration means for positions relative to each other; `None` without an uncertainty.
    pub workspace: Option<WorkspaceComparison>,
    /// Readings less what they determine, and more by what is known beforehand.
    pub degrees_of_freedom: f64,
    /// What the measurements determine.
    pub known: Known,
    /// The joints' transmissions, if they were to be found.
    pub transmissions: Option<[TransmissionFound; 3]>,
    /// Anything doubtful, in plain words.
    pub warnings: Vec<String>,
}

impl ObservationsReport {
    /// The expanded uncertainty of the relative positions; `None` if it is not known. The noise is stated.
    pub fn expanded(&self) -> Option<ExpandedUncertainty> {
        let relative = self.expected_after.as_ref()?.intrinsic;
        Some(CoverageFactor::STATED.expanded(relative.rms, relative.max))
    }

    /// Whether that (rms over the workspace) is within a limit, mm.
    pub fn acceptance(&self, limit: f64) -> Acceptance {
        Acceptance {
            limit,
            expanded: self.expanded().map(|expanded| expanded.rms),
            relative: true,
        }
    }

    /// The lines of the rows that a robust fit leaves out.
    pub fn suspected_lines(&self) -> Vec<u64> {
        let suspected = self.fit.suspected.iter();
        suspected
            .filter_map(|index| Some(self.samples.rows.get(*index)?.line))
            .collect()
    }

    /// A row's residual: √ of the mean square of its readings, in σ.
    pub fn row_residual(&self, row: usize) -> f64 {
        let Some((residuals, reading)) =
            self.fit.residuals.get(row).zip(self.samples.rows.get(row))
        else {
            return 0.0;
        };
        let squares: f64 = residuals.iter().map(|own| own * own).sum();
        #[allow(clippy::cast_precision_loss)] // at most five
        let count = reading.value.readings() as f64;
        (squares / count.max(1.0)).sqrt()
    }
}
