//! The calibrators from complete positions: samples and solver in one object.

use super::minimizer::Progress;
use super::outcome::{ArmOutcome, JointOutcome, RobotOutcome};
use super::parts::{Samples, Solver};
use super::refusal::Refusal;
use super::settings::Settings;
use crate::robot::{ArmIndex, Robot};
use crate::samples::{Forgetting, MergeError, Sample, SampleError};
use crate::{Busy, Real};
use core::fmt::Debug;
use estimators::Parts;

/// Each arm's eight parameters from that arm's closures (the paper's IKM method): a third of the cost of [`Joint`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ikm;

/// All 24 parameters jointly from the closures of the three arms, which share the position noise: the smallest error
/// that the measurements allow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Joint;

/// How a [`Calibrator`] estimates the parameters: [`Ikm`] or [`Joint`], selected at compile time.
pub trait Estimator: Parts {
    /// The result type.
    type Outcome<T: Real>: Clone + Debug + PartialEq;

    /// The calibrated robot of an outcome.
    fn robot<T: Real>(outcome: &Self::Outcome<T>) -> &Robot<T>;

    /// The result for one arm.
    fn arm<T: Real>(outcome: &Self::Outcome<T>, arm: ArmIndex) -> ArmOutcome<T>;
}

impl Estimator for Ikm {
    type Outcome<T: Real> = RobotOutcome<T>;

    fn robot<T: Real>(outcome: &RobotOutcome<T>) -> &Robot<T> {
        &outcome.robot
    }

    fn arm<T: Real>(outcome: &RobotOutcome<T>, arm: ArmIndex) -> ArmOutcome<T> {
        let [first, second, third] = &outcome.arms;
        match arm {
            ArmIndex::First => first.clone(),
            ArmIndex::Second => second.clone(),
            ArmIndex::Third => third.clone(),
        }
    }
}

impl Estimator for Joint {
    type Outcome<T: Real> = JointOutcome<T>;

    fn robot<T: Real>(outcome: &JointOutcome<T>) -> &Robot<T> {
        &outcome.robot
    }

    fn arm<T: Real>(outcome: &JointOutcome<T>, arm: ArmIndex) -> ArmOutcome<T> {
        outcome.arm(arm)
    }
}

/// Calibrates each arm separately, from complete positions and in constant memory.
///
/// ```
/// use delta_cal::{IkmCalibrator, Progress, Sample, Settings, SymmetricRobot};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let truth = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..nominal }.robot()?;
///
/// let mut calibrator = IkmCalibrator::new(&nominal.robot()?, &Settings::default());
/// for k in 0..20 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     calibrator.add(&Sample { joints, position: truth.forward(&joints)? })?;
/// }
/// calibrator.solve()?;
/// while calibrator.step() == Progress::Working {
///     // ... the control loop's other work ...
/// }
/// let outcome = calibrator.outcome()?;
/// assert!((outcome.robot.arms()[2].lb() - 479.1).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
pub type IkmCalibrator<T> = Calibrator<T, Ikm>;

/// Calibrates all 24 parameters jointly, from complete positions, in constant memory and at the Cramér–Rao bound: the
/// errors of a sample's three closures share the position noise, and one factor weights them by their full covariance.
///
/// [`IkmCalibrator`], which treats the arms as independent, costs a third as much; its errors are 1.05 to 1.9 times as
/// large, depending on the robot's proportions.
/// The calls are those of [`IkmCalibrator`]; of its outcome see [`JointOutcome`].
pub type JointCalibrator<T> = Calibrator<T, Joint>;

/// Calibrates a robot from complete positions: [`IkmCalibrator`] or [`JointCalibrator`].
///
/// It owns the accumulated samples and the solver. Call [`add`](Self::add) for each sample, [`solve`](Self::solve),
/// then [`step`](Self::step) until it has finished: each call is short enough to interleave with a control loop. The
/// [`outcome`](Self::outcome) stays available until the samples change; they cannot change during a solve.
#[derive(Debug, Clone)]
pub struct Calibrator<T: Real, E: Estimator> {
    pub(crate) samples: E::Samples<T>,
    solver: E::Solver<T>,
    phase: Phase,
}

