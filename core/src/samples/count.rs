use crate::Real;
use crate::snapshot::state;

/// How many samples a factor holds, and what they count after forgetting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SampleCount<T> {
    seen: u64,
    /// Samples since the last forgetting, and the weight of those before it.
    recent: u64,
    remembered: T,
}

state!(SampleCount<T>: seen: u64, recent: u64, remembered: T);

impl<T: Real> SampleCount<T> {
    pub(crate) const fn none() -> Self {
        Self {
            seen: 0,
            recent: 0,
            remembered: T::ZERO,
        }
    }

    /// How many samples were taken in, forgotten ones included.
    pub(crate) const fn seen(&self) -> u64 {
        self.seen
    }

    /// Samples since it last forgot.
    pub(crate) const fn recent(&self) -> u64 {
        self.recent
    }

    /// Each sample counts λ for every time it was forgotten by λ.
    pub(crate) fn effective(&self) -> T {
        self.remembered + T::from_count(self.recent)
    }

    pub(crate) fn add(&mut self, samples: u64) {
        self.seen = self.seen.saturating_add(samples);
        self.recent = self.recent.saturating_add(samples);
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.seen = self.seen.saturating_add(other.seen);
        self.recent = self.recent.saturating_add(other.recent);
        self.remembered += other.remembered;
    }

    /// Everything seen so far counts λ times as much, λ in [0, 1].
    pub(crate) fn forget(&mut self, lambda: T) {
        self.remembered = self.effective() * lambda;
        self.recent = 0;
    }

    /// What is there counts so much, whatever it was.
    pub(crate) fn set_effective(&mut self, samples: T) {
        self.remembered = samples;
        self.recent = 0;
    }
}
