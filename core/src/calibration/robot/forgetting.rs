use super::Calibrator;
use crate::samples::{BLOCK, Memory, Sample, SampleError};
use crate::{ArmIndex, Real};

impl<T: Real> Calibrator<T> {
    /// Takes in one sample and lets those before it fade, for a robot that changes slowly, as one
    /// that warms up. An arm forgets when it takes in a block of four, all that it then holds by λ to
    /// the power of the samples that came in since it last did. The prior of a stated tolerance is not
    /// forgotten.
    ///
    /// A covariance of such an estimate is that of N + 1 samples, though its noise is that of
    /// 2N + 1: the rest, a factor of √2 in σ, is left for the change of the robot.
    ///
    /// ```
    /// use delta_cal::{Calibrator, Memory, Sample, Settings, SymmetricRobot};
    /// # fn main() -> Result<(), Box<dyn core::error::Error>> {
    /// let robot = |forearm| SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm };
    /// let memory = Memory::new(20.0)?;
    /// let mut calibrator = Calibrator::new(&robot(480.0).robot()?, &Settings::default());
    /// for k in 0..400 {
    ///     let t = f64::from(k);
    ///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
    ///     // The forearms grow by a micrometre a sample.
    ///     let truth = robot(480.0 + 0.001 * t).robot()?;
    ///     calibrator.add_forgetting(&Sample { joints, position: truth.forward(&joints)? }, &memory)?;
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
        memory: &Memory<T>,
    ) -> Result<(), SampleError> {
        self.check(sample)?;
        self.waiting.push(sample);
        let due = self.waiting.due();
        for (factor, arm) in self.arms.iter_mut().zip(ArmIndex::ALL) {
            // Samples that a solve did not leave waiting are to be forgotten too.
            if due == Some(arm) || factor.recent() >= 2 * BLOCK as u64 {
                factor.forget(memory.after(factor.recent()));
            }
        }
        if let Some(arm) = due {
            self.take_in_block(arm);
        }
        Ok(())
    }
}
