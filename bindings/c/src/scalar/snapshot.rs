//! Snapshots of the calibrators and the gate.
#![allow(unsafe_code)] // naming symbols

use super::Real;
use crate::error::status_of;
use crate::memory::{Held, HeldMut, Many, Out};
use crate::status::{self, Status};
use delta_cal::Calibrator;
use delta_cal::calibration::JointCalibrator;
use delta_cal::stream::Gate;

/// Writes what the per-arm calibrator has seen into `bytes`, of which there are `capacity`: write
/// `DELTA_CAL_CALIBRATOR_SNAPSHOT_..._SIZE`. `length` is how many were written. They are the same on every target. Store them
/// where they outlast a power cut, and give them to `calibrator_restore`.
///
/// Errors: `DELTA_CAL_SNAPSHOT_BUFFER`.
#[unsafe(export_name = name!("calibrator_snapshot"))]
pub extern "C" fn calibrator_snapshot(
    calibrator: Held<Calibrator<Real>>,
    mut bytes: Out<u8>,
    capacity: usize,
    mut length: Out<u64>,
) -> Status {
    status_of(|| {
        length.usable()?;
        let (calibrator, bytes) = calibrator.beside_bytes(&mut bytes, capacity)?;
        let written = calibrator.snapshot(bytes)?.len();
        length.put(written as u64)?;
        Ok(status::OK)
    })
}

/// Puts what a snapshot holds in place of what the per-arm calibrator has seen. The calibrator must be of the same robot and
/// settings. It goes on to the same bits as the one that the snapshot is of.
///
/// Errors: `DELTA_CAL_SNAPSHOT_...`; the calibrator is unchanged.
#[unsafe(export_name = name!("calibrator_restore"))]
pub extern "C" fn calibrator_restore(
    mut calibrator: HeldMut<Calibrator<Real>>,
    bytes: Many<u8>,
    length: usize,
) -> Status {
    status_of(|| {
        let (calibrator, bytes) = calibrator.beside_bytes(&bytes, length)?;
        calibrator.restore(bytes)?;
        Ok(status::OK)
    })
}

/// Writes what the joint calibrator has seen into `bytes`, of which there are `capacity`: write
/// `DELTA_CAL_JOINT_CALIBRATOR_SNAPSHOT_..._SIZE`. `length` is how many were written.
///
/// Errors: `DELTA_CAL_SNAPSHOT_BUFFER`.
#[unsafe(export_name = name!("joint_calibrator_snapshot"))]
pub extern "C" fn joint_calibrator_snapshot(
    calibrator: Held<JointCalibrator<Real>>,
    mut bytes: Out<u8>,
    capacity: usize,
    mut length: Out<u64>,
) -> Status {
    status_of(|| {
        length.usable()?;
        let (calibrator, bytes) = calibrator.beside_bytes(&mut bytes, capacity)?;
        let written = calibrator.snapshot(bytes)?.len();
        length.put(written as u64)?;
        Ok(status::OK)
    })
}

/// Puts what a snapshot holds in place of what the joint calibrator has seen. The calibrator must be of the same robot and
/// settings. It goes on to the same bits as the one that the snapshot is of.
///
/// Errors: `DELTA_CAL_SNAPSHOT_...`; the calibrator is unchanged.
#[unsafe(export_name = name!("joint_calibrator_restore"))]
pub extern "C" fn joint_calibrator_restore(
    mut calibrator: HeldMut<JointCalibrator<Real>>,
    bytes: Many<u8>,
    length: usize,
) -> Status {
    status_of(|| {
        let (calibrator, bytes) = calibrator.beside_bytes(&bytes, length)?;
        calibrator.restore(bytes)?;
        Ok(status::OK)
    })
}

/// Writes what the gate has seen into `bytes`, of which there are `capacity`: write `DELTA_CAL_GATE_SNAPSHOT_..._SIZE`. `length` is
/// how many were written. They belong to the snapshot of the calibrator as it is now: store both together.
///
/// Errors: `DELTA_CAL_SNAPSHOT_BUFFER`.
#[unsafe(export_name = name!("gate_snapshot"))]
pub extern "C" fn gate_snapshot(
    gate: Held<Gate<Real>>,
    calibrator: Held<Calibrator<Real>>,
    mut bytes: Out<u8>,
    capacity: usize,
    mut length: Out<u64>,
) -> Status {
    status_of(|| {
        length.usable()?;
        // By value: the bytes must overlap neither.
        let calibrator = *calibrator.get()?;
        let (gate, bytes) = gate.beside_bytes(&mut bytes, capacity)?;
        let written = gate.snapshot(&calibrator, bytes)?.len();
        length.put(written as u64)?;
        Ok(status::OK)
    })
}

/// Puts what a snapshot holds in place of what the gate has seen. The gate must be of the same width. Make the gate first, then
/// restore the calibrator, then the gate: `gate_init` takes in the samples that wait in the calibrator.
///
/// Errors: `DELTA_CAL_SNAPSHOT_...`; the gate is unchanged.
#[unsafe(export_name = name!("gate_restore"))]
pub extern "C" fn gate_restore(
    mut gate: HeldMut<Gate<Real>>,
    calibrator: Held<Calibrator<Real>>,
    bytes: Many<u8>,
    length: usize,
) -> Status {
    status_of(|| {
        // By value: three objects that must not overlap would be three comparisons.
        let calibrator = *calibrator.get()?;
        let (gate, bytes) = gate.beside_bytes(&bytes, length)?;
        gate.restore(&calibrator, bytes)?;
        Ok(status::OK)
    })
}
