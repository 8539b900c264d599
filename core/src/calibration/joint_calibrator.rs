use super::calibrator::workspace_centre;
use super::settings::Settings;
use crate::Real;
use crate::robot::Robot;
use crate::samples::{JointFactor, LeftOver, MergeError, Sample, SampleError, WhitenedSample};
use crate::snapshot::state;

/// Calibration of all 24 parameters together, in constant memory and at the Cramér–Rao bound: the
/// errors of the three closures of a sample share the noise of its position, and
/// [`JointFactor`] weighs them by their whole covariance.
///
/// [`Calibrator`](super::Calibrator), which takes the arms for independent, costs a third of this and
/// its errors are 1.05 to 1.9 times as large, depending on the robot's proportions.
///
/// Samples added one by one go in by pairs, half of the work at the second sample of a pair and half at
/// the next, so that every call of [`add`](Self::add) is short.
///
/// ```
/// use delta_cal::{ArmIndex, Noise, Parameter, Sample, Settings, SymmetricRobot};
/// use delta_cal::calibration::JointCalibrator;
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 200.0, platform_radius: 45.0, upper_arm: 235.0, forearm: 800.0 };
/// let truth = SymmetricRobot { upper_arm: 235.7, forearm: 799.1, ..nominal }.robot()?;
///
/// let settings = Settings::default().with_noise(Noise::new(0.02, 0.0)?);
/// let mut calibrator = JointCalibrator::new(&nominal.robot()?, &settings);
/// for k in 0..20 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     calibrator.add(&Sample { joints, position: truth.forward(&joints)? })?;
/// }
/// let outcome = calibrator.solve()?;
/// assert!((outcome.robot.arms()[2].lb() - 799.1).abs() < 1e-6);
/// assert!(outcome.standard_deviation(ArmIndex::Third, Parameter::Lb).is_some_and(|sigma| sigma < 1.0));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointCalibrator<T: Real> {
    settings: Settings<T>,
    factor: JointFactor<T>,
    /// A pair and the sample after it, whitened as they came; the first `count` are there.
    waiting: [WhitenedSample<T>; 3],
    count: usize,
    /// What the pair's first rows left, if they are in the factor.
    begun: bool,
    left: LeftOver<T, 2>,
}

state!(
    JointCalibrator<T>:
    factor: JointFactor<T>,
    waiting: [WhitenedSample<T>; 3],
    count: usize,
    begun: bool,
    left: LeftOver<T, 2>,
);

impl<T: Real> JointCalibrator<T> {
    /// Without samples; `robot` is the robot before calibration, the nominal of the tolerance and
    /// the start of the iteration.
    #[inline(never)]
    pub fn new(robot: &Robot<T>, settings: &Settings<T>) -> Self {
        Self::of_factor(
            JointFactor::new(robot, &workspace_centre(robot), settings.noise),
            settings,
        )
    }

    /// With samples that are in a factor. Its noise is that of the calibration, whatever the settings
    /// say.
    pub fn of_factor(factor: JointFactor<T>, settings: &Settings<T>) -> Self {
        Self {
            settings: Settings {
                noise: factor.noise().copied(),
                ..*settings
            },
            factor,
            waiting: [WhitenedSample::vacant(); 3],
            count: 0,
            begun: false,
            left: [[T::ZERO; 2]; 25],
        }
    }

    /// Takes in one sample.
    ///
    /// # Errors
    /// A faulty number; nothing is taken in.
    pub fn add(&mut self, sample: &Sample<T>) -> Result<(), SampleError> {
        self.check(sample)?;
        self.push(sample);
        Ok(())
    }

    pub(crate) fn push(&mut self, sample: &Sample<T>) {
        if let Some(place) = self.waiting.get_mut(self.count) {
            *place = self.factor.prepare(sample);
            self.count += 1;
        }
        if self.begun {
            self.finish_pair();
        } else if self.completes_pair() {
            let [pair @ .., _] = &self.waiting;
            self.left = self.factor.absorb_first(pair);
            self.begun = true;
        }
    }

    /// Whether a pair waits of which nothing is in the factor.
    fn completes_pair(&self) -> bool {
        self.count == 2
    }

    /// Whether a part of a pair is in the factor.
    pub(crate) const fn has_begun(&self) -> bool {
        self.begun
    }

    /// Whether the next sample begins a pair's way into the factor.
    pub(crate) const fn begins_next(&self) -> bool {
        !self.begun && self.count == 1
    }

    #[inline(never)]
    fn finish_pair(&mut self) {
        let [pair @ .., _] = &self.waiting;
        self.factor.absorb_others::<2, 4, 6>(pair, &self.left);
        self.begun = false;
        let [first, _, third] = &mut self.waiting;
        *first = *third;
        self.count = self.count.saturating_sub(2);
    }

    /// Whether [`add`](Self::add) would take the sample.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn check(&self, sample: &Sample<T>) -> Result<(), SampleError> {
        self.factor.check(sample)
    }

    /// Takes the waiting samples into the factor. Everything that needs them does so itself, but for
    /// [`factor`](Self::factor), which only looks.
    pub fn flush(&mut self) {
        if self.begun {
            self.finish_pair();
        }
        let [first, ..] = &self.waiting;
        if self.count > 0 {
            self.factor.absorb_one(first);
            self.count = 0;
        }
    }

    /// Takes in many samples; cheaper than one by one.
    ///
    /// # Errors
    /// The first faulty sample's position in the sequence, and its fault; nothing is taken in.
    pub fn add_many(&mut self, samples: &[Sample<T>]) -> Result<(), (usize, SampleError)> {
        self.flush();
        self.factor.add_many(samples)
    }

    /// Adds everything that another calibrator of the same robot and noise has seen.
    ///
    /// # Errors
    /// [`MergeError::DifferentNominal`]; nothing is merged.
    pub fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        self.flush();
        let mut other = *other;
        other.flush();
        self.factor.merge(&other.factor)
    }

    /// Lets everything seen so far count λ times as much; see [`JointFactor::forget`].
    pub fn forget(&mut self, lambda: T) {
        self.flush();
        self.factor.forget(lambda);
    }

    /// The robot before calibration.
    pub fn robot(&self) -> Robot<T> {
        Robot::of_valid(
            self.factor
                .nominal_arms()
                .each_ref()
                .map(|nominal| *nominal.arm()),
        )
    }

    /// What the calibration assumes.
    pub const fn settings(&self) -> &Settings<T> {
        &self.settings
    }

    /// The samples; those that still wait for [`flush`](Self::flush) are not among them.
    pub const fn factor(&self) -> &JointFactor<T> {
        &self.factor
    }

    pub(crate) const fn factor_mut(&mut self) -> &mut JointFactor<T> {
        &mut self.factor
    }

    /// Samples taken in.
    pub fn samples(&self) -> u64 {
        self.factor.samples() + self.count as u64
    }
}

#[cfg(test)]
mod tests;
