use crate::Real;
use crate::calibration::{Calibrator, JointCalibrator};
use crate::robot::ArmIndex;
use crate::samples::{BLOCK, Sample, SampleError};
use core::fmt;

/// Exponential forgetting: a sample that came k samples ago counts λᵏ. The forgetting factor
/// λ = N/(N + 1) is stated by N, the mean age of the samples in the estimate.
///
/// ```text
/// Σ λᵏ = N + 1,   Σ k λᵏ / Σ λᵏ = λ/(1 − λ) = N,   (Σ λᵏ)² / Σ λ²ᵏ = (1 + λ)/(1 − λ) = 2N + 1
/// ```
///
/// The estimate of a parameter that changes at a constant rate lags N samples behind. For a robot that does
/// not change, the variance of the estimate is that of 2N + 1 samples (exponentially weighted least squares;
/// Ljung, System Identification, 1999, section 11.2). With a mean age below a hundred samples the eight
/// parameters of an arm share few samples: the newest determine the combinations that are seldom seen, and
/// less is left of them for the rest. The lag of Lb is twice N at N = 20.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Forgetting<T> {
    mean_age: T,
    factor: T,
}

/// Why a number of samples cannot be the mean age of an estimate that forgets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ForgettingError {
    /// NaN, or less than one sample.
    TooShort,
    /// λ would be known to less than a hundredth of 1 − λ: above 65,536 samples in single precision.
    TooLong,
}

impl fmt::Display for ForgettingError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::TooShort => "the mean age of the samples must be one sample or more",
            Self::TooLong => "the mean age of the samples is too large for this arithmetic: add the samples without forgetting",
        })
    }
}

impl core::error::Error for ForgettingError {}

impl<T: Real> Forgetting<T> {
    /// With the mean age N, in samples.
    ///
    /// # Errors
    /// A number below one, NaN, or too large for the scalar type.
    ///
    /// ```
    /// use delta_cal::stream::Forgetting;
    /// assert_eq!(Forgetting::new(49.0)?.factor(), 0.98);
    /// assert!(Forgetting::new(0.5).is_err() && Forgetting::new(1e6_f32).is_err());
    /// # Ok::<(), delta_cal::stream::ForgettingError>(())
    /// ```
    pub fn new(mean_age: T) -> Result<Self, ForgettingError> {
        if !(mean_age >= T::ONE) {
            return Err(ForgettingError::TooShort);
        }
        if !(mean_age * T::EPSILON <= T::from_f64(1.0 / 128.0)) {
            return Err(ForgettingError::TooLong);
        }
        Ok(Self {
            mean_age,
            factor: mean_age / (mean_age + T::ONE),
        })
    }

    /// N, the mean age of the samples in the estimate, in samples.
    pub fn mean_age(&self) -> T {
        self.mean_age
    }

    /// λ, the forgetting factor.
    pub fn factor(&self) -> T {
        self.factor
    }

    /// λ to the power of a count.
    pub(crate) fn after(&self, samples: u64) -> T {
        let (mut power, mut square, mut rest) = (T::ONE, self.factor, samples);
        while rest > 0 {
            if rest & 1 == 1 {
                power *= square;
            }
            square *= square;
            rest >>= 1;
        }
        power
    }
}

impl<T: Real> Calibrator<T> {
    /// Takes in one sample and lets those before it fade, for a robot that changes slowly, as one
    /// that warms up. An arm forgets when it takes in a block of four, all that it then holds by λ to
    /// the power of the samples that came in since it last did. The prior of a stated tolerance is not
    /// forgotten.
    ///
    /// The reported covariance is that of N + 1 samples, although the estimate's noise is that of 2N + 1:
    /// the difference, a factor of √2 in σ, is left for the change of the robot.
    ///
    /// ```
    /// use delta_cal::{Calibrator, Sample, Settings, SymmetricRobot};
    /// use delta_cal::stream::Forgetting;
    /// # fn main() -> Result<(), Box<dyn core::error::Error>> {
    /// let robot = |forearm| SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm };
    /// let forgetting = Forgetting::new(20.0)?;
    /// let mut calibrator = Calibrator::new(&robot(480.0).robot()?, &Settings::default());
    /// for k in 0..400 {
    ///     let t = f64::from(k);
    ///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
    ///     // The forearms grow by a micrometre a sample.
    ///     let truth = robot(480.0 + 0.001 * t).robot()?;
    ///     calibrator.add_forgetting(&Sample { joints, position: truth.forward(&joints)? }, &forgetting)?;
    /// }
    /// // Without forgetting it would be half of all samples behind, 0.2 mm.
    /// let behind = 480.399 - calibrator.solve()?.robot.arms()[0].lb();
    /// assert!(behind.abs() < 0.1, "{behind}");
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn add_forgetting(
        &mut self,
        sample: &Sample<T>,
        forgetting: &Forgetting<T>,
    ) -> Result<(), SampleError> {
        self.check(sample)?;
        self.waiting.push(sample);
        let due = self.waiting.due();
        for (factor, arm) in self.arms.iter_mut().zip(ArmIndex::ALL) {
            // Samples that a solve did not leave waiting are to be forgotten too.
            if due == Some(arm) || factor.recent() >= 2 * BLOCK as u64 {
                factor.forget(forgetting.after(factor.recent()));
            }
        }
        if let Some(arm) = due {
            self.take_in_block(arm);
        }
        Ok(())
    }
}

