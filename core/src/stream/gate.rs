//! The gate in the stream: each sample is tested against what the samples so far and the prior
//! predict, before it is taken in.
//!
//! ```text
//! innovation  ν = f(P; X, q)/σf at the present estimate P of the arm
//! variance    S = 1 + h C hᵀ,   h = ∂f/∂P /σf,   C the covariance of P
//! taken in    if |ν|/√S is within the gate for all three arms
//! ```
//!
//! ν²/S is distributed as χ² with one degree of freedom, if the sample is what it is said to be (Bar-Shalom,
//! Li and Kirubarajan 2001, section 5.4: the normalised innovation squared). Nothing is kept but the
//! three linearised problems of eight parameters; every sample costs about the same.

mod prediction;
mod verdict;

use super::forgetting::Forgetting;
use crate::Real;
use crate::calibration::limits::{REJECTIONS_OF_A_CHANGE, SAMPLES_FOR_FREE_START, SUSPECTED};
use crate::calibration::{Calibrator, RobotOutcome, Settings, TolerancePrior, prior_of_arm};
use crate::robot::ArmIndex;
use crate::samples::{ArmFactor, Sample, SampleError};
use crate::snapshot::{Fingerprint, Kind, SnapshotError, longest, read, state, write};
use prediction::{Predicted, Prediction, Row};
pub use verdict::{Alarm, GateCounts, GateError, Innovation, Untested, Verdict};

/// Tests each sample before a [`Calibrator`] takes it in. Constant memory, no sample is kept.
///
/// With a stated noise and a stated tolerance it tests from the first sample on. Without either it
/// needs a solved estimate first: see [`wants_estimate`](Self::wants_estimate).
///
/// ```
/// use delta_cal::{Calibrator, Noise, Sample, Settings, SymmetricRobot, Tolerance};
/// use delta_cal::stream::{Alarm, Gate, Verdict};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let truth = SymmetricRobot { upper_arm: 260.4, ..nominal }.robot()?;
/// let changed = SymmetricRobot { upper_arm: 261.4, ..nominal }.robot()?;
/// let settings = Settings::default().with_noise(Noise::new(0.02, 0.0)?).with_tolerance(Tolerance::new(0.5, 0.003)?);
/// let mut calibrator = Calibrator::new(&nominal.robot()?, &settings);
/// let mut gate = Gate::new(&mut calibrator);
/// for k in 0..80 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     let robot = if k < 60 { &truth } else { &changed };
///     let mut position = robot.forward(&joints)?;
///     if k == 40 {
///         position.x += 5.0; // the reflector slipped
///     }
///     let verdict = gate.add(&mut calibrator, &Sample { joints, position })?;
///     assert_eq!(matches!(verdict, Verdict::Rejected(_)), k == 40 || k >= 60);
/// }
/// assert_eq!(gate.counts().longest_run, 20);
/// assert_eq!(gate.alarm(), Some(Alarm::RobotChanged { first: 60 }));
/// assert_eq!(calibrator.samples(), 59);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate<T: Real> {
    arms: [Prediction<T>; 3],
    sigmas: T,
    forgetting: Option<Forgetting<T>>,
    estimated: bool,
    counts: GateCounts,
    alarm: Option<Alarm>,
}

impl<T: Real> Gate<T> {
    /// Before the calibrator's first sample, or after the first few. The gate is
    /// [`SUSPECTED`] σ wide: of good samples each arm rejects three in a million.
    pub fn new(calibrator: &mut Calibrator<T>) -> Self {
        calibrator.flush();
        let settings = *calibrator.settings();
        let [first, second, third] = calibrator.arms();
        // Not by `map`: large objects would be built beside their place and moved.
        Self {
            arms: [
                Prediction::new(first, &prior(first, &settings)),
                Prediction::new(second, &prior(second, &settings)),
                Prediction::new(third, &prior(third, &settings)),
            ],
            sigmas: T::from_f64(SUSPECTED),
            forgetting: None,
            estimated: settings.noise.is_some() && settings.tolerance.is_some(),
            counts: GateCounts::default(),
            alarm: None,
        }
    }

