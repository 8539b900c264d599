use super::arm_problem::Means;
use super::arm_solver::ArmSolver;
use super::calibrator::Calibrator;
use super::minimizer::{Progress, enough_samples};
use super::outcome::{ArmOutcome, RobotOutcome};
use super::refusal::Refusal;
use super::settings::Settings;
use crate::Real;
use crate::robot::{ArmIndex, Drive, Robot};
use crate::samples::{ArmFactor, NominalArm};
use nalgebra::Vector3;

impl<T: Real> Calibrator<T> {
    /// Calibrates all three arms.
    ///
    /// # Errors
    /// The first arm's [`Refusal`]; the robot keeps its parameters.
    pub fn solve(&mut self) -> Result<RobotOutcome<T>, Refusal> {
        let mut solver = RobotSolver::new(self)?;
        while solver.step(self)? == Progress::Working {}
        solver.outcome()
    }
}

/// Calibrates a robot's arms one after the other, one bounded step at a time.
///
/// ```
/// use delta_cal::{Calibrator, Progress, Refusal, RobotSolver, Settings, SymmetricRobot};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }
///     .robot()?;
/// let mut calibrator = Calibrator::new(&robot, &Settings::default());
/// // Without samples the first arm is refused before the first step.
/// assert!(matches!(RobotSolver::new(&mut calibrator), Err(Refusal::TooFewSamples { needed: 8, .. })));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct RobotSolver<T: Real> {
    /// Of the arm at work, once begun.
    solver: Option<ArmSolver<T>>,
    arm: ArmIndex,
    outcomes: [Option<ArmOutcome<T>>; 3],
}

impl<T: Real> RobotSolver<T> {
    /// Takes in the samples that wait, and begins with the first arm.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`].
    pub fn new(calibrator: &mut Calibrator<T>) -> Result<Self, Refusal> {
        calibrator.flush();
        let [first, ..] = calibrator.arms();
        enough_samples(first, ArmIndex::First, calibrator.settings())?;
        Ok(Self {
            solver: None,
            arm: ArmIndex::First,
            outcomes: [None; 3],
        })
    }

    /// The arm at work.
    pub const fn arm(&self) -> ArmIndex {
        self.arm
    }

    /// One step of the current arm, on the samples that were there at the start and any that were
    /// taken in since; on its last, its outcome and the start of the next arm.
    ///
    /// # Errors
    /// The arm's [`Refusal`], again on every further call.
    pub fn step(&mut self, calibrator: &Calibrator<T>) -> Result<Progress, Refusal> {
        let [first, second, third] = calibrator.arms();
        let (problem, next) = match self.arm {
            ArmIndex::First => (first, Some(ArmIndex::Second)),
            ArmIndex::Second => (second, Some(ArmIndex::Third)),
            ArmIndex::Third => (third, None),
        };
        match &mut self.solver {
            None => {
                self.begin(problem, calibrator.settings())?;
                return Ok(Progress::Working);
            }
            Some(solver) => {
                if solver.step(problem) == Progress::Working {
                    return Ok(Progress::Working);
                }
            }
        }
        self.finish(problem)?;
        let Some(arm) = next else {
            self.check_side(calibrator)?;
            return Ok(Progress::Finished);
        };
        self.solver = None;
        self.arm = arm;
        Ok(Progress::Working)
    }

    fn begin(&mut self, problem: &ArmFactor<T>, settings: &Settings<T>) -> Result<(), Refusal> {
        enough_samples(problem, self.arm, settings)?;
        self.solver
            .insert(ArmSolver::of_arm(problem, self.arm, settings))
            .begin(problem);
        Ok(())
    }

    /// A function of its own, so that its large temporaries do not share a stack with the steps.
    #[inline(never)]
    fn finish(&mut self, problem: &ArmFactor<T>) -> Result<(), Refusal> {
        let solver = self.solver.as_ref().ok_or(Refusal::Unfinished)?;
        let outcome = solver.outcome(problem);
        if let (Some(place), Ok(outcome)) = (self.outcomes.get_mut(self.arm.index()), &outcome) {
            *place = Some(*outcome);
        }
        outcome.map(|_| ())
    }

    #[inline(never)]
    fn check_side(&self, calibrator: &Calibrator<T>) -> Result<(), Refusal> {
        let [first, second, third] = calibrator.arms();
        check_side(
            &self.robot()?,
            [first.nominal(), second.nominal(), third.nominal()],
            [first.means(), second.means(), third.means()],
        )
    }

    /// The calibrated robot.
    ///
    /// # Errors
    /// [`Refusal::Unfinished`] before the last step; [`Refusal::ImpossibleRobot`] if three valid
    /// arms do not make a robot.
    pub fn outcome(&self) -> Result<RobotOutcome<T>, Refusal> {
        let robot = self.robot()?;
        match self.outcomes {
            [Some(first), Some(second), Some(third)] => Ok(RobotOutcome {
                robot,
                arms: [first, second, third],
            }),
            _ => Err(Refusal::Unfinished),
        }
    }

    fn robot(&self) -> Result<Robot<T>, Refusal> {
        match &self.outcomes {
            [Some(first), Some(second), Some(third)] => {
                Robot::new([first.arm, second.arm, third.arm]).map_err(Refusal::ImpossibleRobot)
            }
            _ => Err(Refusal::Unfinished),
        }
    }
}

/// The constraints hold on both sides of the elbows' plane, forward kinematics only below it: the mean
/// measured point must lie below the plane of the mean elbows.
#[inline(never)]
pub(super) fn check_side<T: Real>(
    robot: &Robot<T>,
    nominal_arms: [&NominalArm<T>; 3],
    means: [Means<T>; 3],
) -> Result<(), Refusal> {
    let mut elbows = [Vector3::zeros(); 3];
    let mut point = Vector3::zeros();
    for (((elbow, arm), means), nominal) in elbows
        .iter_mut()
        .zip(robot.arms())
        .zip(&means)
        .zip(nominal_arms)
    {
        *elbow = match arm.drive() {
            Drive::Rotary => arm.d() + arm.basis().u * means.cosine + arm.basis().v * means.sine,
            Drive::Linear => arm.elbow(means.sine * nominal.scale()),
        };
        point = means.x * nominal.scale() + nominal.centre();
    }
    let [first, second, third] = elbows;
    let normal = (second - first).cross(&(third - first));
    let above = normal.dot(&(point - first)) * normal.dot(&robot.up());
    if above < T::ZERO {
        Ok(())
    } else {
        Err(Refusal::WrongSide)
    }
}

#[cfg(test)]
mod tests;
