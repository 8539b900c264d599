use super::samples::{StoredArmSamples, StoredError};
use crate::Real;
use crate::calibration::{RobotCalibrator, Settings, nominal_arms};
use crate::robot::{ArmIndex, Robot};
use crate::robust::{Loss, RobustOutcome, RobustRefusal, WeighedSample, fit, places};
use crate::samples::Sample;

/// Calibration of a robot from up to `N` stored samples.
pub type StoredCalibrator<T, const N: usize> = RobotCalibrator<T, StoredArmSamples<T, N>>;

impl<T: Real, const N: usize> StoredCalibrator<T, N> {
    /// Without samples; see [`Calibrator::new`](crate::Calibrator::new).
    pub fn new(robot: &Robot<T>, settings: &Settings<T>) -> Self {
        Self::of_arms(
            settings,
            nominal_arms(robot, settings).map(StoredArmSamples::new),
        )
    }

    /// Stores one sample.
    ///
    /// # Errors
    /// A faulty number or a full store; nothing is stored.
    pub fn add(&mut self, sample: &Sample<T>) -> Result<(), StoredError> {
        sample.check().map_err(StoredError::Sample)?;
        for ((stored, q), arm) in self.arms().iter().zip(sample.joints).zip(ArmIndex::ALL) {
            stored.check(&sample.position, q, arm)?;
        }
        for ((stored, q), arm) in self.arms.iter_mut().zip(sample.joints).zip(ArmIndex::ALL) {
            stored.add(&sample.position, q, arm)?;
        }
        Ok(())
    }
}

impl<T: Real, const N: usize> StoredCalibrator<T, N> {
    /// As [`robust_fit`](crate::robust::robust_fit), of the stored samples. Only this form can: the constant-memory one has
    /// no sample left to weigh again.
    ///
    /// # Errors
    /// As [`robust_fit`](crate::robust::robust_fit).
    pub fn solve_robust(
        &self,
        loss: Loss,
        work: &mut [WeighedSample<T>],
    ) -> Result<RobustOutcome<T>, RobustRefusal> {
        let [first, second, third] = self.arms();
        let work = places(work, first.len())?;
        let stored = first
            .samples()
            .iter()
            .zip(second.samples())
            .zip(third.samples());
        for (place, ((one, two), three)) in work.iter_mut().zip(stored) {
            *place = WeighedSample::new([*one, *two, *three]);
        }
        let nominal_arms = [first.nominal(), second.nominal(), third.nominal()];
        fit(self.settings(), nominal_arms, loss, work)
    }
}