    /// The same gate, so many σ wide.
    ///
    /// # Errors
    /// A number that is not finite or not positive.
    pub fn with_sigmas(mut self, sigmas: T) -> Result<Self, GateError> {
        if !(sigmas > T::ZERO && sigmas.finite()) {
            return Err(GateError::Sigmas);
        }
        self.sigmas = sigmas;
        Ok(self)
    }

    /// The same gate, in front of a calibrator that forgets; see [`Calibrator::add_forgetting`].
    /// An arm is then linearised anew at every sample, one after the other: that is how the predictions
    /// forget, too.
    #[must_use]
    pub const fn with_forgetting(mut self, forgetting: Forgetting<T>) -> Self {
        self.forgetting = Some(forgetting);
        self
    }

    /// Tests one sample, and takes it in unless it disagrees. A bounded amount of work: an arm's
    /// prediction is linearised anew once an eighth more samples are in it, one arm a sample.
    ///
    /// # Errors
    /// A faulty number, as of [`Calibrator::add`]; nothing has changed.
    pub fn add(
        &mut self,
        calibrator: &mut Calibrator<T>,
        sample: &Sample<T>,
    ) -> Result<Verdict<T>, SampleError> {
        calibrator.check(sample)?;
        let rows = self.rows(calibrator, sample);
        let verdict = self.judge(calibrator, &rows);
        if let Verdict::Rejected(_) = verdict {
            self.note_rejection();
            return Ok(verdict);
        }
        match &self.forgetting {
            None => calibrator.add(sample)?,
            Some(forgetting) => calibrator.add_forgetting(sample, forgetting)?,
        }
        self.counts.taken = self.counts.taken.saturating_add(1);
        self.counts.run = 0;
        if let Verdict::Untested(_) = verdict {
            self.counts.untested = self.counts.untested.saturating_add(1);
        }
        for (prediction, row) in self.arms.iter_mut().zip(&rows) {
            prediction.take_in(row);
        }
        self.renew_one(calibrator);
        Ok(verdict)
    }

    #[inline(never)]
    fn rows(&self, calibrator: &Calibrator<T>, sample: &Sample<T>) -> [Row<T>; 3] {
        let [first, second, third] = &self.arms;
        let [one, two, three] = calibrator.arms();
        let [q1, q2, q3] = sample.joints;
        [(first, one, q1), (second, two, q2), (third, three, q3)].map(|(prediction, factor, q)| {
            prediction.row(&factor.nominal().prepare(&sample.position, q))
        })
    }

    /// How far a sample is off in each arm; nothing is taken in or counted.
    ///
    /// # Errors
    /// Why the sample cannot be tested.
    pub fn innovations(
        &self,
        calibrator: &Calibrator<T>,
        sample: &Sample<T>,
    ) -> Result<[Innovation<T>; 3], Untested> {
        self.compare(calibrator, &self.rows(calibrator, sample))
    }

    #[inline(never)]
    fn compare(
        &self,
        calibrator: &Calibrator<T>,
        rows: &[Row<T>; 3],
    ) -> Result<[Innovation<T>; 3], Untested> {
        if !self.estimated {
            return Err(Untested::NoEstimate);
        }
        let stated = calibrator.settings().noise.is_some();
        let mut innovations = ArmIndex::ALL.map(|arm| Innovation {
            arm,
            distance: T::ZERO,
            normalized: T::ZERO,
        });
        for (((prediction, row), factor), target) in self
            .arms
            .iter()
            .zip(rows)
            .zip(calibrator.arms())
            .zip(&mut innovations)
        {
            if !stated && !prediction.knows_noise() {
                return Err(Untested::NoNoise);
            }
            let Predicted {
                innovation,
                normalized,
            } = prediction
                .predict(row, stated)
                .ok_or(Untested::NoEstimate)?;
            let nominal = factor.nominal();
            target.distance = innovation * T::HALF / (row.weight() * nominal.lb) * nominal.scale();
            target.normalized = normalized;
        }
        Ok(innovations)
    }

