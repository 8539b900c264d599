mod forgetting;

use super::arm::{ArmSolver, Progress, enough_samples};
use super::outcome::RobotOutcome;
use super::problem::ArmProblem;
use super::refusal::Refusal;
use super::{ArmOutcome, Settings};
use crate::samples::{
    ArmFactor, MergeError, Reference, Sample, SampleError, StoredArmSamples, StoredError, Waiting,
};
use crate::{ArmIndex, Real, Robot};
use nalgebra::Vector3;

/// The samples of a robot's three arms and what the calibration assumes.
///
/// Use it as [`Calibrator`] (constant memory) or [`StoredCalibrator`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotCalibrator<T: Real, P> {
    settings: Settings<T>,
    arms: [P; 3],
    waiting: Waiting<T>,
}

/// Calibration of a robot in constant memory: every sample goes into three 13 × 13 triangular
/// factors and is forgotten. Samples added one by one wait until they are a block of four, or until
/// they are needed; each factor takes in its block at another sample than the others, so that
/// every call of [`add`](Self::add) is short.
///
/// ```
/// use delta_cal::{Calibrator, Sample, Settings, SymmetricRobot};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let truth = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..nominal }.robot()?;
///
/// let mut calibrator = Calibrator::new(&nominal.robot()?, &Settings::default());
/// for k in 0..20 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     calibrator.add(&Sample { joints, position: truth.forward(&joints)? })?;
/// }
/// let outcome = calibrator.solve()?;
/// assert!((outcome.robot.arms()[2].lb() - 479.1).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
pub type Calibrator<T> = RobotCalibrator<T, ArmFactor<T>>;

/// Calibration of a robot from up to `N` stored samples.
pub type StoredCalibrator<T, const N: usize> = RobotCalibrator<T, StoredArmSamples<T, N>>;

/// A point of the workspace from which positions are counted: the platform at equal joint angles.
#[inline(never)]
fn workspace_centre<T: Real>(robot: &Robot<T>) -> Vector3<T> {
    for degrees in [20.0_f32, 0.0, 45.0, -20.0, 70.0] {
        let q = T::from_f64(f64::from(degrees)) * (T::PI / T::from_f64(180.0));
        if let Ok(x) = robot.forward(&[q; 3]) {
            return x;
        }
    }
    let [first, second, third] = robot.arms();
    (first.d() + second.d() + third.d() - robot.up() * first.lb()) / T::from_f64(3.0)
}

/// What the three arms' samples are expressed against.
struct References<'a, T: Real> {
    robot: &'a Robot<T>,
    centre: Vector3<T>,
    settings: &'a Settings<T>,
}

impl<'a, T: Real> References<'a, T> {
    fn new(robot: &'a Robot<T>, settings: &'a Settings<T>) -> Self {
        Self {
            robot,
            centre: workspace_centre(robot),
            settings,
        }
    }

    fn of(&self, arm: ArmIndex) -> Reference<T> {
        Reference::new(self.robot.arm(arm), &self.centre, self.settings.noise)
    }
}

/// What a robot's samples are expressed against.
pub(super) fn references<T: Real>(robot: &Robot<T>, settings: &Settings<T>) -> [Reference<T>; 3] {
    let references = References::new(robot, settings);
    ArmIndex::ALL.map(|arm| references.of(arm))
}

impl<T: Real> Calibrator<T> {
    /// Without samples; `robot` is the robot before calibration, the nominal of the tolerance and
    /// the start of the iteration.
    #[inline(never)]
    pub fn new(robot: &Robot<T>, settings: &Settings<T>) -> Self {
        let references = References::new(robot, settings);
        // Not by `map`: the three factors would be built beside their place and moved.
        Self {
            settings: *settings,
            arms: [
                ArmFactor::new(references.of(ArmIndex::First)),
                ArmFactor::new(references.of(ArmIndex::Second)),
                ArmFactor::new(references.of(ArmIndex::Third)),
            ],
            waiting: Waiting::none(),
        }
    }