/// Equal if both hold the same samples and the same settings.
impl<T: Real, E: Estimator> PartialEq for Calibrator<T, E> {
    fn eq(&self, other: &Self) -> bool {
        self.samples == other.samples
    }
}

/// The state of a calibrator.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Phase {
    Collecting,
    Solving,
    Finished,
    Refused(Refusal),
}

impl Phase {
    /// Starts a solve unless one is in progress or finished.
    pub(crate) fn start(
        &mut self,
        begin: impl FnOnce() -> Result<(), Refusal>,
    ) -> Result<(), Refusal> {
        match *self {
            Self::Solving | Self::Finished => Ok(()),
            Self::Refused(refusal) => Err(refusal),
            Self::Collecting => {
                let begun = begin();
                *self = begun.map_or_else(Self::Refused, |()| Self::Solving);
                begun
            }
        }
    }

    /// After a step of a solve in progress.
    pub(crate) fn stepped(&mut self, step: Result<Progress, Refusal>) -> Progress {
        debug_assert!(self.solving());
        match step {
            Ok(Progress::Working) => return Progress::Working,
            Ok(Progress::Finished) => *self = Self::Finished,
            Err(refusal) => *self = Self::Refused(refusal),
        }
        Progress::Finished
    }

    /// The outcome of a finished solve.
    pub(crate) fn outcome<O>(self, outcome: Option<&O>) -> Result<&O, Refusal> {
        match self {
            Self::Collecting | Self::Solving => Err(Refusal::Unfinished),
            Self::Refused(refusal) => Err(refusal),
            Self::Finished => outcome.ok_or(Refusal::Unfinished),
        }
    }

    pub(crate) const fn solving(self) -> bool {
        matches!(self, Self::Solving)
    }

    pub(crate) const fn finished(self) -> bool {
        matches!(self, Self::Finished | Self::Refused(_))
    }
}

impl<T: Real, E: Estimator> Calibrator<T, E> {
    /// A calibrator without samples; `robot` is the uncalibrated robot: the nominal values of the tolerance and the
    /// start of the iteration.
    #[inline(always)]
    pub fn new(robot: &Robot<T>, settings: &Settings<T>) -> Self {
        Self {
            samples: E::Samples::new(robot, settings),
            solver: E::Solver::vacant(),
            phase: Phase::Collecting,
        }
    }

    /// Adds one sample in bounded time. Discards the outcome of earlier samples.
    ///
    /// # Errors
    /// An invalid number, or [`SampleError::Busy`]; the sample is not added.
    pub fn add(&mut self, sample: &Sample<T>) -> Result<(), SampleError> {
        self.samples.check(sample)?;
        self.idle()?.push(sample);
        Ok(())
    }

    /// Adds one sample and lets earlier ones fade, for a robot that changes slowly, for example as it warms up. They
    /// are forgotten in blocks of four (jointly: in pairs): everything held is then multiplied by λ to the power of the
    /// number of samples added so since. Samples from [`add`](Self::add) make no other older. The prior of a stated tolerance is not forgotten.
    ///
    /// The reported covariance is that of N + 1 samples, although the estimate's noise is that of 2N + 1: the
    /// difference, a factor of √2 in σ, is a margin for the robot's change.
    ///
    /// ```
    /// use delta_cal::stream::Forgetting;
    /// use delta_cal::{JointCalibrator, Sample, Settings, SymmetricRobot};
    /// # fn main() -> Result<(), Box<dyn core::error::Error>> {
    /// let robot = |forearm| SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm };
    /// let forgetting = Forgetting::new(20.0)?;
    /// let mut calibrator = JointCalibrator::new(&robot(480.0).robot()?, &Settings::default());
    /// for k in 0..400 {
    ///     let t = f64::from(k);
    ///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
    ///     // The forearms grow by a micrometre per sample.
    ///     let truth = robot(480.0 + 0.001 * t).robot()?;
    ///     calibrator.add_forgetting(&Sample { joints, position: truth.forward(&joints)? }, &forgetting)?;
    /// }
    /// // Without forgetting, the estimate would lag by half of all samples, 0.2 mm.
    /// let behind = 480.399 - calibrator.calibrate()?.robot.arms()[0].lb();
    /// assert!(behind.abs() < 0.1, "{behind}");
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// Same as [`add`](Self::add).
    pub fn add_forgetting(
        &mut self,
        sample: &Sample<T>,
        forgetting: &Forgetting<T>,
    ) -> Result<(), SampleError> {
        self.samples.check(sample)?;
        self.idle()?.push_forgetting(sample, forgetting);
        Ok(())
    }

