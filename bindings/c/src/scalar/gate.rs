//! The per-arm calibrator behind a gate.
#![allow(unsafe_code)] // naming symbols, and promises about plain numbers

use super::Real;
use super::sample::{Sample, Settings};
use crate::error::{Error, number_of, report, status_of};
use crate::kind::Gated;
use crate::memory::{Held, HeldMut, In, Many, New, Out, Plain};
use crate::plain::{
    EARLY_SAMPLES_WRONG, NO_ALARM, NO_ARM, REJECTED, ROBOT_CHANGED, TAKEN, UNTESTED,
};
use crate::status::{self, Status};
use delta_cal::stream::{Added, Alarm, Innovation, Selection};
use delta_cal::{Progress, Robot, RobotOutcome};

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
    /// 1 if there is something left to solve; until that is done, no sample is taken.
    pub solving: i32,
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

/// Makes a per-arm calibrator behind a gate, without samples, in `size` bytes of memory: write `sizeof *gated`.
/// `sigmas` is the gate's width; 0 for the width that rejects three good samples in a million for each arm. With a stated
/// noise and tolerance it tests from the first sample on; otherwise it solves an estimate at the twelfth.
///
/// Errors: `DCAL_WIDTH_OF_GATE`, `DCAL_NOISE_...`, `DCAL_TOLERANCE_...`, `DCAL_NO_SUCH_CHOICE`.
#[unsafe(export_name = name!("gated_init"))]
pub extern "C" fn gated_init(
    mut gated: New<Gated<Real>>,
    size: usize,
    robot: Held<Robot<Real>>,
    settings: In<Settings>,
    sigmas: Real,
    error: Out<Error>,
) -> Status {
    report(error, || {
        gated.usable(size)?;
        let gate = Selection::Gated { forgetting: None };
        let mut made = Gated::new(robot.get()?, &settings.get()?.checked()?, &gate);
        // Zero means zero here: it stands for the usual width.
        #[allow(clippy::float_cmp)]
        if sigmas != 0.0 {
            made.set_sigmas(sigmas)?;
        }
        gated.put(size, &made)?;
        Ok(status::OK)
    })
}

/// Tests one sample, and takes it in unless it disagrees. A sample that is rejected is no error: `verdict` says so. Call
/// `dcal_gated_step` before the next: an estimate of the gate may be to be solved.
///
/// Errors: `DCAL_BUSY`, and `DCAL_SAMPLE_...` with the arm; nothing has changed.
#[unsafe(export_name = name!("gated_add"))]
pub extern "C" fn gated_add(
    mut gated: HeldMut<Gated<Real>>,
    sample: In<Sample>,
    mut verdict: Out<Verdict>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        verdict.usable()?;
        let sample = sample.get()?;
        if let Added::Tested(found) = gated.get()?.add(&sample.into())? {
            verdict.put(found.into())?;
        }
        Ok(status::OK)
    })
}

/// Begins to solve.
///
/// Errors: `DCAL_ROBOT_HAS_CHANGED`, `DCAL_EARLY_SAMPLES`, `DCAL_TOO_MANY_REJECTED`.
#[unsafe(export_name = name!("gated_solve"))]
pub extern "C" fn gated_solve(mut gated: HeldMut<Gated<Real>>, error: Out<Error>) -> Status {
    report(error, || {
        gated.get()?.solve()?;
        Ok(status::OK)
    })
}

/// One short step of what there is to solve, to be called between the turns of a control loop. Returns `DCAL_WORKING` as
/// long as there is more to do, and `DCAL_OK` otherwise.
#[unsafe(export_name = name!("gated_step"))]
pub extern "C" fn gated_step(mut gated: HeldMut<Gated<Real>>, error: Out<Error>) -> Status {
    report(error, || {
        Ok(match gated.get()?.step() {
            Progress::Working => status::WORKING,
            Progress::Finished => status::OK,
        })
    })
}

/// The calibrated robot, in `size` bytes of memory: write `sizeof *outcome`.
///
/// Errors: `DCAL_UNFINISHED` before the last step, and every refusal, with arm and cause.
#[unsafe(export_name = name!("gated_finish"))]
pub extern "C" fn gated_finish(
    gated: Held<Gated<Real>>,
    mut outcome: New<RobotOutcome<Real>>,
    size: usize,
    error: Out<Error>,
) -> Status {
    report(error, || {
        outcome.usable(size)?;
        match &gated.get()?.outcome() {
            Ok(found) => outcome.put(size, found)?,
            Err(refusal) => return Err((*refusal).into()),
        }
        Ok(status::OK)
    })
}

/// Answers the alarm: the run of rejected samples was wrong, and what was taken in before stays.
#[unsafe(export_name = name!("gated_acknowledge"))]
pub extern "C" fn gated_acknowledge(mut gated: HeldMut<Gated<Real>>) -> Status {
    status_of(|| {
        gated.get()?.acknowledge();
        Ok(status::OK)
    })
}

/// Drops all samples, for a robot that has changed.
#[unsafe(export_name = name!("gated_reset"))]
pub extern "C" fn gated_reset(mut gated: HeldMut<Gated<Real>>) -> Status {
    status_of(|| {
        gated.get()?.reset();
        Ok(status::OK)
    })
}

/// Writes how many samples came to what, and whether there is an alarm.
#[unsafe(export_name = name!("gated_state"))]
pub extern "C" fn gated_state(gated: Held<Gated<Real>>, mut counts: Out<GateCounts>) -> Status {
    status_of(|| {
        let gated = gated.get()?;
        let found = gated.gate_counts().copied().unwrap_or_default();
        let alarm = gated.alarm();
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
            solving: i32::from(gated.solving()),
            alarm_sample: alarm.map_or(0, |alarm| alarm.first()),
        };
        counts.put(written)?;
        Ok(status::OK)
    })
}

/// Writes what came into `bytes`, of which there are `capacity`: write `DCAL_GATED_SNAPSHOT_..._SIZE`. `length` is how many
/// were written.
///
/// Errors: `DCAL_SNAPSHOT_BUFFER`, `DCAL_BUSY`; nothing is written.
#[unsafe(export_name = name!("gated_snapshot"))]
pub extern "C" fn gated_snapshot(
    gated: Held<Gated<Real>>,
    mut bytes: Out<u8>,
    capacity: usize,
    mut length: Out<usize>,
) -> Status {
    status_of(|| {
        length.usable()?;
        if gated.get()?.solving() {
            return Err(status::BUSY.into());
        }
        let needed = Gated::<Real>::SNAPSHOT_BYTES;
        let (gated, bytes) = gated.beside_bytes(&mut bytes, capacity, needed)?;
        let written = gated.snapshot(bytes)?.len();
        length.put(written)?;
        Ok(status::OK)
    })
}

/// Puts what a snapshot holds in place of what came. It must be of the same robot, noise, tolerance and width.
///
/// Errors: `DCAL_SNAPSHOT_...`; nothing has changed.
#[unsafe(export_name = name!("gated_restore"))]
pub extern "C" fn gated_restore(
    mut gated: HeldMut<Gated<Real>>,
    bytes: Many<u8>,
    length: usize,
) -> Status {
    status_of(|| {
        let (gated, bytes) = gated.beside_bytes(&bytes, length)?;
        gated.restore(bytes)?;
        Ok(status::OK)
    })
}
