//! The gate in front of the per-arm calibrator.
#![allow(unsafe_code)] // naming symbols, and promises about plain numbers

use super::Real;
use super::sample::Sample;
use crate::error::{Error, number_of, report, status_of};
use crate::kind::Arms;
use crate::memory::{Held, HeldMut, In, Many, New, Out, Plain};
use crate::plain::{
    EARLY_SAMPLES_WRONG, NO_ALARM, NO_ARM, REJECTED, ROBOT_CHANGED, TAKEN, UNTESTED,
};
use crate::status::{self, Status};
use delta_cal::RobotOutcome;
use delta_cal::stream::{Alarm, Gate, Innovation};

/// What became of a sample.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// `DCAL_TAKEN`, `DCAL_UNTESTED` or `DCAL_REJECTED`.
    pub verdict: i32,
    /// Why it was not tested: `DCAL_NO_ESTIMATE` or `DCAL_NO_NOISE`; otherwise `DCAL_OK`.
    pub reason: Status,
    /// The arm whose part of the sample is furthest off, 0, 1 or 2; `DCAL_NO_ARM` if not tested.
    pub arm: i32,
    /// 0.
    pub reserved: i32,
    /// By how much the sample is off along that arm's forearm. Length.
    pub distance: Real,
    /// The same over its sigma, which contains that of the prediction.
    pub normalized: Real,
}

// SAFETY: C's layout, numbers alone, no padding (the header's test looks).
unsafe impl Plain for Verdict {}

/// How many samples came to what, and what that means.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GateCounts {
    /// Samples taken in, untested ones included.
    pub taken: u64,
    /// Of them, those that could not be tested.
    pub untested: u64,
    /// Samples rejected.
    pub rejected: u64,
    /// By each arm; a sample that several reject counts for each.
    pub rejected_by_arm: [u64; 3],
    /// Rejected samples since the last that was taken.
    pub run: u64,
    /// The longest such run.
    pub longest_run: u64,
    /// What the first long run of rejections means: `DCAL_NO_ALARM`, `DCAL_ROBOT_CHANGED` or
    /// `DCAL_EARLY_SAMPLES_WRONG`.
    pub alarm: i32,
    /// 1 if the gate cannot test for want of an estimate, and there are samples enough to try and solve one.
    pub wants_estimate: i32,
    /// The first sample of that run, counted from 0 over all that came; 0 without an alarm.
    pub alarm_sample: u64,
}

// SAFETY: C's layout, numbers alone, no padding (the header's test looks).
unsafe impl Plain for GateCounts {}

impl Verdict {
    fn of(verdict: i32, innovation: &Innovation<Real>) -> Self {
        Self {
            verdict,
            reason: status::OK,
            arm: number_of(innovation.arm),
            reserved: 0,
            distance: innovation.distance,
            normalized: innovation.normalized,
        }
    }
}

impl From<delta_cal::stream::Verdict<Real>> for Verdict {
    fn from(verdict: delta_cal::stream::Verdict<Real>) -> Self {
        match verdict {
            delta_cal::stream::Verdict::Taken(innovation) => Self::of(TAKEN, &innovation),
            delta_cal::stream::Verdict::Rejected(innovation) => Self::of(REJECTED, &innovation),
            delta_cal::stream::Verdict::Untested(why) => Self {
                verdict: UNTESTED,
                reason: Error::from(why).status,
                arm: NO_ARM,
                reserved: 0,
                distance: 0.0,
                normalized: 0.0,
            },
        }
    }
}

/// Makes a gate in front of a per-arm calibrator, before its first sample or after the first few, in `size` bytes of
/// memory: write `sizeof *gate`. `sigmas` is its width; 0 for the width that rejects three good samples in a million for
/// each arm. With a stated noise and tolerance it tests from the first sample on; otherwise it needs an estimate first,
/// see `gate_adopt`.
///
/// Errors: `DCAL_WIDTH_OF_GATE`.
#[unsafe(export_name = name!("gate_init"))]
pub extern "C" fn gate_init(
    mut gate: New<Gate<Real>>,
    size: usize,
    mut calibrator: HeldMut<Arms<Real>>,
    sigmas: Real,
) -> Status {
    status_of(|| {
        gate.usable(size)?;
        let mut made = Gate::new(calibrator.get()?.idle()?);
        // Zero means zero here: it stands for the usual width.
        #[allow(clippy::float_cmp)]
        if sigmas != 0.0 {
            made = made.with_sigmas(sigmas)?;
        }
        gate.put(size, &made)?;
        Ok(status::OK)
    })
}

