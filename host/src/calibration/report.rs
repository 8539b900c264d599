//! A calibration and what there is to know of it.

use crate::accuracy::position_error::{PositionError, SampleErrors};
use crate::accuracy::position_uncertainty::UncertaintyMap;
use crate::accuracy::workspace_comparison::WorkspaceComparison;
use crate::calibration::diagnosis::Diagnosis;
use crate::calibration::noise_test::NoiseTest;
use crate::calibration::thresholds::FEW_SAMPLES;
use crate::files::robot_file::RobotFile;
use crate::fit::options::Options;
use crate::fit::outcome::Outcome;
use crate::fit::stream::StreamReport;
use delta_cal::Noise;

/// A calibration, and what there is to know to trust it or not.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationReport {
    /// How it was calibrated.
    pub options: Options,
    /// The robot file.
    pub before: RobotFile,
    /// The calibrated robot with the limits, tolerance and noise of the file, and the sensor's
    /// frame if that was asked for.
    pub after: RobotFile,
    /// The samples file's name.
    pub samples_file: String,
    /// How many samples there were.
    pub samples: usize,
    /// How many of them have joint angles that no other sample before them has.
    pub distinct_poses: usize,
    /// The method's result.
    pub outcome: Outcome,
    /// Over the samples that are not suspected, with the parameters before.
    pub error_before: PositionError,
    /// Over the same samples, with the calibrated parameters.
    pub error_after: PositionError,
    /// What the samples are judged by: the noise that the robot file states, otherwise the position's
    /// as estimated from the residuals; `None` if no sample is left over to estimate it from.
    pub noise: Option<Noise<f64>>,
    /// What the residuals say of the noise; `None` if no sample is left over.
    pub noise_test: Option<NoiseTest>,
    /// Every sample by itself, in the file's order.
    pub sample_errors: Vec<SampleErrors>,
    /// Over the workspace; `None` if the uncertainty is not known.
    pub workspace: Option<WorkspaceComparison>,
    /// How uncertain the calibrated robot's positions are, place by place; `None` as above.
    pub uncertainty: Option<UncertaintyMap>,
    /// What came of the samples' order, if it was looked at.
    pub stream: Option<StreamReport>,
    /// What would explain the samples clearly better than the robot of the file as they are.
    pub diagnosis: Option<Diagnosis>,
    /// Anything doubtful, in plain words.
    pub warnings: Vec<String>,
}

impl CalibrationReport {
    /// The samples that a robust fit does not count.
    pub fn suspected(&self) -> impl Iterator<Item = &SampleErrors> {
        let samples = self.sample_errors.iter();
        samples.filter(|sample| sample.weight.suspected)
    }
    /// Whether a sample stands out after the calibration.
    pub(crate) fn stands_out(&self, sample: &SampleErrors) -> bool {
        let outlying = |distance| self.error_after.is_outlier(distance);
        let stands_out = self.samples >= FEW_SAMPLES && sample.after.is_some_and(outlying);
        sample.weight.suspected || stands_out
    }

    /// What explains the samples better is the gravest doubt.
    pub(crate) fn diagnosed(mut self, diagnosis: Option<Diagnosis>) -> Self {
        if let Some(diagnosis) = &diagnosis {
            let doubt = format!("{diagnosis}: {}", diagnosis.remedy());
            self.warnings.insert(0, doubt);
        }
        self.diagnosis = diagnosis;
        self
    }
}
