use super::displacement::Displacement;
use super::forgetting::Forgetting;
use super::nominal_arm::{COLUMNS, FEATURES, NominalArm};
use super::sample::Sample;
#[cfg(test)]
use super::sample::SampleError;
use super::triangle::{Triangle, put_row};
use crate::robot::{Arm, ArmIndex};
use crate::state::state;
use crate::{Busy, Real};
use nalgebra::Vector3;

/// Rows reduced together when many samples are added at once.
const LARGE_BLOCK: usize = 16;
/// Rows reduced together otherwise: a block costs half as much as its rows one by one, and rounds R only once.
pub(crate) const BLOCK: usize = 4;

/// All samples of one arm, in constant memory: the 13 × 13 triangular factor R of the stacked rows (φ, f(P₀)) of
/// [`NominalArm`], 91 numbers.
///
/// Σ (f/σf)² = |R (c(P) − c(P₀), 1)|² exactly, for any parameters P, so no information relevant to the calibration is
/// lost. A solve costs the same after 20 samples as after 20 million.
///
/// Every update rounds R once. In single precision the rounding stays below the statistical error for a few hundred
/// thousand samples added one by one, and for a million in blocks (as [`IkmCalibrator`](crate::IkmCalibrator) adds
/// them). For longer streams, fill a second factor and [`merge`](Self::merge) it every thousand samples, or
/// [`forget`](Self::forget).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ArmFactor<T: Real> {
    nominal: NominalArm<T>,
    triangle: Triangle<T, FEATURES>,
    count: SampleCount<T>,
}

state!(ArmFactor<T>: triangle: Triangle<T, FEATURES>, count: SampleCount<T>);

/// Why two factors cannot be merged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MergeError {
    /// The calibrators have different robots or noises.
    #[error("the calibrators are of different robots or noises")]
    DifferentNominal,
    /// A solve is in progress.
    #[error(transparent)]
    Busy(#[from] Busy),
}

impl<T: Real> ArmFactor<T> {
    /// An empty factor.
    #[inline(always)]
    pub(crate) const fn new(nominal: NominalArm<T>) -> Self {
        Self {
            nominal,
            triangle: Triangle::zero(),
            count: SampleCount::none(),
        }
    }

    /// The nominal arm, relative to which samples are expressed.
    pub(crate) const fn nominal(&self) -> &NominalArm<T> {
        &self.nominal
    }

    /// Number of samples added, including forgotten ones.
    pub(crate) const fn samples(&self) -> u64 {
        self.count.seen()
    }

    /// The effective number of samples: each counts λ for every time it was forgotten by λ.
    pub(crate) fn effective_samples(&self) -> T {
        self.count.effective()
    }

    #[cfg(test)]
    pub(crate) fn add(&mut self, x: &Vector3<T>, q: T, arm: ArmIndex) -> Result<(), SampleError> {
        self.nominal.check(x, q, arm)?;
        self.absorb_checked(core::iter::once((x, q)));
        Ok(())
    }

    /// Absorbs up to a block of samples that were checked on arrival.
    pub(crate) fn absorb_checked<'a>(
        &mut self,
        samples: impl Iterator<Item = (&'a Vector3<T>, T)>,
    ) {
        let mut columns = [[T::ZERO; BLOCK]; COLUMNS];
        let mut count = 0;
        for (index, (x, q)) in samples.take(BLOCK).enumerate() {
            put_row(&mut columns, index, 0, &self.nominal.prepare(x, q).row());
            count += 1;
        }
        self.triangle.absorb_four(&mut columns);
        self.count.add(count);
    }

    /// Absorbs up to K samples.
    fn absorb_block<const K: usize>(&mut self, samples: &[Sample<T>], joint: usize) {
        let mut columns = [[T::ZERO; K]; COLUMNS];
        for (index, sample) in samples.iter().enumerate() {
            let q = sample.joints.get(joint).copied().unwrap_or(T::ZERO);
            let row = self.nominal.prepare(&sample.position, q).row();
            put_row(&mut columns, index, 0, &row);
        }
        self.triangle.absorb(&mut columns);
        self.count.add(samples.len() as u64);
    }

