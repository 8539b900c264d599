//! The gate of a stream: each sample is tested against the prediction from earlier samples and the prior before it is
//! added.
//!
//! ```text
//! innovation  ν = f(P; X, q)/σf at the current estimate P of the arm
//! variance    S = 1 + h C hᵀ,   h = ∂f/∂P /σf,   C the covariance of P
//! accepted    if |ν|/√S is within the gate for all three arms
//! ```
//!
//! ν²/S follows χ² with one degree of freedom if the sample is valid (Bar-Shalom, Li and Kirubarajan 2001, section 5.4:
//! the normalised innovation squared). Only the three linearised problems of eight parameters are stored; every sample
//! costs about the same.

mod prediction;
mod verdict;

use crate::calibration::limits::{REJECTIONS_OF_A_CHANGE, SAMPLES_FOR_FREE_START, SUSPECTED};
use crate::calibration::{ArmSamples, Refusal, Samples, Settings, TolerancePrior};
use crate::robot::{Arm, ArmIndex, OF_ARM, Robot};
use crate::samples::{Forgetting, NominalArm, Sample, SampleError};
use crate::state::state;
use crate::{Real, SettingError};
use prediction::Predicted;
use prediction::{Prediction, Row};
pub use verdict::{GateCounts, Innovation, Verdict};

/// Tests each sample before it is added to the arms' samples. Constant memory, no sample is stored.
///
/// With a stated noise and a stated tolerance it tests from the first sample. Otherwise it needs a solved estimate
/// first: see [`wants_estimate`](Self::wants_estimate).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Gate<T: Real> {
    arms: [Prediction<T>; 3],
    /// Its width, in σ.
    pub(super) sigmas: T,
    estimated: bool,
    /// Samples that the next estimate needs: twice as many, if they did not suffice.
    pub(super) needed: u64,
    /// Samples added before the gate began again, and rejected before the last acknowledgement.
    excused: [u64; 2],
    /// The statistics so far.
    pub(super) counts: GateCounts,
    /// The meaning of the first run of rejections since the last [acknowledgement](Self::acknowledge), if any.
    pub(super) alarm: Option<Refusal>,
}

impl<T: Real> Gate<T> {
    /// A gate before the first sample, [`SUSPECTED`] σ wide: each arm rejects three in a million valid samples.
    #[inline(always)]
    pub(super) fn new(robot: &Robot<T>, settings: &Settings<T>) -> Self {
        let of = |arm| Prediction::new(robot, arm, settings);
        // Not by `map`, which would build large objects elsewhere and move them.
        Self {
            arms: [
                of(ArmIndex::First),
                of(ArmIndex::Second),
                of(ArmIndex::Third),
            ],
            sigmas: T::from_f64(SUSPECTED),
            estimated: settings.noise.is_some() && settings.tolerance.is_some(),
            needed: SAMPLES_FOR_FREE_START,
            excused: [0; 2],
            counts: GateCounts::default(),
            alarm: None,
        }
    }

    /// As new, but for its width and its statistics.
    pub(super) fn begin_again(&mut self, samples: &ArmSamples<T>) {
        let Self { sigmas, counts, .. } = *self;
        *self = Self {
            sigmas,
            counts,
            excused: [counts.taken, counts.rejected],
            ..Self::new(&samples.robot(), samples.settings())
        };
    }

    /// Sets its width, in σ.
    pub(super) fn set_sigmas(&mut self, sigmas: T) -> Result<(), SettingError> {
        if !(sigmas > T::ZERO && sigmas.finite()) {
            return Err(SettingError::GateWidth);
        }
        self.sigmas = sigmas;
        Ok(())
    }

    /// Tests one sample, and adds it unless it disagrees. What [`catch_up`](Self::catch_up) has left to do comes first.
    ///
    /// # Errors
    /// An invalid number; nothing has changed.
    pub(crate) fn add(
        &mut self,
        samples: &mut ArmSamples<T>,
        sample: &Sample<T>,
        forgetting: Option<&Forgetting<T>>,
    ) -> Result<Verdict<T>, SampleError> {
        NominalArm::check_sample(samples.nominal_arms(), sample)?;
        T::gate_catch_up(self, samples, forgetting);
        let rows = self.rows(samples.nominal_arms(), sample);
        let verdict = self.judge(samples.nominal_arms(), samples.settings(), &rows);
        if let Verdict::Rejected(_) = verdict {
            self.note_rejection();
            return Ok(verdict);
        }
        samples.wait(sample);
        if samples.waiting.due().is_none() {
            samples.take_in_due(forgetting);
        }
        self.counts.taken = self.counts.taken.saturating_add(1);
        self.counts.run = 0;
        if let Verdict::NoEstimate | Verdict::NoNoise = verdict {
            self.counts.untested = self.counts.untested.saturating_add(1);
        }
        for (prediction, row) in self.arms.iter_mut().zip(&rows) {
            prediction.take_in([Some(row), None]);
        }
        Ok(verdict)
    }

