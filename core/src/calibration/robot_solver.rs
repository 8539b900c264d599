//! The solver for three separate arms, in sequence.

use super::arm_samples::ArmSamples;
use super::calibrator::estimators::Parts;
use super::calibrator::{Calibrator, Ikm};
use super::free_start::Means;
use super::minimizer::{Minimizer, Progress, enough_samples};
use super::outcome::{ArmOutcome, Estimate, RobotOutcome};
use super::parts::{Samples, Solver};
use super::problem::Judged;
use super::refusal::Refusal;
use super::settings::Settings;
use super::tolerance_prior::TolerancePrior;
use crate::Real;
use crate::robot::{Arm, ArmIndex, Drive, Robot};
use crate::samples::{ArmFactor, Displacement, NominalArm, corrected_arm};
use nalgebra::Vector3;

/// Solves a robot's arms in sequence.
#[derive(Debug, Clone)]
pub struct RobotSolver<T: Real> {
    /// The solver of the current arm, once started.
    solver: Option<ArmSolver<T>>,
    arm: ArmIndex,
    estimate: Estimate<T, 8>,
    /// The arms solved so far; the others, and the robot before the last, have no meaning.
    outcome: Option<RobotOutcome<T>>,
}

/// The solver of one arm.
type ArmSolver<T> = Minimizer<T, Displacement<T>, (), 8>;

impl<T: Real> Solver<T, ArmSamples<T>> for RobotSolver<T> {
    #[inline(always)]
    fn vacant() -> Self {
        Self {
            solver: None,
            arm: ArmIndex::First,
            estimate: Estimate::vacant(),
            outcome: None,
        }
    }

    fn begin(&mut self, samples: &ArmSamples<T>) -> Result<(), Refusal> {
        self.solver = None;
        self.arm = ArmIndex::First;
        let arm = || ArmOutcome::of(Arm::vacant(), &Estimate::vacant());
        self.outcome = Some(RobotOutcome {
            robot: Robot::of_valid([Arm::vacant(), Arm::vacant(), Arm::vacant()]),
            arms: [arm(), arm(), arm()],
        });
        let [first, ..] = samples.arms();
        enough_samples(&first.extent(), ArmIndex::First, samples.settings())
    }

    /// One step of the current arm; the last step stores its outcome and starts the next arm.
    fn step(&mut self, samples: &ArmSamples<T>) -> Result<Progress, Refusal> {
        let [first, second, third] = samples.arms();
        let (problem, next) = match self.arm {
            ArmIndex::First => (first, Some(ArmIndex::Second)),
            ArmIndex::Second => (second, Some(ArmIndex::Third)),
            ArmIndex::Third => (third, None),
        };
        match &mut self.solver {
            None => {
                self.start(problem, samples.settings());
                return Ok(Progress::Working);
            }
            Some(solver) => {
                if solver.step(problem, &mut self.estimate)? == Progress::Working {
                    return Ok(Progress::Working);
                }
            }
        }
        self.finish(problem)?;
        let Some(arm) = next else {
            self.complete(samples)?;
            return Ok(Progress::Finished);
        };
        self.solver = None;
        self.arm = arm;
        Ok(Progress::Working)
    }
}

impl<T: Real> RobotSolver<T> {
    fn start(&mut self, problem: &ArmFactor<T>, settings: &Settings<T>) {
        let nominal = problem.nominal();
        let tolerance = settings.tolerance.as_ref();
        let prior = TolerancePrior::of_arm(nominal.arm(), &nominal.units(), tolerance);
        self.solver
            .insert(ArmSolver::unstarted(self.arm, prior, settings))
            .begin(problem);
    }

    /// The outcome of the current arm.
    fn finish(&mut self, problem: &ArmFactor<T>) -> Result<(), Refusal> {
        let arm = self.arm;
        // Not by `?`, which would copy the arm.
        let corrected = match corrected_arm(problem.nominal(), &self.estimate.correction) {
            Ok(corrected) => corrected,
            Err(error) => return Err(Refusal::ImpossibleGeometry { arm, error }),
        };
        let arms = self.outcome.as_mut().map(|outcome| &mut outcome.arms);
        if let Some(place) = arms.and_then(|arms| arms.get_mut(arm.index())) {
            *place = ArmOutcome::of(corrected, &self.estimate);
        }
        Ok(())
    }

    /// Assembles the robot from all three arms.
    fn complete(&mut self, samples: &ArmSamples<T>) -> Result<(), Refusal> {
        let outcome = self.outcome.as_mut().ok_or(Refusal::Unfinished)?;
        let [one, two, three] = &outcome.arms;
        outcome.robot = match Robot::new([one.arm, two.arm, three.arm]) {
            Ok(robot) => robot,
            Err(error) => return Err(Refusal::ImpossibleRobot(error)),
        };
        let [first, second, third] = samples.arms();
        check_side(
            &outcome.robot,
            samples.nominal_arms(),
            &[first.means(), second.means(), third.means()],
        )
    }
}

impl<T: Real> Calibrator<T, Ikm> {
    /// Σ (f/σf)² of each arm of any robot over the samples; without a stated noise in units of the robot's size squared.
    /// Excludes samples waiting for [`flush`](Self::flush).
    pub fn sums_of_squares(&self, robot: &Robot<T>) -> [T; 3] {
        let [first, second, third] = &self.samples.arms;
        let [one, two, three] = robot.arms();
        [
            first.sum_of_squares(one),
            second.sum_of_squares(two),
            third.sum_of_squares(three),
        ]
    }
}

impl Parts for Ikm {
    const NUMBER: u8 = 1;
    type Samples<T: Real> = ArmSamples<T>;
    type Solver<T: Real> = RobotSolver<T>;
    type Beside<T: Real> = ();

    fn outcome<T: Real>(solver: &RobotSolver<T>) -> Option<&RobotOutcome<T>> {
        solver.outcome.as_ref()
    }

    fn beside<T: Real>(_: &Robot<T>, _: &Settings<T>) {}

    fn arms<'a, T: Real>(
        samples: &'a mut ArmSamples<T>,
        (): &'a mut (),
    ) -> (&'a mut ArmSamples<T>, Option<&'a mut ArmSamples<T>>) {
        (samples, None)
    }
}

/// The constraints hold on both sides of the plane of the elbows, forward kinematics only below it.
pub(super) fn check_side<T: Real>(
    robot: &Robot<T>,
    nominal_arms: [&NominalArm<T>; 3],
    means: &[Means<T>; 3],
) -> Result<(), Refusal> {
    if T::is_below(robot, nominal_arms, means) {
        Ok(())
    } else {
        Err(Refusal::WrongSide)
    }
}

/// Whether the mean measured point is below the plane of the mean elbows.
pub(crate) fn is_below<T: Real>(
    robot: &Robot<T>,
    nominal_arms: [&NominalArm<T>; 3],
    means: &[Means<T>; 3],
) -> bool {
    let mut elbows = [Vector3::zeros(); 3];
    let mut point = Vector3::zeros();
    for (((elbow, arm), means), nominal) in elbows
        .iter_mut()
        .zip(robot.arms())
        .zip(means)
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
    // Products of two lengths only: with any unit of length they neither overflow nor vanish.
    let [nominal, ..] = nominal_arms;
    let side = normal.dot(&((point - first) * nominal.inverse_scale()));
    let above = if normal.dot(&robot.up()) < T::ZERO {
        -side
    } else {
        side
    };
    above < T::ZERO
}
