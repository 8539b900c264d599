//! The per-arm calibrator behind a gate, which tests each sample before it is added.
#![allow(unsafe_code)] // naming symbols, and promises about plain numbers

use super::Real;
use super::sample::{Sample, Settings};
use crate::error::{Error, number_of, report, status_of};
use crate::memory::{Held, HeldMut, In, New, Out, Plain};
use crate::plain::{
    EARLY_SAMPLES_WRONG, NO_ALARM, NO_ARM, REJECTED, ROBOT_CHANGED, TAKEN, UNTESTED,
};
use crate::status::{self, Status};
use delta_cal::stream::{
    Added, Alarm, Forgetting, GateCounts as Counts, GateError, Innovation, Selection,
    Verdict as Tested,
};
use delta_cal::{Robot, RobotOutcome};

macro_rules! family {
    ($name:literal) => {
        concat!("dcal_gate_", $name, suffix!())
    };
}
/// The calibrator.
pub type Own = crate::kind::Gate<Real>;
/// What it finds.
pub type Outcome = RobotOutcome<Real>;

fn found(own: &Own) -> Result<&Outcome, Error> {
    Ok(own.outcome()?)
}

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

// SAFETY: C layout, only numbers, no padding (checked by the header's test).
unsafe impl Plain for Verdict {}

/// How many samples came to what, and what that means.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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
    /// 1 while there is something to solve, which may be the gate's own estimate: call `step` until it returns `DCAL_OK`.
    pub solving: i32,
    /// The first sample of that run, counted from 0 over all that came; 0 without an alarm.
    pub alarm_sample: u64,
}

// SAFETY: C layout, only numbers, no padding (checked by the header's test).
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

impl Verdict {
    const fn without_figures(verdict: i32, reason: Status) -> Self {
        Self {
            verdict,
            reason,
            arm: NO_ARM,
            reserved: 0,
            distance: 0.0,
            normalized: 0.0,
        }
    }
}

impl From<Added<Real>> for Verdict {
    fn from(added: Added<Real>) -> Self {
        match added {
            Added::Taken => Self::without_figures(TAKEN, status::OK),
            Added::Tested(Tested::Taken(innovation)) => Self::of(TAKEN, &innovation),
            Added::Tested(Tested::Rejected(innovation)) => Self::of(REJECTED, &innovation),
            Added::Tested(Tested::Untested(why)) => {
                Self::without_figures(UNTESTED, Error::from(why).status)
            }
        }
    }
}

/// Makes a calibrator with a gate, without samples, in `size` bytes of memory: write `sizeof *calibrator`. `sigmas` is the
/// gate's width; 0 for the width that rejects three good samples in a million for each arm. `age` is the mean age of the
/// samples that count, for a robot that changes slowly; 0 if all count alike. With a stated noise and tolerance the gate
/// tests from the first sample on, otherwise from its first estimate on.
///
/// Errors: `DCAL_NOISE_...`, `DCAL_TOLERANCE_...`, `DCAL_NO_SUCH_CHOICE`, `DCAL_WIDTH_OF_GATE`, `DCAL_FORGETTING`.
#[unsafe(export_name = family!("init"))]
pub extern "C" fn init(
    mut calibrator: New<Own>,
    size: usize,
    robot: Held<Robot<Real>>,
    settings: In<Settings>,
    sigmas: Real,
    age: Real,
    error: Out<Error>,
) -> Status {
    report(error, || {
        calibrator.usable(size)?;
        // Exactly zero: it selects the default width, and no forgetting.
        #[allow(clippy::float_cmp)]
        let stated = |number: Real| number != 0.0;
        let forgetting = if stated(age) {
            Some(Forgetting::new(age)?)
        } else {
            None
        };
        let selection = Selection::Gated { forgetting };
        let (robot, settings) = (*robot.get()?, settings.get()?.checked()?);
        let usable = sigmas > 0.0 && sigmas.is_finite();
        if stated(sigmas) && !usable {
            return Err(GateError::Sigmas.into());
        }
        calibrator.make(size, |place| {
            let made = Own::new_in(place, &robot, &settings, &selection);
            if usable {
                made.set_sigmas(sigmas)?;
            }
            Ok::<_, Error>(made)
        })?;
        Ok(status::OK)
    })
}

/// Tests one sample, and takes it in unless it disagrees. A sample that is rejected is no error: `verdict` says so. Where
/// the gate then wants an estimate of its own, call `step` until it returns `DCAL_OK`, before the next sample.
///
/// Errors: `DCAL_BUSY`, and `DCAL_SAMPLE_...` with the arm; nothing has changed.
#[unsafe(export_name = family!("add"))]
pub extern "C" fn add(
    mut calibrator: HeldMut<Own>,
    sample: In<Sample>,
    mut verdict: Out<Verdict>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        verdict.usable()?;
        let sample = sample.get()?;
        let found = calibrator.get()?.add(&sample.into())?;
        verdict.put(found.into())?;
        Ok(status::OK)
    })
}

/// Writes how many samples came to what, and whether there is an alarm.
#[unsafe(export_name = family!("state"))]
pub extern "C" fn state(calibrator: Held<Own>, mut counts: Out<GateCounts>) -> Status {
    status_of(|| {
        let own = calibrator.get()?;
        let Counts {
            taken,
            untested,
            rejected,
            rejected_by_arm,
            run,
            longest_run,
            ..
        } = own.gate_counts().copied().unwrap_or_default();
        let alarm = own.alarm();
        counts.put(GateCounts {
            taken,
            untested,
            rejected,
            rejected_by_arm,
            run,
            longest_run,
            alarm: match alarm {
                Some(Alarm::RobotChanged { .. }) => ROBOT_CHANGED,
                Some(_) => EARLY_SAMPLES_WRONG,
                None => NO_ALARM,
            },
            solving: i32::from(own.solving()),
            alarm_sample: alarm.map_or(0, |alarm| alarm.first()),
        })?;
        Ok(status::OK)
    })
}

/// Answers the alarm: the run of rejected samples was wrong, and what was taken in before stays. If the robot has
/// changed, call `reset`.
#[unsafe(export_name = family!("acknowledge"))]
pub extern "C" fn acknowledge(mut calibrator: HeldMut<Own>) -> Status {
    status_of(|| {
        calibrator.get()?.acknowledge();
        Ok(status::OK)
    })
}

#[path = "family.rs"]
mod family;
pub use family::*;

#[path = "stored.rs"]
mod stored;
pub use stored::*;