    /// Checks that a sample's numbers are usable.
    ///
    /// # Errors
    /// The fault.
    pub fn check(&self, sample: &Sample<T>) -> Result<(), SampleError> {
        self.samples.check(sample)
    }

    /// Adds many samples; cheaper than one at a time. Discards the outcome of earlier samples.
    ///
    /// # Errors
    /// The index of the first invalid sample and its fault, or 0 and [`SampleError::Busy`]. Nothing has changed.
    pub fn add_many(&mut self, samples: &[Sample<T>]) -> Result<(), (usize, SampleError)> {
        for (index, sample) in samples.iter().enumerate() {
            self.check(sample).map_err(|error| (index, error))?;
        }
        let own = self.idle().map_err(|busy| (0, busy.into()))?;
        own.flush();
        own.take_in(samples);
        Ok(())
    }

    /// Adds everything that another calibrator of the same robot and noise has accumulated. Discards the outcome.
    ///
    /// # Errors
    /// [`MergeError`]; nothing is merged, and an outcome stays.
    pub fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        self.check_idle()?;
        self.samples.flush();
        self.samples.merge(&other.samples)?;
        self.stop();
        Ok(())
    }

    /// Multiplies the weight of all samples so far by λ, at least 0 and less than 1, and discards their outcome; any
    /// other number forgets nothing, and an outcome stays. The prior of a stated tolerance is not forgotten.
    ///
    /// # Errors
    /// [`Busy`] during a solve.
    pub fn forget(&mut self, lambda: T) -> Result<(), Busy> {
        self.check_idle()?;
        self.samples.flush();
        if lambda >= T::ZERO && lambda < T::ONE {
            self.samples.forget(lambda);
            self.stop();
        }
        Ok(())
    }

    /// Absorbs samples that are waiting to complete a block. [`solve`](Self::solve) does so itself; a control loop with
    /// little time for that call can make this one a cycle earlier. Nothing is waiting during a solve.
    pub fn flush(&mut self) {
        self.samples.flush();
    }

    /// Starts a solve; does nothing if one is in progress or finished.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`], or the refusal already known for these samples.
    pub fn solve(&mut self) -> Result<(), Refusal> {
        self.phase.start(|| {
            self.samples.flush();
            self.solver.begin(&self.samples)
        })
    }

    /// One short step of the solve started by [`solve`](Self::solve); does nothing once finished.
    pub fn step(&mut self) -> Progress {
        if !self.solving() {
            return Progress::Finished;
        }
        self.phase.stepped(self.solver.step(&self.samples))
    }

    /// The calibrated robot, or the reason for refusal.
    ///
    /// # Errors
    /// A [`Refusal`]: keep the robot's current parameters. [`Refusal::Unfinished`] before the last step.
    pub fn outcome(&self) -> Result<&E::Outcome<T>, Refusal> {
        self.phase.outcome(E::outcome(&self.solver))
    }

    /// Runs the whole solve at once, if there is time for it.
    ///
    /// # Errors
    /// Same as [`outcome`](Self::outcome).
    pub fn calibrate(&mut self) -> Result<E::Outcome<T>, Refusal> {
        self.solve()?;
        while self.step() == Progress::Working {}
        self.outcome().cloned()
    }

    /// Aborts a solve and discards the outcome. The samples stay.
    pub fn stop(&mut self) {
        self.phase = Phase::Collecting;
    }

    /// Discards the samples and everything solved from them: as new, for the same uncalibrated robot.
    pub fn reset(&mut self) {
        self.samples.reset();
        self.solver = E::Solver::vacant();
        self.stop();
    }

    /// Whether a solve is in progress, during which no sample is accepted.
    pub const fn solving(&self) -> bool {
        self.phase.solving()
    }

    /// Whether a solve has finished and no sample was added since: there is an outcome or a refusal.
    pub const fn finished(&self) -> bool {
        self.phase.finished()
    }

    /// Number of samples added.
    pub fn samples(&self) -> u64 {
        self.samples.count()
    }

    /// The uncalibrated robot.
    pub fn robot(&self) -> Robot<T> {
        self.samples.robot()
    }

    /// What the calibration assumes.
    pub fn settings(&self) -> &Settings<T> {
        self.samples.settings()
    }

    /// The samples, for modification: discards what was solved from them.
    fn idle(&mut self) -> Result<&mut E::Samples<T>, Busy> {
        self.check_idle()?;
        self.stop();
        Ok(&mut self.samples)
    }

    pub(super) const fn check_idle(&self) -> Result<(), Busy> {
        if self.solving() { Err(Busy) } else { Ok(()) }
    }
}

