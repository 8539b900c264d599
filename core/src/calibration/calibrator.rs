use super::arm_problem::ArmProblem;
use super::settings::Settings;
use crate::Real;
use crate::robot::{ArmIndex, Drive, Robot};
use crate::samples::{
    ArmFactor, MergeError, NominalArm, Sample, SampleError, Waiting, check_weight,
};
use crate::snapshot::state;
use nalgebra::Vector3;

/// The samples of a robot's three arms and what the calibration assumes.
///
/// Use it as [`Calibrator`], which needs constant memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotCalibrator<T: Real, P> {
    settings: Settings<T>,
    pub(crate) arms: [P; 3],
    pub(crate) waiting: Waiting<T>,
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

state!(Calibrator<T>: arms: [ArmFactor<T>; 3], waiting: Waiting<T>);

/// A point of the workspace from which positions are counted: the platform at equal joint angles, or with the
/// carriages a forearm's length up.
#[inline(never)]
pub(super) fn workspace_centre<T: Real>(robot: &Robot<T>) -> Vector3<T> {
    let [first, ..] = robot.arms();
    if robot.drive() == Drive::Linear
        && let Ok(x) = robot.forward(&[first.lb(); 3])
    {
        return x;
    }
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
struct NominalArms<'a, T: Real> {
    robot: &'a Robot<T>,
    centre: Vector3<T>,
    settings: &'a Settings<T>,
}

impl<'a, T: Real> NominalArms<'a, T> {
    fn new(robot: &'a Robot<T>, settings: &'a Settings<T>) -> Self {
        Self {
            robot,
            centre: workspace_centre(robot),
            settings,
        }
    }

    fn of(&self, arm: ArmIndex) -> NominalArm<T> {
        NominalArm::new(self.robot.arm(arm), &self.centre, self.settings.noise)
    }
}

/// What a robot's samples are expressed against.
#[cfg(any(feature = "classical", test))]
pub(crate) fn nominal_arms<T: Real>(
    robot: &Robot<T>,
    settings: &Settings<T>,
) -> [NominalArm<T>; 3] {
    let nominal_arms = NominalArms::new(robot, settings);
    ArmIndex::ALL.map(|arm| nominal_arms.of(arm))
}

impl<T: Real> Calibrator<T> {
    /// Without samples; `robot` is the robot before calibration, the nominal of the tolerance and
    /// the start of the iteration.
    #[inline(never)]
    pub fn new(robot: &Robot<T>, settings: &Settings<T>) -> Self {
        let nominal_arms = NominalArms::new(robot, settings);
        // Not by `map`: the three factors would be built beside their place and moved.
        Self {
            settings: *settings,
            arms: [
                ArmFactor::new(nominal_arms.of(ArmIndex::First)),
                ArmFactor::new(nominal_arms.of(ArmIndex::Second)),
                ArmFactor::new(nominal_arms.of(ArmIndex::Third)),
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

    fn drive(&self) -> Drive {
        let [first, ..] = &self.arms;
        first.nominal().arm().drive()
    }

    /// Whether [`add`](Self::add) would take the sample.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn check(&self, sample: &Sample<T>) -> Result<(), SampleError> {
        sample.check(self.drive())?;
        for (factor, arm) in self.arms.iter().zip(ArmIndex::ALL) {
            factor.nominal().check(&sample.position, arm)?;
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
        let drive = self.drive();
        for (index, sample) in samples.iter().enumerate() {
            sample.check(drive).map_err(|error| (index, error))?;
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

    /// Takes in samples, the sums of whose squared residuals are multiplied by their weights, and sets
    /// the effective number of all samples. For fits that weigh stored samples.
    ///
    /// # Errors
    /// The first faulty sample's position in the sequence, and its fault; nothing is taken in.
    pub fn add_weighted<'a, I>(
        &mut self,
        samples: I,
        effective_samples: T,
    ) -> Result<(), (usize, SampleError)>
    where
        I: IntoIterator<Item = (&'a Sample<T>, T)>,
    {
        self.flush();
        let mut updated = self.arms;
        for (index, (sample, weight)) in samples.into_iter().enumerate() {
            self.check(sample)
                .and_then(|()| check_weight(weight))
                .map_err(|error| (index, error))?;
            for (factor, q) in updated.iter_mut().zip(sample.joints) {
                factor.absorb_weighted(&sample.position, q, weight);
            }
        }
        for factor in &mut updated {
            factor.count_as(effective_samples);
        }
        self.arms = updated;
        Ok(())
    }

    /// Adds everything that another calibrator of the same robot and noise has seen.
    ///
    /// # Errors
    /// [`MergeError::DifferentNominal`]; nothing is merged.
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

impl<T: Real, P: ArmProblem<T>> RobotCalibrator<T, P> {
    /// Of three arms' samples that are there already.
    #[cfg(any(feature = "classical", test))]
    pub(crate) fn of_arms(settings: &Settings<T>, arms: [P; 3]) -> Self {
        Self {
            settings: *settings,
            arms,
            waiting: Waiting::none(),
        }
    }

    /// The robot before calibration.
    pub fn robot(&self) -> Robot<T> {
        let [first, second, third] = &self.arms;
        Robot::of_valid([first, second, third].map(|problem| *problem.nominal().arm()))
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
    pub(super) fn take_in_waiting(&mut self) {
        for arm in ArmIndex::ALL {
            self.take_in_waiting_of(arm);
        }
    }

    pub(crate) fn take_in_waiting_of(&mut self, arm: ArmIndex) {
        while self.waiting.waiting_for(arm) > 0 {
            self.take_in_block(arm);
        }
    }

    #[inline(never)]
    pub(crate) fn take_in_block(&mut self, arm: ArmIndex) {
        if let Some(problem) = self.arms.get_mut(arm.index()) {
            problem.absorb_waiting(&self.waiting, arm);
        }
        self.waiting.take(arm);
    }
}
