//! Snapshots of all that a stream has seen.

use super::StreamCalibrator;
use super::calibrators::Calibrators;
use super::work::Work;
use crate::Real;
use crate::calibration::{Calibrator, JointCalibrator};
use crate::snapshot::{Kind, Reader, SnapshotError, State, Writer, longest, read, write};
use crate::stream::gate::Gate;

impl<T: Real> State<T> for Calibrators<T> {
    const BYTES: usize = Calibrator::<T>::BYTES + JointCalibrator::<T>::BYTES + Gate::<T>::BYTES;

    fn save(&self, to: &mut Writer<'_>) {
        self.arms.save(to);
        if let Some(joint) = &self.joint {
            joint.save(to);
        }
        if let Some(gate) = &self.gate {
            gate.save(to);
        }
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        self.arms.load(from);
        if let Some(joint) = &mut self.joint {
            joint.load(from);
        }
        if let Some(gate) = &mut self.gate {
            gate.load(from);
            gate.displace(&self.arms);
        }
    }
}

impl<T: Real> State<T> for StreamCalibrator<T> {
    const BYTES: usize = <u64 as State<T>>::BYTES + Calibrators::<T>::BYTES;

    fn save(&self, to: &mut Writer<'_>) {
        State::<T>::save(&self.samples, to);
        self.calibrators.save(to);
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        State::<T>::load(&mut self.samples, from);
        self.calibrators.load(from);
        self.work = Work::Collecting;
        self.asked = false;
    }
}

impl<T: Real> StreamCalibrator<T> {
    /// How many bytes a [`snapshot`](Self::snapshot) takes at most.
    pub const SNAPSHOT_BYTES: usize = longest::<T, Self>();

    /// Writes what the stream has seen into `bytes`, of which there must be [`SNAPSHOT_BYTES`](Self::SNAPSHOT_BYTES), and
    /// returns the part that was written. Results are not part of it: they are solved again.
    ///
    /// # Errors
    /// [`SnapshotError::BufferTooShort`]; [`SnapshotError::Busy`] while something is being solved.
    pub fn snapshot<'a>(&self, bytes: &'a mut [u8]) -> Result<&'a [u8], SnapshotError> {
        if self.solving() {
            return Err(SnapshotError::Busy);
        }
        write(Kind::Stream, self.fingerprint(), self, bytes)
    }

    /// Puts what a [`snapshot`](Self::snapshot) holds in place of what this stream has seen. It must be of the same
    /// robot, noise and options, and with a gate of the same tolerance. A solve that was asked for is none any more. From then on this stream gives the same results as the one that the snapshot is
    /// of, bit by bit.
    ///
    /// # Errors
    /// Bytes that are damaged, or a snapshot of something else; the stream is unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        read(Kind::Stream, self.fingerprint(), self, bytes)
    }

    fn fingerprint(&self) -> u32 {
        let mut fingerprint = self.calibrators.arms.marked();
        self.calibrators.options.mark(&mut fingerprint);
        if self.calibrators.gate.is_some() {
            Gate::mark(&self.calibrators.arms, &mut fingerprint);
        }
        fingerprint.finish()
    }
}
