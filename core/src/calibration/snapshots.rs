//! Snapshots of calibrators from complete positions.

use super::calibrator::estimators::Parts;
use super::calibrator::{Calibrator, Estimator};
use super::parts::Samples;
use crate::Real;
use crate::samples::Noise;
use crate::snapshot::{Fingerprint, SnapshotError, longest, read, write};

impl<T: Real, E: Estimator> Calibrator<T, E> {
    /// Size of the largest [`snapshot`](Self::snapshot), bytes.
    pub const SNAPSHOT_BYTES: usize = longest::<T, <E as Parts>::Samples<T>>();

    /// Writes the state of the calibrator into `bytes` and returns the part used. A calibrator restored from it
    /// continues with bit-identical results.
    ///
    /// ```
    /// use delta_cal::{IkmCalibrator, Sample, Settings, SymmetricRobot};
    /// # fn main() -> Result<(), Box<dyn core::error::Error>> {
    /// let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }
    ///     .robot()?;
    /// let mut calibrator = IkmCalibrator::new(&robot, &Settings::default());
    /// for k in 0..20 {
    ///     let t = f64::from(k);
    ///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
    ///     calibrator.add(&Sample { joints, position: robot.forward(&joints)? })?;
    /// }
    /// let mut flash = [0; IkmCalibrator::<f64>::SNAPSHOT_BYTES];
    /// calibrator.snapshot(&mut flash)?;
    ///
    /// // After a restart: the same robot and settings.
    /// let mut restored = IkmCalibrator::new(&robot, &Settings::default());
    /// restored.restore(&flash)?;
    /// assert_eq!(restored.calibrate()?, calibrator.calibrate()?);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`SnapshotError::BufferTooShort`]; `bytes` is unchanged.
    pub fn snapshot<'a>(&self, bytes: &'a mut [u8]) -> Result<&'a [u8], SnapshotError> {
        write(E::NUMBER, self.marked().finish(), &self.samples, bytes)
    }

    /// Replaces the state of this calibrator by that of a [`snapshot`](Self::snapshot) of the same robot and noise; the
    /// solver settings may differ.
    ///
    /// # Errors
    /// Damaged bytes, or a snapshot of something else; [`SnapshotError::Busy`]. The calibrator is
    /// unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        let mark = self.marked().finish();
        self.check_idle()?;
        read(E::NUMBER, mark, &mut self.samples, bytes)?;
        self.stop();
        Ok(())
    }

    /// Everything a snapshot must agree with: what the factors depend on.
    pub(crate) fn marked(&self) -> Fingerprint {
        let mut fingerprint = Fingerprint::new();
        let arms = self.samples.nominal_arms();
        for arm in arms {
            arm.mark(&mut fingerprint);
        }
        let [first, ..] = arms;
        let noise = first.noise();
        fingerprint.optional(noise.map(Noise::position_by_axis));
        fingerprint.optional(noise.map(|noise| [noise.joint()]));
        fingerprint
    }
}
