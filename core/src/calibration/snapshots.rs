//! Snapshots of the two calibrators.

use super::calibrator::Calibrator;
use super::joint_calibrator::JointCalibrator;
use crate::Real;
use crate::samples::{Noise, NominalArm};
use crate::snapshot::{Fingerprint, Kind, SnapshotError, longest, read, write};

impl<T: Real> Calibrator<T> {
    /// How many bytes a [`snapshot`](Self::snapshot) takes.
    pub const SNAPSHOT_BYTES: usize = longest::<T, Self>();

    /// Writes what the calibrator has seen into `bytes`, and returns the part that was written. A calibrator that is restored
    /// from it goes on to the same bits.
    ///
    /// ```
    /// use delta_cal::{Calibrator, Sample, Settings, SymmetricRobot};
    /// # fn main() -> Result<(), Box<dyn core::error::Error>> {
    /// let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }
    ///     .robot()?;
    /// let sample = |k: u32| {
    ///     let t = f64::from(k);
    ///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
    ///     robot.forward(&joints).map(|position| Sample { joints, position })
    /// };
    /// let mut calibrator = Calibrator::new(&robot, &Settings::default());
    /// for k in 0..14 {
    ///     calibrator.add(&sample(k)?)?;
    /// }
    /// let mut flash = [0; Calibrator::<f64>::SNAPSHOT_BYTES];
    /// calibrator.snapshot(&mut flash)?;
    ///
    /// // After a restart: the same robot and settings.
    /// let mut restored = Calibrator::new(&robot, &Settings::default());
    /// restored.restore(&flash)?;
    /// for k in 14..20 {
    ///     calibrator.add(&sample(k)?)?;
    ///     restored.add(&sample(k)?)?;
    /// }
    /// assert_eq!(restored.solve()?, calibrator.solve()?);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`SnapshotError::BufferTooShort`]; `bytes` is unchanged.
    pub fn snapshot<'a>(&self, bytes: &'a mut [u8]) -> Result<&'a [u8], SnapshotError> {
        write(Kind::Calibrator, self.fingerprint(), self, bytes)
    }

    /// Puts what a [`snapshot`](Self::snapshot) holds in place of what this calibrator has seen. It must be of the same robot
    /// and noise; how they are solved may have changed.
    ///
    /// # Errors
    /// Bytes that are damaged, or a snapshot of something else; the calibrator is unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        read(Kind::Calibrator, self.fingerprint(), self, bytes)
    }

    fn fingerprint(&self) -> u32 {
        self.marked().finish()
    }

    /// What a snapshot must agree with.
    pub(crate) fn marked(&self) -> Fingerprint {
        let [first, second, third] = self.arms();
        mark([first.nominal(), second.nominal(), third.nominal()])
    }
}

impl<T: Real> JointCalibrator<T> {
    /// How many bytes a [`snapshot`](Self::snapshot) takes.
    pub const SNAPSHOT_BYTES: usize = longest::<T, Self>();

    /// As [`Calibrator::snapshot`].
    ///
    /// # Errors
    /// [`SnapshotError::BufferTooShort`]; `bytes` is unchanged.
    pub fn snapshot<'a>(&self, bytes: &'a mut [u8]) -> Result<&'a [u8], SnapshotError> {
        write(Kind::JointCalibrator, self.fingerprint(), self, bytes)
    }

    /// As [`Calibrator::restore`].
    ///
    /// # Errors
    /// Bytes that are damaged, or a snapshot of something else; the calibrator is unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        read(Kind::JointCalibrator, self.fingerprint(), self, bytes)
    }

    fn fingerprint(&self) -> u32 {
        mark(self.factor().nominal_arms().each_ref()).finish()
    }
}

/// What the factors depend on.
fn mark<T: Real>(arms: [&NominalArm<T>; 3]) -> Fingerprint {
    let mut fingerprint = Fingerprint::new();
    for arm in arms {
        arm.mark(&mut fingerprint);
    }
    let [first, ..] = arms;
    let noise = first.noise();
    fingerprint.optional(noise.map(Noise::position_by_axis));
    fingerprint.optional(noise.map(|noise| [noise.joint()]));
    fingerprint
}
