//! Snapshots of the gate, beside those of its calibrator.

use super::{Alarm, Gate, GateCounts, Prediction};
use crate::Real;
use crate::calibration::Calibrator;
use crate::snapshot::{Fingerprint, Kind, SnapshotError, longest, read, state, write};

state!(
    Gate<T>:
    arms: [Prediction<T>; 3],
    estimated: bool,
    counts: GateCounts,
    alarm: Option<Alarm>,
);

impl<T: Real> Gate<T> {
    /// How many bytes a [`snapshot`](Self::snapshot) takes.
    pub const SNAPSHOT_BYTES: usize = longest::<T, Self>();

    /// Writes what the gate has seen into `bytes`, and returns the part that was written. It belongs to the snapshot of the
    /// calibrator as it is now.
    ///
    /// # Errors
    /// [`SnapshotError::BufferTooShort`]; `bytes` is unchanged.
    pub fn snapshot<'a>(
        &self,
        calibrator: &Calibrator<T>,
        bytes: &'a mut [u8],
    ) -> Result<&'a [u8], SnapshotError> {
        write(Kind::Gate, self.fingerprint(calibrator), self, bytes)
    }

    /// Restores a [`snapshot`](Self::snapshot) into a gate of the same width, tolerance and forgetting, in front of the calibrator that
    /// was restored from the snapshot that belongs to it. Make the gate before you restore the calibrator: a new gate takes
    /// in the samples that wait there.
    ///
    /// # Errors
    /// Bytes that are damaged, or a snapshot of something else; the gate is unchanged.
    pub fn restore(
        &mut self,
        calibrator: &Calibrator<T>,
        bytes: &[u8],
    ) -> Result<(), SnapshotError> {
        read(Kind::Gate, self.fingerprint(calibrator), self, bytes)?;
        self.displace(calibrator);
        Ok(())
    }

    pub(crate) fn displace(&mut self, calibrator: &Calibrator<T>) {
        for (prediction, factor) in self.arms.iter_mut().zip(calibrator.arms()) {
            prediction.displace(factor);
        }
    }

    /// What the predictions depend on beside the samples.
    pub(crate) fn mark(calibrator: &Calibrator<T>, fingerprint: &mut Fingerprint) {
        let [first, ..] = calibrator.arms();
        let drive = first.nominal().arm().drive();
        calibrator.settings().mark_prior(drive, fingerprint);
    }

    fn fingerprint(&self, calibrator: &Calibrator<T>) -> u32 {
        let mut fingerprint = calibrator.marked();
        Self::mark(calibrator, &mut fingerprint);
        fingerprint.number(self.sigmas);
        fingerprint.optional(self.forgetting.map(|forgetting| [forgetting.mean_age()]));
        fingerprint.count(calibrator.samples());
        for arm in calibrator.arms() {
            fingerprint.number(arm.effective_samples());
            fingerprint.number(arm.least_sum_of_squares());
        }
        fingerprint.finish()
    }
}
