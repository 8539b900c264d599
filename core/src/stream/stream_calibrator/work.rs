//! What there is to solve, one bounded step after the other.

use super::calibrators::{Calibrators, Judge};
use crate::Real;
use crate::calibration::{
    Calibrator, JointCalibrator, JointSolver, Progress, Refusal, RobotOutcome, RobotSolver,
};
use crate::robot::ArmIndex;
use crate::stream::held_out::{HeldOut, Validation};
use crate::stream::stream_outcome::StreamOutcome;
use crate::stream::stream_refusal::StreamRefusal;

#[derive(Debug, Clone, Copy)]
#[allow(clippy::large_enum_variant)] // no allocation
pub(super) enum Work<T: Real> {
    Collecting,
    /// The gate wants an estimate. The first step of each kind of work prepares its solver.
    Estimate,
    Estimating(RobotSolver<T>),
    /// All samples have come.
    Solve,
    /// Without the held-out samples.
    Fitting(RobotSolver<T>),
    Validating {
        fitted: RobotOutcome<T>,
        arm: ArmIndex,
        found: [Option<Validation<T>>; 3],
    },
    /// The held-out samples agree.
    Last,
    Arms(RobotSolver<T>),
    /// With the held-out samples.
    Merged {
        calibrator: Calibrator<T>,
        solver: RobotSolver<T>,
    },
    Joint(JointSolver<T>),
    Solved(StreamOutcome<T>),
    Refused(StreamRefusal),
}

impl<T: Real> Work<T> {
    pub(super) const fn arm(&self) -> Option<ArmIndex> {
        match self {
            Self::Estimating(solver)
            | Self::Fitting(solver)
            | Self::Arms(solver)
            | Self::Merged { solver, .. } => Some(solver.arm()),
            Self::Validating { arm, .. } => Some(*arm),
            _ => None,
        }
    }

    /// One step. A refusal ends the work; if it was the gate's estimate that was refused, the gate goes on without one.
    pub(super) fn step(&mut self, calibrators: &mut Calibrators<T>) {
        let done = match self {
            Self::Collecting | Self::Solved(_) | Self::Refused(_) => Ok(()),
            Self::Estimate => {
                self.estimate(calibrators);
                Ok(())
            }
            Self::Estimating(_) => {
                self.go_on_estimating(calibrators);
                Ok(())
            }
            Self::Solve => self.begin(calibrators),
            Self::Fitting(_) => self.go_on_fitting(calibrators),
            Self::Validating { .. } => self.validate(calibrators),
            Self::Last => self.begin_last(calibrators),
            Self::Arms(_) => self.go_on_with_arms(calibrators),
            Self::Merged { .. } => self.go_on_with_merged(),
            Self::Joint(_) => self.go_on_jointly(calibrators),
        };
        if let Err(refusal) = done {
            *self = Self::Refused(refusal);
        }
    }

    // Not inlined, here and below: what is done one after the other shares the stack.
    #[inline(never)]
    fn estimate(&mut self, calibrators: &mut Calibrators<T>) {
        *self = match RobotSolver::new(&mut calibrators.arms) {
            Ok(solver) => Self::Estimating(solver),
            Err(_) => Self::Collecting,
        };
    }

    #[inline(never)]
    fn go_on_estimating(&mut self, calibrators: &mut Calibrators<T>) {
        let Self::Estimating(solver) = self else {
            return;
        };
        let finished = match solver.step(&calibrators.arms) {
            Ok(Progress::Working) => return,
            finished => finished,
        };
        if let (Ok(_), Ok(outcome), Judge::Gate(gate)) =
            (finished, solver.outcome(), &mut calibrators.judge)
        {
            gate.adopt(&mut calibrators.arms, &outcome);
        }
        *self = Self::Collecting;
    }

    #[inline(never)]
    fn begin(&mut self, calibrators: &mut Calibrators<T>) -> Result<(), StreamRefusal> {
        // Here already: with the begin of its solve it would be the longest of all steps.
        if let Some(joint) = &mut calibrators.joint {
            joint.flush();
        }
        *self = match &mut calibrators.judge {
            Judge::Nothing | Judge::Gate(_) => Self::Last,
            Judge::HeldOut {
                samples,
                validations,
            } => {
                *validations = None;
                samples.flush();
                Self::Fitting(RobotSolver::new(&mut calibrators.arms)?)
            }
        };
        Ok(())
    }