/// Tests one sample, and takes it into the calibrator unless it disagrees. `calibrator` is the one of `gate_init`. A
/// sample that is rejected is no error: `verdict` says so.
///
/// Errors: `DCAL_SAMPLE_...`, with the arm; nothing has changed.
#[unsafe(export_name = name!("gate_add"))]
pub extern "C" fn gate_add(
    mut gate: HeldMut<Gate<Real>>,
    mut calibrator: HeldMut<Arms<Real>>,
    sample: In<Sample>,
    mut verdict: Out<Verdict>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        verdict.usable()?;
        let sample = sample.get()?;
        let (gate, calibrator) = gate.beside_mut(&mut calibrator)?;
        let found = gate.add(calibrator.idle()?, &sample.into())?;
        verdict.put(found.into())?;
        Ok(status::OK)
    })
}

/// Writes how many samples came to what, and whether there is an alarm.
#[unsafe(export_name = name!("gate_state"))]
pub extern "C" fn gate_state(gate: Held<Gate<Real>>, mut counts: Out<GateCounts>) -> Status {
    status_of(|| {
        let gate = gate.get()?;
        let found = gate.counts();
        let alarm = gate.alarm();
        let written = GateCounts {
            taken: found.taken,
            untested: found.untested,
            rejected: found.rejected,
            rejected_by_arm: found.rejected_by_arm,
            run: found.run,
            longest_run: found.longest_run,
            alarm: match alarm {
                Some(Alarm::RobotChanged { .. }) => ROBOT_CHANGED,
                Some(_) => EARLY_SAMPLES_WRONG,
                None => NO_ALARM,
            },
            wants_estimate: i32::from(gate.wants_estimate()),
            alarm_sample: alarm.map_or(0, |alarm| alarm.first()),
        };
        counts.put(written)?;
        Ok(status::OK)
    })
}

/// The gate predicts from this outcome from now on, which must be one of the samples of this calibrator.
#[unsafe(export_name = name!("gate_adopt"))]
pub extern "C" fn gate_adopt(
    mut gate: HeldMut<Gate<Real>>,
    mut calibrator: HeldMut<Arms<Real>>,
    outcome: Held<RobotOutcome<Real>>,
) -> Status {
    status_of(|| {
        // By value: three objects that must not overlap would be three comparisons.
        let outcome = *outcome.get()?;
        let (gate, calibrator) = gate.beside_mut(&mut calibrator)?;
        gate.adopt(calibrator.idle()?, &outcome);
        Ok(status::OK)
    })
}

/// Writes what the gate has seen into `bytes`, of which there are `capacity`: write `DCAL_GATE_SNAPSHOT_..._SIZE`. `length` is
/// how many were written. They belong to the snapshot of the calibrator as it is now: store both together.
///
/// Errors: `DCAL_SNAPSHOT_BUFFER`.
#[unsafe(export_name = name!("gate_snapshot"))]
pub extern "C" fn gate_snapshot(
    gate: Held<Gate<Real>>,
    calibrator: Held<Arms<Real>>,
    mut bytes: Out<u8>,
    capacity: usize,
    mut length: Out<usize>,
) -> Status {
    status_of(|| {
        length.usable()?;
        // By value: the bytes must overlap neither.
        let calibrator = calibrator.get()?.samples;
        let needed = Gate::<Real>::SNAPSHOT_BYTES;
        let (gate, bytes) = gate.beside_bytes(&mut bytes, capacity, needed)?;
        let written = gate.snapshot(&calibrator, bytes)?.len();
        length.put(written)?;
        Ok(status::OK)
    })
}

/// Puts what a snapshot holds in place of what the gate has seen. The gate must be of the same width. Make the gate first, then
/// restore the calibrator, then the gate: `gate_init` takes in the samples that wait in the calibrator.
///
/// Errors: `DCAL_SNAPSHOT_...`; the gate is unchanged.
#[unsafe(export_name = name!("gate_restore"))]
pub extern "C" fn gate_restore(
    mut gate: HeldMut<Gate<Real>>,
    calibrator: Held<Arms<Real>>,
    bytes: Many<u8>,
    length: usize,
) -> Status {
    status_of(|| {
        // By value: three objects that must not overlap would be three comparisons.
        let calibrator = calibrator.get()?.samples;
        let (gate, bytes) = gate.beside_bytes(&bytes, length)?;
        gate.restore(&calibrator, bytes)?;
        Ok(status::OK)
    })
}
