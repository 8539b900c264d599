//! Storage of samples across a power cut, compiled for each calibrator that supports it: `ikm`, `joint` and `gate`.
#![allow(unsafe_code)] // naming symbols

use super::Own;
use crate::error::status_of;
use crate::memory::{Held, HeldMut, Many, Out};
use crate::status::{self, Status};

/// Writes the samples into `bytes`, of which there are `capacity`: write the constant `DCAL_..._SNAPSHOT_..._SIZE`.
/// `length` is how many were written. They are the same on every target. Store them where they outlast a power cut, and
/// give them to `restore`.
///
/// Errors: `DCAL_SNAPSHOT_BUFFER`; nothing is written. The gate: `DCAL_BUSY`.
#[unsafe(export_name = family!("snapshot"))]
pub extern "C" fn snapshot(
    calibrator: Held<Own>,
    mut bytes: Out<u8>,
    capacity: usize,
    mut length: Out<usize>,
) -> Status {
    status_of(|| {
        length.usable()?;
        let needed = Own::SNAPSHOT_BYTES;
        let (own, bytes) = calibrator.beside_bytes(&mut bytes, capacity, needed)?;
        let written = own.snapshot(bytes)?.len();
        length.put(written)?;
        Ok(status::OK)
    })
}

/// Replaces the samples by those of a snapshot. The calibrator must be of the same robot and noise. It goes on to the
/// same bits as the one that the snapshot is of.
///
/// Errors: `DCAL_BUSY`, `DCAL_SNAPSHOT_...`; the calibrator is unchanged.
#[unsafe(export_name = family!("restore"))]
pub extern "C" fn restore(mut calibrator: HeldMut<Own>, bytes: Many<u8>, length: usize) -> Status {
    status_of(|| {
        let (calibrator, bytes) = calibrator.beside_bytes(&bytes, length)?;
        calibrator.restore(bytes)?;
        Ok(status::OK)
    })
}