    /// Absorbs many checked samples in blocks; a block costs less than its samples one by one.
    pub(crate) fn absorb_many(&mut self, samples: &[Sample<T>], arm: ArmIndex) {
        let (blocks, rest) = samples.as_chunks::<LARGE_BLOCK>();
        for block in blocks {
            self.absorb_block::<LARGE_BLOCK>(block, arm.index());
        }
        for block in rest.chunks(BLOCK) {
            self.absorb_block::<BLOCK>(block, arm.index());
        }
    }

    /// Adds everything another factor has accumulated, as if its samples had been added to this one.
    ///
    /// # Errors
    /// [`MergeError::DifferentNominal`]; the factor is unchanged.
    pub(crate) fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        if self.nominal != other.nominal {
            return Err(MergeError::DifferentNominal);
        }
        self.triangle.merge::<COLUMNS>(&other.triangle);
        self.count.merge(&other.count);
        Ok(())
    }

    /// Multiplies the weight of everything accumulated so far, and Σ f², by λ. λ is clamped to [0, 1]; NaN forgets
    /// nothing.
    pub(crate) fn forget(&mut self, lambda: T) {
        if !(lambda < T::ONE) {
            return;
        }
        let lambda = lambda.larger(T::ZERO);
        self.triangle.scale(lambda.square_root());
        self.count.forget(lambda);
    }

    /// Lets the samples fade for one more, while so many wait and a block may be due.
    pub(crate) fn fade(&mut self, forgetting: &Forgetting<T>, waiting: usize, due: bool) {
        let lambda = self.count.fading(forgetting, waiting, due, 2 * BLOCK);
        self.forget(lambda);
    }

    /// Samples added since it last forgot.
    pub(crate) const fn recent(&self) -> u64 {
        self.count.recent()
    }

    /// Σ (f(P)/σf)² over all samples, for any parameters; without a stated noise σf = 2 Lb, and the sum is in units of
    /// [`NominalArm::scale`] squared.
    pub(crate) fn sum_of_squares(&self, arm: &Arm<T>) -> T {
        let correction = self.nominal.correction_to(arm);
        self.residual(&Displacement::new(&self.nominal, &correction))
            .1
    }

    /// R (δc, 1): its first twelve entries, and the sum of the squares of all thirteen.
    pub(crate) fn residual(&self, at: &Displacement<T>) -> ([T; 12], T) {
        let residual = self.triangle.leading_residual(&at.coefficients);
        let mut sum = T::ZERO;
        for entry in residual {
            sum += entry.squared();
        }
        (residual, sum + self.least_sum_of_squares())
    }

    /// The least sum of squares over all coefficients, including those of no arm.
    pub(crate) fn least_sum_of_squares(&self) -> T {
        self.triangle.least_sum_of_squares()
    }

    /// The triangle of the features, and the right-hand side.
    pub(crate) fn triangle(&self) -> &Triangle<T, FEATURES> {
        &self.triangle
    }
}

/// Number of samples in a factor, and their weight after forgetting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SampleCount<T> {
    seen: u64,
    /// Samples since the last forgetting, and the weight of those before it.
    recent: u64,
    remembered: T,
    /// Samples added with forgetting that nothing has been forgotten for.
    owed: usize,
}

state!(SampleCount<T>: seen: u64, recent: u64, remembered: T, owed: usize);

impl<T: Real> SampleCount<T> {
    #[inline(always)]
    pub(crate) const fn none() -> Self {
        Self {
            seen: 0,
            recent: 0,
            remembered: T::ZERO,
            owed: 0,
        }
    }

    /// Number of samples added, including forgotten ones.
    pub(crate) const fn seen(&self) -> u64 {
        self.seen
    }

    /// Samples added since it last forgot.
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

    /// Counts a sample that makes those held fade, and returns by how much they do now. Samples that wait are younger than
    /// those held: nothing fades until a block is `due`, or `most` samples were absorbed already, by a solve.
    pub(crate) fn fading(
        &mut self,
        forgetting: &Forgetting<T>,
        waiting: usize,
        due: bool,
        most: usize,
    ) -> T {
        self.owed += 1;
        let absorbed = self.owed.saturating_sub(waiting);
        if !due && absorbed < most {
            return T::ONE;
        }
        self.owed -= absorbed;
        forgetting.after(absorbed as u64)
    }

    /// Multiplies the weight of all samples by λ, λ in [0, 1].
    pub(crate) fn forget(&mut self, lambda: T) {
        self.remembered = self.effective() * lambda;
        self.recent = 0;
    }
}

