//! Accumulated samples of each arm separately.

use super::parts::Samples;
use super::settings::Settings;
use crate::Real;
use crate::robot::{ArmIndex, Drive, Robot};
use crate::samples::{ArmFactor, Forgetting, MergeError, NominalArm, Sample, Waiting};
use crate::state::state;
use nalgebra::Vector3;

/// Every sample is absorbed into three 13 × 13 triangular factors and discarded. Samples added singly wait until they
/// form a block of four or are needed; the factors absorb their blocks at different samples, so that every call of
/// [`add`](Samples::add) is short.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmSamples<T: Real> {
    settings: Settings<T>,
    pub(crate) arms: [ArmFactor<T>; 3],
    pub(crate) waiting: Waiting<T>,
}

state!(ArmSamples<T>: arms: [ArmFactor<T>; 3], waiting: Waiting<T>);

/// The origin for positions, within the workspace: the platform at equal joint angles, or with the carriages a
/// forearm's length up.
pub(crate) fn workspace_centre<T: Real>(robot: &Robot<T>) -> Vector3<T> {
    let [first, ..] = robot.arms();
    if robot.drive() == Drive::Linear
        && let Ok(x) = robot.forward(&[first.lb(); 3])
    {
        return x;
    }
    for degrees in [20.0_f32, 0.0, 45.0, -20.0, 70.0] {
        let q = T::from_f64(f64::from(degrees)) * (T::PI / T::from_f64(180.0));
        if let Ok(x) = robot.forward(&[q; 3]) {
            return x;
        }
    }
    let [first, second, third] = robot.arms();
    (first.d() + second.d() + third.d() - robot.up() * first.lb()) / T::from_f64(3.0)
}

impl<T: Real> Samples<T> for ArmSamples<T> {
    #[inline(always)]
    fn new(robot: &Robot<T>, settings: &Settings<T>) -> Self {
        let centre = workspace_centre(robot);
        let of = |arm| NominalArm::new(robot.arm(arm), &centre, settings.noise);
        // Not by `map`, which would build the three factors elsewhere and move them.
        Self {
            settings: *settings,
            arms: [
                ArmFactor::new(of(ArmIndex::First)),
                ArmFactor::new(of(ArmIndex::Second)),
                ArmFactor::new(of(ArmIndex::Third)),
            ],
            waiting: Waiting::none(),
        }
    }

    /// The sample waits for three others and is absorbed together with them.
    fn push(&mut self, sample: &Sample<T>) {
        self.wait(sample);
        self.take_in_due(None);
    }

    fn push_forgetting(&mut self, sample: &Sample<T>, forgetting: &Forgetting<T>) {
        self.wait(sample);
        self.take_in_due(Some(forgetting));
    }

    fn take_in(&mut self, samples: &[Sample<T>]) {
        for (factor, arm) in self.arms.iter_mut().zip(ArmIndex::ALL) {
            factor.absorb_many(samples, arm);
        }
    }

    fn flush(&mut self) {
        for arm in &ArmIndex::ALL {
            self.take_in_waiting_of(*arm);
        }
    }

    fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        if self.nominal_arms() != other.nominal_arms() {
            return Err(MergeError::DifferentNominal);
        }
        let mut other = other.clone();
        other.flush();
        for (factor, other) in self.arms.iter_mut().zip(&other.arms) {
            factor.merge(other)?;
        }
        Ok(())
    }

    fn forget(&mut self, lambda: T) {
        for factor in &mut self.arms {
            factor.forget(lambda);
        }
    }

    fn count(&self) -> u64 {
        let [first, ..] = &self.arms;
        first
            .samples()
            .saturating_add(self.waiting.waiting_for(ArmIndex::First) as u64)
    }

    fn settings(&self) -> &Settings<T> {
        &self.settings
    }

    fn nominal_arms(&self) -> [&NominalArm<T>; 3] {
        let [first, second, third] = &self.arms;
        [first.nominal(), second.nominal(), third.nominal()]
    }
}

impl<T: Real> ArmSamples<T> {
    /// The factors of the three arms; they exclude waiting samples.
    pub(crate) const fn arms(&self) -> &[ArmFactor<T>; 3] {
        &self.arms
    }

    /// Keeps a sample until its block is complete. [`take_in_due`](Self::take_in_due) comes before the next.
    pub(crate) fn wait(&mut self, sample: &Sample<T>) {
        if self.waiting.full() {
            self.flush();
        }
        self.waiting.push(sample);
    }

    /// The arm whose block is complete absorbs it, after the samples before it are forgotten.
    pub(crate) fn take_in_due(&mut self, forgetting: Option<&Forgetting<T>>) -> Option<ArmIndex> {
        let due = self.waiting.due();
        if let Some(forgetting) = forgetting {
            for (factor, arm) in self.arms.iter_mut().zip(ArmIndex::ALL) {
                let waiting = self.waiting.waiting_for(arm);
                factor.fade(forgetting, waiting, due == Some(arm));
            }
        }
        if let Some(arm) = due {
            self.take_in_block(arm);
        }
        due
    }

    pub(crate) fn take_in_waiting_of(&mut self, arm: ArmIndex) {
        while self.waiting.waiting_for(arm) > 0 {
            self.take_in_block(arm);
        }
    }

    pub(crate) fn take_in_block(&mut self, arm: ArmIndex) {
        if let Some(factor) = self.arms.get_mut(arm.index()) {
            T::absorb_block(factor, &self.waiting, arm);
        }
        self.waiting.take(arm);
    }
}