    #[inline(never)]
    fn go_on_fitting(&mut self, calibrators: &Calibrators<T>) -> Result<(), StreamRefusal> {
        let Self::Fitting(solver) = self else {
            return Ok(());
        };
        if let Some(fitted) = finished(solver, &calibrators.arms)? {
            *self = Self::Validating {
                fitted,
                arm: ArmIndex::First,
                found: [None; 3],
            };
        }
        Ok(())
    }

    #[inline(never)]
    fn validate(&mut self, calibrators: &mut Calibrators<T>) -> Result<(), StreamRefusal> {
        let Self::Validating { fitted, arm, found } = self else {
            return Ok(());
        };
        let Judge::HeldOut {
            samples,
            validations,
        } = &mut calibrators.judge
        else {
            return Ok(());
        };
        let validation = samples.validate_arm(&calibrators.arms, fitted, *arm)?;
        if let Some(place) = found.get_mut(arm.index()) {
            *place = Some(validation);
        }
        match arm {
            ArmIndex::First => *arm = ArmIndex::Second,
            ArmIndex::Second => *arm = ArmIndex::Third,
            ArmIndex::Third => {
                if let [Some(first), Some(second), Some(third)] = *found {
                    *validations = Some([first, second, third]);
                }
                *self = Self::Last;
            }
        }
        Ok(())
    }

    fn begin_last(&mut self, calibrators: &mut Calibrators<T>) -> Result<(), StreamRefusal> {
        if let Some(joint) = &mut calibrators.joint {
            return self.begin_jointly(joint);
        }
        match &calibrators.judge {
            Judge::Nothing | Judge::Gate(_) => self.begin_with_arms(&mut calibrators.arms),
            Judge::HeldOut { samples, .. } => self.begin_with_merged(&calibrators.arms, samples),
        }
    }

    #[inline(never)]
    fn begin_jointly(&mut self, joint: &mut JointCalibrator<T>) -> Result<(), StreamRefusal> {
        *self = Self::Joint(JointSolver::new(joint)?);
        Ok(())
    }

    #[inline(never)]
    fn begin_with_arms(&mut self, arms: &mut Calibrator<T>) -> Result<(), StreamRefusal> {
        *self = Self::Arms(RobotSolver::new(arms)?);
        Ok(())
    }

    #[inline(never)]
    fn begin_with_merged(
        &mut self,
        arms: &Calibrator<T>,
        held_out: &HeldOut<T>,
    ) -> Result<(), StreamRefusal> {
        let mut calibrator = *arms;
        // Both are of the same robot and noise: they merge.
        let _ = held_out.merge_into(&mut calibrator);
        let solver = RobotSolver::new(&mut calibrator)?;
        *self = Self::Merged { calibrator, solver };
        Ok(())
    }

    #[inline(never)]
    fn go_on_with_arms(&mut self, calibrators: &Calibrators<T>) -> Result<(), StreamRefusal> {
        let Self::Arms(solver) = self else {
            return Ok(());
        };
        if let Some(outcome) = finished(solver, &calibrators.arms)? {
            *self = Self::Solved(StreamOutcome::Arms(outcome));
        }
        Ok(())
    }

    #[inline(never)]
    fn go_on_with_merged(&mut self) -> Result<(), StreamRefusal> {
        let Self::Merged { calibrator, solver } = self else {
            return Ok(());
        };
        if let Some(outcome) = finished(solver, calibrator)? {
            *self = Self::Solved(StreamOutcome::Arms(outcome));
        }
        Ok(())
    }

    #[inline(never)]
    fn go_on_jointly(&mut self, calibrators: &Calibrators<T>) -> Result<(), StreamRefusal> {
        let (Self::Joint(solver), Some(joint)) = (&mut *self, &calibrators.joint) else {
            return Ok(());
        };
        if solver.step(joint) == Progress::Finished {
            *self = Self::Solved(StreamOutcome::Joint(solver.outcome(joint)?));
        }
        Ok(())
    }
}

fn finished<T: Real>(
    solver: &mut RobotSolver<T>,
    calibrator: &Calibrator<T>,
) -> Result<Option<RobotOutcome<T>>, Refusal> {
    Ok(match solver.step(calibrator)? {
        Progress::Working => None,
        Progress::Finished => Some(solver.outcome()?),
    })
}