impl<T: Real> JointCalibrator<T> {
    /// Takes in one sample and lets those before it fade, as [`Calibrator::add_forgetting`] does; here a
    /// pair at a time.
    ///
    /// ```
    /// use delta_cal::calibration::JointCalibrator;
    /// use delta_cal::stream::Forgetting;
    /// use delta_cal::{Sample, Settings, SymmetricRobot};
    /// # fn main() -> Result<(), Box<dyn core::error::Error>> {
    /// let robot = |forearm| SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm };
    /// let forgetting = Forgetting::new(20.0)?;
    /// let mut calibrator = JointCalibrator::new(&robot(480.0).robot()?, &Settings::default());
    /// for k in 0..400 {
    ///     let t = f64::from(k);
    ///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
    ///     // The forearms grow by a micrometre a sample.
    ///     let truth = robot(480.0 + 0.001 * t).robot()?;
    ///     calibrator.add_forgetting(&Sample { joints, position: truth.forward(&joints)? }, &forgetting)?;
    /// }
    /// // Without forgetting it would be half of all samples behind, 0.2 mm.
    /// let behind = 480.399 - calibrator.solve()?.robot.arms()[0].lb();
    /// assert!(behind.abs() < 0.1, "{behind}");
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn add_forgetting(
        &mut self,
        sample: &Sample<T>,
        forgetting: &Forgetting<T>,
    ) -> Result<(), SampleError> {
        self.check(sample)?;
        let recent = self.factor().recent();
        // Samples that a solve did not leave waiting are to be forgotten too.
        if self.begins_next() || (recent >= BLOCK as u64 && !self.has_begun()) {
            self.factor_mut().forget(forgetting.after(recent));
        }
        self.push(sample);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::Forgetting;
    use crate::calibration::JointCalibrator;
    use crate::{Calibrator, Sample, Settings, SymmetricRobot};

    #[test]
    fn after_so_many_samples_the_factor_is_its_power() {
        let forgetting = Forgetting::new(19.0_f64).unwrap();
        let mut expected = 1.0;
        for count in 0..70 {
            assert!(
                (forgetting.after(count) / expected - 1.0).abs() < 1e-13,
                "{count}"
            );
            expected *= 0.95;
        }
    }

    /// Both kinds of calibrators, sample by sample and with solves in between, after which nothing is left waiting: what
    /// the samples are worth is Σ λᵏ = (1 − λⁿ)/(1 − λ), less at most a block that still waits or is not yet forgotten.
    #[test]
    fn every_sample_fades_whatever_was_left_waiting() {
        let robot = SymmetricRobot {
            base_radius: 194.0,
            platform_radius: 30.0,
            upper_arm: 260.0,
            forearm: 480.0,
        };
        let robot = robot.robot().unwrap();
        let forgetting = Forgetting::new(19.0_f64).unwrap();
        for solve_every in [1, 3, u32::MAX] {
            let mut joint = JointCalibrator::new(&robot, &Settings::default());
            let mut apart = Calibrator::new(&robot, &Settings::default());
            for count in 1..=150_u32 {
                let t = f64::from(count);
                let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
                let position = robot.forward(&joints).unwrap();
                let sample = Sample { joints, position };
                joint.add_forgetting(&sample, &forgetting).unwrap();
                apart.add_forgetting(&sample, &forgetting).unwrap();
                if count % solve_every == 0 {
                    joint.flush();
                    apart.flush();
                }
            }
            joint.flush();
            apart.flush();
            let expected = (1.0 - 0.95_f64.powi(150)) / 0.05;
            let effective = [
                joint.factor().effective_samples(),
                apart.arms()[0].effective_samples(),
            ];
            for (effective, block) in effective.into_iter().zip([2.0, 4.0]) {
                assert!(
                    (effective - expected).abs() <= block,
                    "{effective}, {expected}, every {solve_every}"
                );
            }
        }
    }
}