    fn rows(&self, nominal_arms: [&NominalArm<T>; 3], sample: &Sample<T>) -> [Row<T>; 3] {
        let [first, second, third] = &self.arms;
        let [one, two, three] = nominal_arms;
        let [q1, q2, q3] = sample.joints;
        [(first, one, q1), (second, two, q2), (third, three, q3)]
            .map(|(prediction, nominal, q)| prediction.row_of(nominal, (&sample.position, q)))
    }

    /// The innovation of a sample in each arm, without adding or counting it.
    ///
    /// # Errors
    /// The verdict on a sample that cannot be tested.
    pub(super) fn innovations(
        &self,
        nominal_arms: [&NominalArm<T>; 3],
        settings: &Settings<T>,
        sample: &Sample<T>,
    ) -> Result<[Innovation<T>; 3], Verdict<T>> {
        self.compare(nominal_arms, settings, &self.rows(nominal_arms, sample))
    }

    fn compare(
        &self,
        nominal_arms: [&NominalArm<T>; 3],
        settings: &Settings<T>,
        rows: &[Row<T>; 3],
    ) -> Result<[Innovation<T>; 3], Verdict<T>> {
        if !self.estimated {
            return Err(Verdict::NoEstimate);
        }
        let stated = settings.noise.is_some();
        let mut innovations = ArmIndex::ALL.map(|arm| Innovation {
            arm,
            distance: T::ZERO,
            normalized: T::ZERO,
        });
        for (((prediction, row), nominal), target) in self
            .arms
            .iter()
            .zip(rows)
            .zip(nominal_arms)
            .zip(&mut innovations)
        {
            if !stated && !prediction.knows_noise() {
                return Err(Verdict::NoNoise);
            }
            let Predicted {
                innovation,
                normalized,
            } = prediction.predict(row, stated).ok_or(Verdict::NoEstimate)?;
            target.distance = innovation * T::HALF / (row.weight * nominal.lb) * nominal.scale();
            target.normalized = normalized;
        }
        Ok(innovations)
    }

    /// Decides, and counts the arms that reject.
    fn judge(
        &mut self,
        nominal_arms: [&NominalArm<T>; 3],
        settings: &Settings<T>,
        rows: &[Row<T>; 3],
    ) -> Verdict<T> {
        let innovations = match self.compare(nominal_arms, settings, rows) {
            Ok(innovations) => innovations,
            Err(untested) => return untested,
        };
        let [mut worst, ..] = innovations;
        for (innovation, count) in innovations.iter().zip(&mut self.counts.rejected_by_arm) {
            let size = innovation.normalized.magnitude();
            // NaN is outside every gate and larger than any number.
            if !(size <= self.sigmas) {
                *count = count.saturating_add(1);
            }
            if !(size <= worst.normalized.magnitude()) {
                worst = *innovation;
            }
        }
        if worst.normalized.magnitude() <= self.sigmas {
            Verdict::Taken(worst)
        } else {
            Verdict::Rejected(worst)
        }
    }

    fn note_rejection(&mut self) {
        let counts = &mut self.counts;
        let came = counts.taken.saturating_add(counts.rejected);
        counts.rejected = counts.rejected.saturating_add(1);
        counts.run = counts.run.saturating_add(1);
        counts.longest_run = counts.longest_run.max(counts.run);
        if counts.run == REJECTIONS_OF_A_CHANGE && self.alarm.is_none() {
            let first = (came + 1).saturating_sub(counts.run);
            // Eight samples determine an arm; the others agreed with it.
            let agreed = self.unexcused().0.saturating_sub(OF_ARM as u64);
            self.alarm = Some(if agreed >= REJECTIONS_OF_A_CHANGE {
                Refusal::RobotChanged { first }
            } else {
                Refusal::EarlySamplesWrong { first }
            });
        }
    }

