use super::factor::BLOCK;
use super::sample::Sample;
use crate::Real;
use crate::robot::ArmIndex;
use crate::snapshot::state;
use nalgebra::Vector3;

/// A block, and the samples that come while the arms take it in, one arm a sample.
const CAPACITY: usize = BLOCK + 2;

/// Samples on their way into three factors. A factor takes them in by blocks, and no two factors at
/// the same sample, so that no sample costs much more than another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Waiting<T: Real> {
    /// In the order in which they came; zeros behind the last.
    samples: [Sample<T>; CAPACITY],
    count: usize,
    /// How many of them each arm has taken.
    taken: [usize; 3],
}

state!(Waiting<T>: samples: [Sample<T>; CAPACITY], count: usize, taken: [usize; 3]);

impl<T: Real> Waiting<T> {
    pub(crate) fn none() -> Self {
        Self {
            samples: [Sample::default(); CAPACITY],
            count: 0,
            taken: [0; 3],
        }
    }

    /// Adds a sample; there is always room for it if the arm that is due then takes its block.
    pub(crate) fn push(&mut self, sample: &Sample<T>) {
        if let Some(place) = self.samples.get_mut(self.count) {
            *place = *sample;
            self.count += 1;
        }
    }

    /// How many samples an arm has not taken.
    pub(crate) fn waiting_for(&self, arm: ArmIndex) -> usize {
        self.count.saturating_sub(self.taken_by(arm))
    }

    /// The arm for which a whole block waits.
    pub(crate) fn due(&self) -> Option<ArmIndex> {
        let due = |arm: &ArmIndex| self.waiting_for(*arm) >= BLOCK;
        ArmIndex::ALL.into_iter().find(due)
    }

    /// Position and joint angle of what waits for an arm, a block at most.
    pub(crate) fn block(&self, arm: ArmIndex) -> impl Iterator<Item = (&Vector3<T>, T)> {
        let joint = arm.index();
        self.samples
            .iter()
            .take(self.count)
            .skip(self.taken_by(arm))
            .take(BLOCK)
            .map(move |sample| {
                let q = sample.joints.get(joint).copied();
                (&sample.position, q.unwrap_or(T::ZERO))
            })
    }

    /// Notes that an arm has taken its [`block`](Self::block).
    pub(crate) fn take(&mut self, arm: ArmIndex) {
        let block = self.waiting_for(arm).min(BLOCK);
        if let Some(taken) = self.taken.get_mut(arm.index()) {
            *taken += block;
        }
        let [first, second, third] = self.taken;
        let gone = first.min(second).min(third);
        if gone > 0 {
            self.taken = self.taken.map(|taken| taken - gone);
            self.count = self.count.saturating_sub(gone);
            for place in 0..CAPACITY {
                let moved = self.samples.get(place + gone).copied();
                if let Some(sample) = self.samples.get_mut(place) {
                    *sample = moved.unwrap_or_default();
                }
            }
        }
    }

    fn taken_by(&self, arm: ArmIndex) -> usize {
        self.taken.get(arm.index()).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests;
