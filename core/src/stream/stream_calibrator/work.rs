//! What there is to solve, one bounded step after the other.

use super::calibrators::Calibrators;
use crate::Real;
use crate::calibration::{
    Calibrator, JointCalibrator, JointSolver, Progress, Refusal, RobotOutcome, RobotSolver,
};
use crate::robot::ArmIndex;
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
    /// No sample waits any more.
    Begin,
    Arms(RobotSolver<T>),
    Joint(JointSolver<T>),
    Solved(StreamOutcome<T>),
    Refused(StreamRefusal),
}

impl<T: Real> Work<T> {
    pub(super) const fn arm(&self) -> Option<ArmIndex> {
        match self {
            Self::Estimating(solver) | Self::Arms(solver) => Some(solver.arm()),
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
            Self::Solve => {
                self.flush(calibrators);
                Ok(())
            }
            Self::Begin => self.begin(calibrators),
            Self::Arms(_) => self.go_on_with_arms(calibrators),
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
        if let (Ok(_), Ok(outcome), Some(gate)) =
            (finished, solver.outcome(), &mut calibrators.gate)
        {
            gate.adopt(&mut calibrators.arms, &outcome);
        }
        *self = Self::Collecting;
    }

    #[inline(never)]
    fn flush(&mut self, calibrators: &mut Calibrators<T>) {
        // Here already: with the begin of its solve it would be the longest of all steps.
        if let Some(joint) = &mut calibrators.joint {
            joint.flush();
        }
        *self = Self::Begin;
    }

    fn begin(&mut self, calibrators: &mut Calibrators<T>) -> Result<(), StreamRefusal> {
        match &mut calibrators.joint {
            Some(joint) => self.begin_jointly(joint),
            None => self.begin_with_arms(&mut calibrators.arms),
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
