//! The objects that hold what came.

use crate::Real;
use crate::calibration::{Calibrator, JointCalibrator, Settings};
use crate::robot::Robot;
use crate::samples::{Sample, SampleError};
use crate::stream::gate::{Gate, Verdict};
use crate::stream::stream_options::{Estimator, Selection, StreamOptions};
use crate::stream::stream_outcome::Added;

#[derive(Debug, Clone, Copy)]
pub(super) struct Calibrators<T: Real> {
    pub(super) options: StreamOptions<T>,
    /// Empty where nothing needs it.
    pub(super) arms: Calibrator<T>,
    pub(super) joint: Option<JointCalibrator<T>>,
    /// What tests the samples, if anything does.
    pub(super) gate: Option<Gate<T>>,
}

impl<T: Real> Calibrators<T> {
    #[inline(never)]
    pub(super) fn new(
        robot: &Robot<T>,
        settings: &Settings<T>,
        options: &StreamOptions<T>,
    ) -> Self {
        let mut arms = Calibrator::new(robot, settings);
        let gate = match options.selection {
            Selection::All { .. } => None,
            Selection::Gated { forgetting } => {
                let gate = Gate::new(&mut arms);
                Some(match forgetting {
                    Some(forgetting) => gate.with_forgetting(forgetting),
                    None => gate,
                })
            }
        };
        Self {
            options: *options,
            arms,
            joint: match options.estimator {
                Estimator::Arms => None,
                Estimator::Joint => Some(JointCalibrator::new(robot, settings)),
            },
            gate,
        }
    }

    /// As before the first sample.
    #[inline(never)]
    pub(super) fn begin_again(&mut self) {
        let (settings, options) = (*self.arms.settings(), self.options);
        *self = Self::new(&self.arms.robot(), &settings, &options);
    }

    /// What became of the sample, and whether the gate wants an estimate before the next.
    pub(super) fn add(&mut self, sample: &Sample<T>) -> Result<(Added<T>, bool), SampleError> {
        let forgetting = self.options.forgetting();
        let (added, wants_estimate) = match &mut self.gate {
            None => {
                if self.joint.is_none() {
                    match &forgetting {
                        Some(forgetting) => self.arms.add_forgetting(sample, forgetting)?,
                        None => self.arms.add(sample)?,
                    }
                }
                (Added::Taken, false)
            }
            Some(gate) => {
                let verdict = gate.add(&mut self.arms, sample)?;
                (Added::Tested(verdict), gate.wants_estimate())
            }
        };
        if let Some(joint) = &mut self.joint
            && !matches!(added, Added::Tested(Verdict::Rejected(_)))
        {
            match &forgetting {
                Some(forgetting) => joint.add_forgetting(sample, forgetting)?,
                None => joint.add(sample)?,
            }
        }
        Ok((added, wants_estimate))
    }
}