/// The components of an estimator. The trait is sealed.
pub(super) mod estimators {
    use super::{Debug, Estimator, Real, Robot, Samples, Settings, Solver};
    use crate::calibration::arm_samples::ArmSamples;
    use crate::state::State;

    /// Samples, solver, and whatever else the gate needs.
    pub trait Parts: Copy + Debug + PartialEq {
        /// Identifies its snapshots.
        const NUMBER: u8;
        /// The accumulated samples.
        type Samples<T: Real>: Samples<T>;
        /// The solver.
        type Solver<T: Real>: Solver<T, Self::Samples<T>>;
        /// The samples of the separate arms, if `Samples` holds something else.
        type Beside<T: Real>: Clone + Debug + State<T>;

        /// Available after the last step.
        fn outcome<T: Real>(solver: &Self::Solver<T>) -> Option<&<Self as Estimator>::Outcome<T>>
        where
            Self: Estimator;
        /// Without samples.
        fn beside<T: Real>(robot: &Robot<T>, settings: &Settings<T>) -> Self::Beside<T>;
        /// The samples of the separate arms, and `Samples` if that is something else.
        fn arms<'a, T: Real>(
            samples: &'a mut Self::Samples<T>,
            beside: &'a mut Self::Beside<T>,
        ) -> (&'a mut ArmSamples<T>, Option<&'a mut Self::Samples<T>>);
    }
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::cast_precision_loss,
        clippy::cast_sign_loss,
        clippy::unwrap_used
    )]

    use crate::calibration::{IkmCalibrator, JointCalibrator, Settings};
    use crate::fixtures::{sample, with_forearms};
    use crate::samples::Forgetting;

    /// Both kinds of calibrator, sample by sample and with solves in between, after which nothing is waiting: p plain
    /// samples and n that make earlier ones fade are worth p λⁿ + (1 − λⁿ)/(1 − λ), or more by what three blocks are yet
    /// to be forgotten for.
    #[test]
    fn every_sample_fades_whatever_was_left_waiting() {
        let robot = with_forearms(480.0);
        let forgetting = Forgetting::new(19.0_f64).unwrap();
        for (solve_every, plain) in [1, 3, usize::MAX]
            .into_iter()
            .flat_map(|every| [(every, 0), (every, 200)])
        {
            let mut joint = JointCalibrator::new(&robot, &Settings::default());
            let mut apart = IkmCalibrator::new(&robot, &Settings::default());
            for count in 0..plain {
                let sample = sample(&robot, count);
                joint.add(&sample).unwrap();
                apart.add(&sample).unwrap();
            }
            for count in 1..=150_i32 {
                let sample = sample(&robot, plain + count as usize);
                joint.add_forgetting(&sample, &forgetting).unwrap();
                apart.add_forgetting(&sample, &forgetting).unwrap();
                if (count as usize).is_multiple_of(solve_every) {
                    joint.flush();
                    apart.flush();
                }
                let (mut joint, mut apart) = (joint.clone(), apart.clone());
                joint.flush();
                apart.flush();
                let worth = |count: i32| {
                    let faded = 0.95_f64.powi(count.max(0));
                    plain as f64 * faded + (1.0 - faded) / 0.05
                };
                let effective = [
                    joint.samples.factor().effective_samples(),
                    apart.samples.arms()[0].effective_samples(),
                ];
                for (effective, block) in effective.into_iter().zip([6, 12]) {
                    let most = worth(count - block) + f64::from(block);
                    assert!(
                        effective >= worth(count) - f64::from(block) && effective <= most,
                        "{effective}, {} to {most}, every {solve_every}",
                        worth(count)
                    );
                }
            }
        }
    }
}