    /// Decides, and counts the arms that reject.
    #[inline(never)]
    fn judge(&mut self, calibrator: &Calibrator<T>, rows: &[Row<T>; 3]) -> Verdict<T> {
        let innovations = match self.compare(calibrator, rows) {
            Ok(innovations) => innovations,
            Err(untested) => return Verdict::Untested(untested),
        };
        let [mut worst, ..] = innovations;
        for (innovation, count) in innovations.iter().zip(&mut self.counts.rejected_by_arm) {
            let size = innovation.normalized.magnitude();
            // NaN is beyond every gate, and further off than any number.
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
            let agreed = counts.taken.saturating_sub(PARAMETERS);
            self.alarm = Some(if agreed >= REJECTIONS_OF_A_CHANGE {
                Alarm::RobotChanged { first }
            } else {
                Alarm::EarlySamplesWrong { first }
            });
        }
    }

    fn renew_one(&mut self, calibrator: &mut Calibrator<T>) {
        if !self.estimated {
            return;
        }
        for (index, arm) in ArmIndex::ALL.into_iter().enumerate() {
            let Some(prediction) = self.arms.get_mut(index) else {
                return;
            };
            if prediction.stale() {
                calibrator.take_in_waiting_of(arm);
                let settings = *calibrator.settings();
                if let Some(factor) = calibrator.arms().get(index) {
                    prediction.renew(factor, &prior(factor, &settings));
                }
                return;
            }
        }
    }

    /// Whether the gate cannot test for want of an estimate, and there are enough samples to try and
    /// solve one: at the 12th, and each time their number has doubled. Hand it over with
    /// [`adopt`](Self::adopt); if the estimate is refused, the gate continues to take in samples untested.
    pub const fn wants_estimate(&self) -> bool {
        !self.estimated
            && self.counts.taken.is_multiple_of(SAMPLES_FOR_FREE_START)
            && (self.counts.taken / SAMPLES_FOR_FREE_START).is_power_of_two()
    }

    /// Predicts from a solved estimate, of the samples of this calibrator, from now on.
    pub fn adopt(&mut self, calibrator: &mut Calibrator<T>, outcome: &RobotOutcome<T>) {
        calibrator.flush();
        let settings = *calibrator.settings();
        for ((prediction, factor), solved) in self
            .arms
            .iter_mut()
            .zip(calibrator.arms())
            .zip(&outcome.arms)
        {
            let correction = factor.nominal().correction_to(&solved.arm);
            prediction.move_to(&correction, factor, &prior(factor, &settings));
        }
        self.estimated = true;
    }

    /// What became of the samples so far.
    pub const fn counts(&self) -> &GateCounts {
        &self.counts
    }

    /// Answers the alarm: the run was wrong, and what was taken in before stays. The next run of rejections is another
    /// alarm. If it is the robot that has changed, begin again with a new calibrator and a new gate.
    pub const fn acknowledge(&mut self) {
        self.alarm = None;
        self.counts.run = 0;
    }

    /// What the first run of rejections means, if there was one since the last was [acknowledged](Self::acknowledge).
    pub const fn alarm(&self) -> Option<Alarm> {
        self.alarm
    }
}

/// Samples that it takes to determine an arm.
const PARAMETERS: u64 = 8;

/// In internal units. Without a stated noise a tolerance cannot be weighed against the samples, and is left out.
fn prior<T: Real>(factor: &ArmFactor<T>, settings: &Settings<T>) -> TolerancePrior<T, 8> {
    let tolerance = settings.tolerance.filter(|_| settings.noise.is_some());
    prior_of_arm(factor.nominal(), tolerance.as_ref())
}

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
