//! What a gate says of a sample and of all samples.

use super::Real;
use crate::error::number_of;
use crate::memory::plain;
use crate::plain::{
    EARLY_SAMPLES_WRONG, NO_ALARM, NO_ARM, REJECTED, ROBOT_CHANGED, TAKEN, UNTESTED,
};
use crate::status::{self, Status};
use delta_cal::Refusal;
use delta_cal::calibration::Estimator;
use delta_cal::stream::{StreamCalibrator, Verdict as Tested};

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
        /// 0.
        pub reserved: i32,
        /// The first sample of that run, counted from 0 over all samples received; 0 without an alarm.
        pub alarm_sample: u64,
    }
}

impl From<Tested<Real>> for Verdict {
    fn from(tested: Tested<Real>) -> Self {
        let (verdict, reason, innovation) = match &tested {
            Tested::Ungated => (TAKEN, status::OK, None),
            Tested::NoEstimate => (UNTESTED, status::NO_ESTIMATE, None),
            Tested::NoNoise => (UNTESTED, status::NO_NOISE, None),
            Tested::Taken(innovation) => (TAKEN, status::OK, Some(innovation)),
            Tested::Rejected(innovation) => (REJECTED, status::OK, Some(innovation)),
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

impl<E: Estimator> From<&StreamCalibrator<Real, E>> for GateCounts {
    fn from(gated: &StreamCalibrator<Real, E>) -> Self {
        let counts = gated.gate_counts().copied().unwrap_or_default();
        let (alarm, alarm_sample) = match gated.alarm() {
            Some(Refusal::RobotChanged { first }) => (ROBOT_CHANGED, first),
            Some(Refusal::EarlySamplesWrong { first }) => (EARLY_SAMPLES_WRONG, first),
            _ => (NO_ALARM, 0),
        };
        Self {
            taken: counts.taken,
            untested: counts.untested,
            rejected: counts.rejected,
            rejected_by_arm: counts.rejected_by_arm,
            run: counts.run,
            longest_run: counts.longest_run,
            alarm,
            reserved: 0,
            alarm_sample,
        }
    }
}