/// A block, plus the samples that arrive while the arms absorb it, one arm per sample.
const CAPACITY: usize = BLOCK + 2;

/// Samples waiting for three factors. Factors absorb blocks, no two factors at the same sample, so that no sample costs
/// much more than another.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Waiting<T: Real> {
    /// In order of arrival, padded with zeros.
    samples: [Sample<T>; CAPACITY],
    count: usize,
    /// How many of them each arm has absorbed.
    taken: [usize; 3],
}

state!(
    Waiting<T>:
    samples: [Sample<T>; CAPACITY],
    count: usize,
    taken: [usize; 3];
    [.., count, first, second, third]
        if usize::from(*count) <= CAPACITY && first.max(second).max(third) <= count
);

impl<T: Real> Waiting<T> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        Self {
            samples: [Sample::default(); CAPACITY],
            count: 0,
            taken: [0; 3],
        }
    }

    /// Whether there is no room: never, if each sample is followed by a block that is due. Counts that were restored may
    /// be others.
    pub(crate) const fn full(&self) -> bool {
        self.count >= CAPACITY
    }

    /// Adds a sample, for which there must be room.
    pub(crate) fn push(&mut self, sample: &Sample<T>) {
        debug_assert!(!self.full());
        if let Some(place) = self.samples.get_mut(self.count) {
            *place = *sample;
            self.count += 1;
        }
    }

    /// Number of samples an arm has not absorbed.
    pub(crate) fn waiting_for(&self, arm: ArmIndex) -> usize {
        self.count.saturating_sub(self.taken_by(arm))
    }

    /// The arm that is to take in its block: the first as soon as that is complete, the others one and two samples later.
    pub(crate) fn due(&self) -> Option<ArmIndex> {
        let due = |arm: &ArmIndex| self.waiting_for(*arm) >= BLOCK + arm.index();
        ArmIndex::ALL.iter().copied().find(due)
    }

    /// Positions and joint angles waiting for an arm, at most a block.
    pub(crate) fn block(&self, arm: ArmIndex) -> impl Iterator<Item = (&Vector3<T>, T)> {
        let joint = arm.index();
        let waiting = self.samples.get(self.taken_by(arm)..self.count);
        let block = waiting.unwrap_or_default().iter().take(BLOCK);
        block.map(move |sample| {
            let q = sample.joints.get(joint).copied();
            (&sample.position, q.unwrap_or(T::ZERO))
        })
    }

    /// Records that an arm has absorbed its [`block`](Self::block).
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
mod tests {
    #![allow(clippy::cast_possible_truncation, clippy::unwrap_used)]

    use super::ArmFactor;
    use crate::robot::{Arm, ArmIndex};
    use crate::samples::{Noise, NominalArm};
    use nalgebra::Vector3;

    /// No stated noise claims more than the scalar can hold: half an ε of the position, and 4ε Lb² in f.
    #[test]
    fn rounding_is_a_noise_too() {
        let arm = Arm::<f32>::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0]).unwrap();
        let noises = [
            Noise::new(1e-12_f32, 0.0),
            Noise::by_axis([1e-12_f32, 1e-12, 2e-12], 0.0),
        ];
        for (far, noise) in [0.0_f64, 4e4]
            .into_iter()
            .flat_map(|far| noises.map(|noise| (far, noise.ok())))
        {
            let mut moved = arm.parameters();
            moved[1] += far as f32;
            let arm = Arm::new(moved).unwrap();
            let centre = Vector3::new(0.0, far as f32, -450.0);
            let mut factor = ArmFactor::new(NominalArm::new(&arm, &centre, noise));
            let x = Vector3::new(424.0, far as f32, -481.0);
            factor.add(&x, 0.0, ArmIndex::First).unwrap();
            let f = 481.0_f64.powi(2) - 480.0_f64.powi(2);
            let epsilon = f64::from(f32::EPSILON);
            let position = x.cast::<f64>().norm() * epsilon / 2.0 * 2.0 * 480.0;
            let arithmetic = 4.0 * epsilon * 480.0 * 480.0;
            let expected = f / position.hypot(arithmetic);
            let found = f64::from(factor.sum_of_squares(&arm)).sqrt();
            assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
        }
    }
}
