//! The per-arm calibrator behind a gate, which tests each sample before it is added.
#![allow(unsafe_code)] // naming symbols

use super::Real;
use super::outcome::{ArmSummary, Found, deviations_of, index_of};
use super::sample::{Sample, Settings};
use crate::error::{Error, number_of, report, status_of};
use crate::memory::{Held, HeldMut, In, New, Out, plain};
use crate::plain::{
    EARLY_SAMPLES_WRONG, NO_ALARM, NO_ARM, REJECTED, ROBOT_CHANGED, TAKEN, UNTESTED,
};
use crate::status::{self, Status};
use delta_cal::stream::{Added, Alarm, Forgetting, GateError, Selection, Verdict as Tested};
use delta_cal::{Progress, Robot};

/// The calibrator.
pub type Own = crate::kind::Gate<Real>;

plain! {
    /// What happened to a sample.
    pub struct Verdict {
        /// `DCAL_TAKEN`, `DCAL_UNTESTED` or `DCAL_REJECTED`.
        pub verdict: i32,
        /// Why the sample was not tested: `DCAL_NO_ESTIMATE` or `DCAL_NO_NOISE`; otherwise `DCAL_OK`.
        pub reason: Status,
        /// The arm with the largest deviation, 0, 1 or 2; `DCAL_NO_ARM` if not tested.
        pub arm: i32,
        /// 0.
        pub reserved: i32,
        /// The deviation along that arm's forearm. Length.
        pub distance: Real,
        /// The deviation divided by its sigma, which includes that of the prediction.
        pub normalized: Real,
    }
}

plain! {
    /// Sample counts and the alarm.
    pub struct GateCounts {
        /// Samples accepted, including untested ones.
        pub taken: u64,
        /// Accepted samples that could not be tested.
        pub untested: u64,
        /// Samples rejected.
        pub rejected: u64,
        /// Rejected by each arm; a sample rejected by several counts for each.
        pub rejected_by_arm: [u64; 3],
        /// Rejected samples since the last accepted one.
        pub run: u64,
        /// The longest such run.
        pub longest_run: u64,
        /// The cause of the first long run of rejections: `DCAL_NO_ALARM`, `DCAL_ROBOT_CHANGED` or
        /// `DCAL_EARLY_SAMPLES_WRONG`.
        pub alarm: i32,
        /// 1 while there is something to solve, possibly the gate's own estimate: call `step` until it returns `DCAL_OK`.
        pub solving: i32,
        /// The first sample of that run, counted from 0 over all samples received; 0 without an alarm.
        pub alarm_sample: u64,
    }
}

impl From<Added<Real>> for Verdict {
    fn from(added: Added<Real>) -> Self {
        let (verdict, reason, innovation) = match &added {
            Added::Taken => (TAKEN, status::OK, None),
            Added::Tested(Tested::Taken(innovation)) => (TAKEN, status::OK, Some(innovation)),
            Added::Tested(Tested::Rejected(innovation)) => (REJECTED, status::OK, Some(innovation)),
            Added::Tested(Tested::Untested(why)) => (UNTESTED, Error::from(*why).status, None),
        };
        Self {
            verdict,
            reason,
            arm: innovation.map_or(NO_ARM, |it| number_of(it.arm)),
            reserved: 0,
            distance: innovation.map_or(0.0, |it| it.distance),
            normalized: innovation.map_or(0.0, |it| it.normalized),
        }
    }
}

/// Makes a calibrator with a gate and without samples, in `size` bytes of memory: write `sizeof *calibrator`. `sigmas` is
/// the width of the gate; 0 selects the width that rejects three good samples in a million for each arm. `age` is the mean
/// age of the samples that count, for a robot that changes slowly; 0 if all count equally. If noise and tolerance are
/// stated, the gate tests from the first sample, otherwise from its first estimate.
///
/// Errors: `DCAL_NOISE_...`, `DCAL_TOLERANCE_...`, `DCAL_NO_SUCH_CHOICE`, `DCAL_WIDTH_OF_GATE`, `DCAL_FORGETTING`.
#[unsafe(export_name = family!("gate", "init"))]
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
        let (robot, settings) = (robot.get()?.clone(), settings.get()?.checked()?);
        let usable = sigmas > 0.0 && sigmas.is_finite();
        if stated(sigmas) && !usable {
            return Err(GateError::Sigmas.into());
        }
        calibrator.make(size, |place| {
            let made = Own::new_in(place, &robot, &settings, &selection);
            if usable {
                made.set_sigmas(sigmas)?;
            }
            Ok(made)
        })
    })
}

/// Tests one sample, and adds it unless it is rejected. A rejected sample is not an error: `verdict` reports it. If the
/// gate then needs an estimate of its own, call `step` until it returns `DCAL_OK`, before the next sample.
///
/// Errors: `DCAL_BUSY`, and `DCAL_SAMPLE_...` with the arm; nothing has changed.
#[unsafe(export_name = family!("gate", "add"))]
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
        Ok(verdict.put(found.into())?)
    })
}

/// Writes the sample counts and the alarm, if any.
#[unsafe(export_name = family!("gate", "state"))]
pub extern "C" fn state(calibrator: Held<Own>, mut state: Out<GateCounts>) -> Status {
    status_of(|| {
        let own = calibrator.get()?;
        let counts = own.gate_counts().copied().unwrap_or_default();
        let alarm = own.alarm();
        let found = GateCounts {
            taken: counts.taken,
            untested: counts.untested,
            rejected: counts.rejected,
            rejected_by_arm: counts.rejected_by_arm,
            run: counts.run,
            longest_run: counts.longest_run,
            alarm: match alarm {
                Some(Alarm::RobotChanged { .. }) => ROBOT_CHANGED,
                Some(_) => EARLY_SAMPLES_WRONG,
                None => NO_ALARM,
            },
            solving: i32::from(own.solving()),
            alarm_sample: alarm.map_or(0, |alarm| alarm.first()),
        };
        Ok(state.put(found)?)
    })
}

/// Answers the alarm and excuses all rejections so far: solving is possible again. Without forgetting the rejected samples
/// were wrong, and the samples before them stay; if the robot itself has changed, call `reset`. With forgetting an alarm's
/// answer discards the earlier samples, and the gate begins again, as when new; its counts go on.
#[unsafe(export_name = family!("gate", "acknowledge"))]
pub extern "C" fn acknowledge(mut calibrator: HeldMut<Own>) -> Status {
    status_of(|| {
        calibrator.get()?.acknowledge();
        Ok(())
    })
}

calibrator!("gate");
stored!("gate");
