//! The objects that hold what came.

use crate::Real;
use crate::calibration::{Calibrator, JointCalibrator, Settings};
use crate::robot::Robot;
use crate::samples::{Sample, SampleError};
use crate::stream::gate::{Gate, Verdict};
use crate::stream::held_out::{HeldOut, HeldOutRefusal, Validation};
use crate::stream::stream_options::{Estimator, Selection, StreamOptions};
use crate::stream::stream_outcome::Added;

#[derive(Debug, Clone, Copy)]
pub(super) struct Calibrators<T: Real> {
    pub(super) options: StreamOptions<T>,
    /// Empty where nothing needs it.
    pub(super) arms: Calibrator<T>,
    pub(super) joint: Option<JointCalibrator<T>>,
    pub(super) judge: Judge<T>,
}

/// What judges the samples, or the fit to them.
#[derive(Debug, Clone, Copy)]
#[allow(clippy::large_enum_variant)] // no allocation
pub(super) enum Judge<T: Real> {
    Nothing,
    Gate(Gate<T>),
    HeldOut {
        samples: HeldOut<T>,
        validations: Option<[Validation<T>; 3]>,
    },
}

impl<T: Real> Calibrators<T> {
    #[inline(never)]
    pub(super) fn new(
        robot: &Robot<T>,
        settings: &Settings<T>,
        options: &StreamOptions<T>,
    ) -> Result<Self, HeldOutRefusal> {
        let mut arms = Calibrator::new(robot, settings);
        let judge = match options.selection {
            Selection::All { .. } => Judge::Nothing,
            Selection::Gated { forgetting } => {
                let gate = Gate::new(&mut arms);
                Judge::Gate(match forgetting {
                    Some(forgetting) => gate.with_forgetting(forgetting),
                    None => gate,
                })
            }
            Selection::HeldOut { every } => Judge::HeldOut {
                samples: HeldOut::new(&arms, every)?,
                validations: None,
            },
        };
        Ok(Self {
            options: *options,
            arms,
            joint: match options.estimator {
                Estimator::Arms => None,
                Estimator::Joint => Some(JointCalibrator::new(robot, settings)),
            },
            judge,
        })
    }

    /// What became of the sample, and whether the gate wants an estimate before the next.
    pub(super) fn add(&mut self, sample: &Sample<T>) -> Result<(Added<T>, bool), SampleError> {
        let forgetting = self.options.forgetting();
        let (added, wants_estimate) = match &mut self.judge {
            Judge::Nothing => {
                if self.joint.is_none() {
                    match &forgetting {
                        Some(forgetting) => self.arms.add_forgetting(sample, forgetting)?,
                        None => self.arms.add(sample)?,
                    }
                }
                (Added::Taken, false)
            }
            Judge::Gate(gate) => {
                let verdict = gate.add(&mut self.arms, sample)?;
                (Added::Tested(verdict), gate.wants_estimate())
            }
            Judge::HeldOut { samples, .. } => {
                let held_out = samples.add(&mut self.arms, sample)?;
                (
                    if held_out {
                        Added::HeldOut
                    } else {
                        Added::Taken
                    },
                    false,
                )
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

    pub(super) const fn gate(&self) -> Option<&Gate<T>> {
        match &self.judge {
            Judge::Gate(gate) => Some(gate),
            Judge::Nothing | Judge::HeldOut { .. } => None,
        }
    }

    pub(super) const fn validations(&self) -> Option<&[Validation<T>; 3]> {
        match &self.judge {
            Judge::HeldOut { validations, .. } => validations.as_ref(),
            Judge::Nothing | Judge::Gate(_) => None,
        }
    }
}
