//! A calibration and what there is to know of it.

use crate::accuracy::coverage::{Acceptance, CoverageFactor, ExpandedUncertainty};
use crate::accuracy::distribution::Sampled;
use crate::accuracy::position_error::{PositionError, SampleErrors};
use crate::accuracy::sampled::{evenly, shown};
use crate::accuracy::uncertainty_map::UncertaintyMap;
use crate::accuracy::workspace_comparison::WorkspaceComparison;
use crate::calibration::causes::Causes;
use crate::calibration::diagnosis::Diagnosis;
use crate::calibration::noise_test::NoiseTest;
use crate::calibration::prior_test::PriorTest;
use crate::calibration::shift::Shift;
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
    /// What the residuals show that the model does not hold.
    pub causes: Causes,
    /// By what every σ of parameters and positions is multiplied: √(χ²/f + (b/s)²), the first term 1
    /// unless the residuals exceed the stated noise, b being [`Causes::position_error`] and s the σ of
    /// the positions over the same poses before. 1 if nothing is amiss.
    pub widening: f64,
    /// What the robot says of the stated tolerance; `None` without one, or if the samples determine
    /// nothing better than it does.
    pub prior_test: Option<PriorTest>,
    /// Whether the calibration used a wider tolerance than the stated one, because the robot
    /// contradicts it and the samples determine all parameters: the stated one times
    /// [`PriorTest::ratio`].
    pub tolerance_widened: bool,
    /// Every sample by itself, in the file's order; of many, some.
    pub sample_errors: Vec<SampleErrors>,
    /// How all samples are distributed; `None` if `sample_errors` holds all.
    pub sampled: Option<Sampled>,
    /// Over the workspace; `None` if the uncertainty is not known.
    pub workspace: Option<WorkspaceComparison>,
    /// How uncertain the calibrated robot's positions are, place by place; `None` as above.
    pub uncertainty: Option<UncertaintyMap>,
    /// What came of the samples' order, if it was looked at.
    pub stream: Option<StreamReport>,
    /// What would explain the samples clearly better than the robot of the file as they are.
    pub diagnosis: Option<Diagnosis>,
    /// Of a robust fit, if the samples that disagree are those before or after some row.
    pub shift: Option<Shift>,
    /// Anything doubtful, in plain words.
    pub warnings: Vec<String>,
}

impl CalibrationReport {
    /// The samples that a robust fit does not count.
    pub fn suspected(&self) -> impl Iterator<Item = &SampleErrors> {
        let samples = self.sample_errors.iter();
        samples.filter(|sample| sample.weight.suspected)
    }

    /// How many samples a robust fit does not count.
    pub fn suspected_count(&self) -> usize {
        match &self.sampled {
            Some(all) => all.suspected,
            None => self.suspected().count(),
        }
    }

    /// Where the rows are that a terminal does not name.
    pub const fn others_in(&self) -> &'static str {
        if self.sampled.is_some() {
            "--json and --report name more"
        } else {
            "--json and --report name all"
        }
    }

    /// With at most so many single samples: those farthest off, and others spread evenly.
    pub fn with_at_most(mut self, most: usize) -> Self {
        let samples = &self.sample_errors;
        let size = |index: usize| samples[index].after.unwrap_or(f64::INFINITY);
        if let Some(shown) = shown(samples.len(), most, size) {
            self.sampled = self.sampled.or_else(|| Some(Sampled::of(samples)));
            self.sample_errors = shown.into_iter().map(|index| samples[index]).collect();
        }
        if self.sampled.is_none() {
            return self;
        }
        for arm in &mut self.causes.arms {
            arm.points = evenly(&arm.points);
        }
        let gate = self.stream.as_mut().and_then(|stream| stream.gate.as_mut());
        if let Some(gate) = gate {
            gate.rejected = evenly(&gate.rejected);
        }
        self
    }

    /// By what the standard uncertainties are multiplied for the expanded ones; `None` if the noise is neither
    /// stated nor known well enough from the residuals.
    pub fn coverage(&self) -> Option<CoverageFactor> {
        match (&self.before.noise, &self.noise_test) {
            (Some(_), _) => Some(CoverageFactor::STATED),
            (None, Some(test)) => CoverageFactor::estimated(test.degrees_of_freedom),
            (None, None) => None,
        }
    }

    /// The expanded uncertainty of the position in the frame of the measurement; `None` if it is not known.
    pub fn expanded(&self) -> Option<ExpandedUncertainty> {
        let absolute = self.uncertainty.as_ref()?.expected.absolute;
        Some(self.coverage()?.expanded(absolute.rms, absolute.max))
    }

    /// Whether the expanded uncertainty (rms over the workspace) is within a limit, mm.
    pub fn acceptance(&self, limit: f64) -> Acceptance {
        Acceptance {
            limit,
            expanded: self.expanded().map(|expanded| expanded.rms),
            relative: false,
        }
    }

    /// Whether the estimate forgets samples.
    pub fn forgets(&self) -> bool {
        self.stream
            .as_ref()
            .is_some_and(|stream| stream.asked.forget.is_some())
    }

    /// Whether a sample stands out after the calibration.
    pub fn stands_out(&self, sample: &SampleErrors) -> bool {
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