    /// Takes in one sample. It waits for three others, which then go into the factors together.
    ///
    /// # Errors
    /// A faulty number; nothing is taken in.
    pub fn add(&mut self, sample: &Sample<T>) -> Result<(), SampleError> {
        self.check(sample)?;
        self.waiting.push(sample);
        if let Some(arm) = self.waiting.due() {
            self.take_in_block(arm);
        }
        Ok(())
    }

    /// Whether [`add`](Self::add) would take the sample.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn check(&self, sample: &Sample<T>) -> Result<(), SampleError> {
        sample.check()?;
        for (factor, arm) in self.arms.iter().zip(ArmIndex::ALL) {
            factor.reference().check(&sample.position, arm)?;
        }
        Ok(())
    }

    /// Takes the waiting samples into the factors. Everything that needs them does so itself, but
    /// for [`arms`](Self::arms), which only looks.
    pub fn flush(&mut self) {
        self.take_in_waiting();
    }

    /// Takes in many samples; cheaper than one by one.
    ///
    /// # Errors
    /// The first faulty sample's position in the sequence, and its fault; nothing is taken in.
    pub fn add_many(&mut self, samples: &[Sample<T>]) -> Result<(), (usize, SampleError)> {
        for (index, sample) in samples.iter().enumerate() {
            sample.check().map_err(|error| (index, error))?;
        }
        self.flush();
        let mut updated = self.arms;
        for (factor, arm) in updated.iter_mut().zip(ArmIndex::ALL) {
            let arm_samples = samples
                .iter()
                .map(|sample| (&sample.position, sample.joints[arm.index()]));
            factor.add_many(arm_samples, arm)?;
        }
        self.arms = updated;
        Ok(())
    }

    /// Adds everything that another calibrator of the same robot and noise has seen.
    ///
    /// # Errors
    /// [`MergeError::DifferentReference`]; nothing is merged.
    pub fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        self.flush();
        let mut other = *other;
        other.flush();
        let mut merged = self.arms;
        for (factor, other) in merged.iter_mut().zip(&other.arms) {
            factor.merge(other)?;
        }
        self.arms = merged;
        Ok(())
    }

    /// Lets everything seen so far count λ times as much; see [`ArmFactor::forget`].
    pub fn forget(&mut self, lambda: T) {
        self.flush();
        for factor in &mut self.arms {
            factor.forget(lambda);
        }
    }
}

impl<T: Real, const N: usize> StoredCalibrator<T, N> {
    /// Without samples; see [`Calibrator::new`].
    pub fn new(robot: &Robot<T>, settings: &Settings<T>) -> Self {
        let references = References::new(robot, settings);
        Self {
            settings: *settings,
            arms: ArmIndex::ALL.map(|arm| StoredArmSamples::new(references.of(arm))),
            waiting: Waiting::none(),
        }
    }

    /// Stores one sample.
    ///
    /// # Errors
    /// A faulty number or a full store; nothing is stored.
    pub fn add(&mut self, sample: &Sample<T>) -> Result<(), StoredError> {
        sample.check().map_err(StoredError::Sample)?;
        for ((stored, q), arm) in self.arms.iter().zip(sample.joints).zip(ArmIndex::ALL) {
            stored.check(&sample.position, q, arm)?;
        }
        for ((stored, q), arm) in self.arms.iter_mut().zip(sample.joints).zip(ArmIndex::ALL) {
            stored.add(&sample.position, q, arm)?;
        }
        Ok(())
    }
}

impl<T: Real, P: ArmProblem<T>> RobotCalibrator<T, P> {
    /// Of three arms' samples that are there already.
    pub(super) fn of_arms(settings: &Settings<T>, arms: [P; 3]) -> Self {
        Self {
            settings: *settings,
            arms,
            waiting: Waiting::none(),
        }
    }