    /// What is left to do after a sample: an arm whose block is complete takes it in, no two arms' after the same sample.
    /// Once its samples have grown by an eighth, its prediction is relinearised then; with forgetting at every block:
    /// this is how the predictions forget, too. Returns whether there was anything to do.
    pub(crate) fn catch_up(
        &mut self,
        samples: &mut ArmSamples<T>,
        forgetting: Option<&Forgetting<T>>,
    ) -> bool {
        if samples.waiting.due().is_none() {
            return false;
        }
        let Some(arm) = samples.take_in_due(forgetting) else {
            return false;
        };
        let index = arm.index();
        if let (Some(prediction), Some(factor)) =
            (self.arms.get_mut(index), samples.arms().get(index))
            && self.estimated
            && prediction.stale()
        {
            let nominal = factor.nominal();
            prediction.renew(factor, &prior(nominal, samples.settings()));
            // The factor lacks what waits for the arm's next block: two samples at most.
            let waiting = samples.waiting.block(arm);
            let mut rows = waiting.map(|sample| prediction.row_of(nominal, sample));
            let rows = [rows.next(), rows.next()];
            prediction.take_in(rows.each_ref().map(Option::as_ref));
        }
        true
    }

    /// Samples added since the gate began, and rejected since the last acknowledgement.
    pub(super) const fn unexcused(&self) -> (u64, u64) {
        let [taken, rejected] = self.excused;
        let taken = self.counts.taken.saturating_sub(taken);
        (taken, self.counts.rejected.saturating_sub(rejected))
    }

    /// Whether the gate needs an estimate to test and there are enough samples to attempt one: at the 12th, and each
    /// time their number has doubled. Pass it to [`adopt`](Self::adopt); until then the gate accepts samples untested.
    pub(super) const fn wants_estimate(&self) -> bool {
        !self.estimated && self.unexcused().0 >= self.needed
    }

    /// From now on predicts one arm from an estimate that was solved from these samples; tests from the third on.
    pub(super) fn adopt(&mut self, samples: &mut ArmSamples<T>, arm: ArmIndex, found: &Arm<T>) {
        samples.take_in_waiting_of(arm);
        let (index, settings) = (arm.index(), samples.settings());
        if let (Some(own), Some(factor)) = (self.arms.get_mut(index), samples.arms().get(index)) {
            own.correction = factor.nominal().correction_to(found);
            own.linearize(factor, &prior(factor.nominal(), settings));
        }
        self.estimated = arm == ArmIndex::Third;
    }

    /// Answers the alarm: the run was wrong, and earlier samples stay. The next run of rejections is another alarm.
    pub(super) const fn acknowledge(&mut self) {
        self.alarm = None;
        self.counts.run = 0;
        let [_, rejected] = &mut self.excused;
        *rejected = self.counts.rejected;
    }
}

/// In internal units. Without a stated noise, a tolerance cannot be weighted against the samples and is ignored.
fn prior<T: Real>(nominal: &NominalArm<T>, settings: &Settings<T>) -> TolerancePrior<T, 8> {
    let tolerance = settings.tolerance.filter(|_| settings.noise.is_some());
    TolerancePrior::of_arm(nominal.arm(), &nominal.units(), tolerance.as_ref())
}

state!(
    Gate<T>:
    arms: [Prediction<T>; 3],
    estimated: bool,
    needed: u64,
    excused: [u64; 2],
    counts: GateCounts,
    alarm: Option<Refusal>,
);

impl<T: Real> Gate<T> {
    /// Recomputes derived state after a snapshot was restored.
    pub(super) fn displace(&mut self, nominal_arms: [&NominalArm<T>; 3]) {
        for (prediction, nominal) in self.arms.iter_mut().zip(nominal_arms) {
            prediction.displace(nominal);
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::{ArmIndex, Gate, Verdict};
    use crate::calibration::{IkmCalibrator, Samples, Settings};
    use crate::fixtures::{changed, robot, samples};

    /// Eleven samples leave three degrees of freedom, enough to estimate the noise; ten do not.
    #[test]
    fn three_spare_samples_tell_the_noise() {
        let measured = samples::<12>(&changed(1), 14);
        for (count, known) in [(10, false), (11, true)] {
            let mut calibrator = IkmCalibrator::new(&robot(), &Settings::default());
            let mut gate = Gate::new(&robot(), &Settings::default());
            for sample in &measured[..count] {
                gate.add(&mut calibrator.samples, sample, None).unwrap();
                gate.catch_up(&mut calibrator.samples, None);
            }
            let found = calibrator.calibrate().unwrap().robot;
            for arm in ArmIndex::ALL {
                gate.adopt(&mut calibrator.samples, arm, found.arm(arm));
            }
            let off = gate.innovations(
                calibrator.samples.nominal_arms(),
                calibrator.settings(),
                &measured[count],
            );
            assert_eq!(off.is_ok(), known);
            assert!(known || off == Err(Verdict::NoNoise));
        }
    }
}
