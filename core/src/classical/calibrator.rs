use super::samples::{StoredArmSamples, StoredError};
use crate::Real;
use crate::calibration::{RobotCalibrator, Settings, nominal_arms};
use crate::robot::{ArmIndex, Robot};
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
        sample
            .check(self.robot().drive())
            .map_err(StoredError::Sample)?;
        for ((stored, q), arm) in self.arms().iter().zip(sample.joints).zip(ArmIndex::ALL) {
            stored.check(&sample.position, q, arm)?;
        }
        for ((stored, q), arm) in self.arms.iter_mut().zip(sample.joints).zip(ArmIndex::ALL) {
            stored.add(&sample.position, q, arm)?;
        }
        Ok(())
    }
}