    /// The robot before calibration.
    pub fn robot(&self) -> Robot<T> {
        let [first, second, third] = &self.arms;
        Robot::of_valid([first, second, third].map(|problem| *problem.reference().arm()))
    }

    /// What the calibration assumes.
    pub const fn settings(&self) -> &Settings<T> {
        &self.settings
    }

    /// The three arms' samples; those that still wait for [`flush`](Calibrator::flush) are not
    /// among them.
    pub const fn arms(&self) -> &[P; 3] {
        &self.arms
    }

    /// Samples taken in.
    pub fn samples(&self) -> u64 {
        let [first, ..] = &self.arms;
        first.samples() + self.waiting.waiting_for(ArmIndex::First) as u64
    }

    /// Whatever waits goes into the arms' problems.
    #[inline(never)]
    fn take_in_waiting(&mut self) {
        for arm in ArmIndex::ALL {
            self.take_in_waiting_of(arm);
        }
    }

    pub(super) fn take_in_waiting_of(&mut self, arm: ArmIndex) {
        while self.waiting.waiting_for(arm) > 0 {
            self.take_in_block(arm);
        }
    }

    #[inline(never)]
    fn take_in_block(&mut self, arm: ArmIndex) {
        if let Some(problem) = self.arms.get_mut(arm.index()) {
            problem.absorb_waiting(&self.waiting, arm);
        }
        self.waiting.take(arm);
    }

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
    pub fn new<P: ArmProblem<T>>(calibrator: &mut RobotCalibrator<T, P>) -> Result<Self, Refusal> {
        calibrator.take_in_waiting();
        let [first, ..] = &calibrator.arms;
        enough_samples(first, ArmIndex::First, &calibrator.settings)?;
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
    pub fn step<P: ArmProblem<T>>(
        &mut self,
        calibrator: &RobotCalibrator<T, P>,
    ) -> Result<Progress, Refusal> {
        let [first, second, third] = &calibrator.arms;
        let (problem, next) = match self.arm {
            ArmIndex::First => (first, Some(ArmIndex::Second)),
            ArmIndex::Second => (second, Some(ArmIndex::Third)),
            ArmIndex::Third => (third, None),
        };
        match &mut self.solver {
            None => {
                self.begin(problem, &calibrator.settings)?;
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

    fn begin<P: ArmProblem<T>>(
        &mut self,
        problem: &P,
        settings: &Settings<T>,
    ) -> Result<(), Refusal> {
        let solver = self.solver.insert(ArmSolver::unstarted(self.arm, settings));
        let begun = solver.begin(problem);
        if begun.is_err() {
            self.solver = None;
        }
        begun
    }

    /// A function of its own, so that its large temporaries do not share a stack with the steps.
    #[inline(never)]
    fn finish<P: ArmProblem<T>>(&mut self, problem: &P) -> Result<(), Refusal> {
        let solver = self.solver.as_ref().ok_or(Refusal::Unfinished)?;
        let outcome = solver.outcome(problem);
        if let (Some(place), Ok(outcome)) = (self.outcomes.get_mut(self.arm.index()), &outcome) {
            *place = Some(*outcome);
        }
        outcome.map(|_| ())
    }

    /// The constraints hold on both sides of the elbows' plane, forward kinematics only below it:
    /// the mean measured point must lie below the plane of the mean elbows.
    #[inline(never)]
    fn check_side<P: ArmProblem<T>>(
        &self,
        calibrator: &RobotCalibrator<T, P>,
    ) -> Result<(), Refusal> {
        let robot = self.robot()?;
        let mut elbows = [Vector3::zeros(); 3];
        let mut point = Vector3::zeros();
        for ((elbow, arm), problem) in elbows.iter_mut().zip(robot.arms()).zip(&calibrator.arms) {
            let (means, reference) = (problem.means(), problem.reference());
            *elbow = arm.d() + arm.basis().u * means.cosine + arm.basis().v * means.sine;
            point = means.x * reference.scale() + reference.centre();
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
