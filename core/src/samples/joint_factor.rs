use super::displacement::Displacement;
use super::factor::{BLOCK, MergeError, SampleCount};
use super::forgetting::Forgetting;
use super::nominal_arm::{FEATURES, NominalArm};
use super::sample::{Noise, Sample};
use super::triangle::Triangle;
use super::whitened_sample::{JointDisplacement, MeanPose, WhitenedSample};
use crate::Real;
use crate::robot::Robot;
use crate::state::state;
use nalgebra::Vector3;

/// Twelve features per arm, and the right-hand side.
pub(crate) const JOINT_COLUMNS: usize = 3 * FEATURES + 1;

/// All samples of a robot, in constant memory: the 37 × 37 triangular factor R of the whitened rows of all three
/// closures, 703 numbers.
///
/// The closure errors fᵢ of a sample's three arms share the position noise:
///
/// ```text
/// cov(f)ᵢⱼ = 4 (X − Bᵢ)ᵀ Σx (X − Bⱼ) + δᵢⱼ (∂fᵢ/∂qᵢ)² σq²        W = L⁻¹,   L Lᵀ = cov(f)
/// (W f)ₘ   = Σᵢ Wₘᵢ φᵢᵀ (c(Pᵢ) − c(Pᵢ₀)) + Σᵢ Wₘᵢ fᵢ(P₀)
/// ```
///
/// To first order, W f are the whitened errors of the position, since ∂f/∂X is invertible: this keeps the information
/// that [`ArmFactor`](super::ArmFactor) loses by treating the arms as independent. φᵢ and c are those of
/// [`NominalArm`]. W is evaluated at the nominal robot.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JointFactor<T: Real> {
    nominal_arms: [NominalArm<T>; 3],
    triangle: Triangle<T, { JOINT_COLUMNS - 1 }>,
    count: SampleCount<T>,
    mean: MeanPose<T>,
}

state!(
    JointFactor<T>:
    triangle: Triangle<T, { JOINT_COLUMNS - 1 }>,
    count: SampleCount<T>,
    mean: MeanPose<T>,
);

/// The remainder of a block of samples after the first arm's columns are eliminated: one row per sample.
pub(crate) type LeftOver<T, const K: usize> = [[T; K]; JOINT_COLUMNS - FEATURES];

impl<T: Real> JointFactor<T> {
    /// An empty factor for samples of `robot`, measured about `centre`, a point within the workspace (length).
    #[inline(always)]
    pub(crate) fn new(robot: &Robot<T>, centre: &Vector3<T>, noise: Option<Noise<T>>) -> Self {
        let [first, second, third] = robot.arms();
        Self {
            nominal_arms: [
                NominalArm::new(first, centre, noise),
                NominalArm::new(second, centre, noise),
                NominalArm::new(third, centre, noise),
            ],
            triangle: Triangle::zero(),
            count: SampleCount::none(),
            mean: MeanPose::none(),
        }
    }

    /// The weighted mean of the samples.
    pub(crate) const fn mean(&self) -> &MeanPose<T> {
        &self.mean
    }

    /// The nominal arms, relative to which samples are expressed.
    pub(crate) const fn nominal_arms(&self) -> &[NominalArm<T>; 3] {
        &self.nominal_arms
    }

    /// The stated noise, if any.
    pub(crate) const fn noise(&self) -> Option<&Noise<T>> {
        let [first, ..] = &self.nominal_arms;
        first.noise()
    }

    /// The length that corresponds to a residual of 1 if no noise is stated.
    pub(crate) const fn unit(&self) -> T {
        let [first, ..] = &self.nominal_arms;
        first.scale()
    }

    /// Number of samples added, including forgotten ones.
    pub(crate) const fn samples(&self) -> u64 {
        self.count.seen()
    }

    /// The effective number of samples: each counts λ for every time it was forgotten by λ.
    pub(crate) fn effective_samples(&self) -> T {
        self.count.effective()
    }

    /// Absorbs many checked samples in blocks; a block costs less than its samples one by one.
    pub(crate) fn absorb_many(&mut self, samples: &[Sample<T>]) {
        let (blocks, rest) = samples.as_chunks::<4>();
        for block in blocks {
            self.absorb::<4, 8, 12>(&block.each_ref().map(|sample| self.prepare(sample)));
        }
        for sample in rest {
            self.absorb_one(&self.prepare(sample));
        }
    }

    /// Absorbs a sample that was checked on arrival.
    pub(crate) fn absorb_one(&mut self, sample: &WhitenedSample<T>) {
        self.absorb::<1, 2, 3>(core::slice::from_ref(sample));
    }

    /// Centres, scales and whitens a sample. Rounding counts as noise, as in [`NominalArm`].
    pub(crate) fn prepare(&self, sample: &Sample<T>) -> WhitenedSample<T> {
        let unit = self.unit();
        let [q1, q2, q3] = sample.joints;
        let [first, second, third] = &self.nominal_arms;
        let [c, b, a] = [(first, q1), (second, q2), (third, q3)]
            .map(|(nominal, q)| nominal.closure(&sample.position, q, unit));
        // Cholesky factor and its inverse, from the third arm on. No pivot is less than the closure's own variance.
        let least = |pivot: T, own: T| pivot.larger(own).inverse_square_root();
        let w_aa = least(a.variance(), a.own);
        let l_ba = b.covariance(&a) * w_aa;
        let l_ca = c.covariance(&a) * w_aa;
        let w_bb = least(b.variance() - l_ba * l_ba, b.own);
        let l_cb = (c.covariance(&b) - l_ca * l_ba) * w_bb;
        let w_cc = least(c.variance() - l_ca * l_ca - l_cb * l_cb, c.own);
        let w_ba = -(l_ba * w_aa * w_bb);
        let w_cb = -(l_cb * w_bb * w_cc);
        let w_ca = -((l_ca * w_aa + l_cb * w_ba) * w_cc);
        let zero = T::ZERO;
        WhitenedSample {
            arms: [c.sample, b.sample, a.sample],
            rows: [[w_cc, w_cb, w_ca], [zero, w_bb, w_ba], [zero, zero, w_aa]],
            weight: T::ONE,
        }
    }

    /// Absorbs up to K samples; the columns of the second and third arm hold two and three times as many rows.
    fn absorb<const K: usize, const K2: usize, const K3: usize>(
        &mut self,
        samples: &[WhitenedSample<T>],
    ) {
        let left = self.absorb_first::<K>(samples);
        self.absorb_others::<K, K2, K3>(samples, &left);
    }

    /// Eliminates the first arm's columns.
    pub(crate) fn absorb_first<const K: usize>(
        &mut self,
        samples: &[WhitenedSample<T>],
    ) -> LeftOver<T, K> {
        let mut columns = [[T::ZERO; K]; JOINT_COLUMNS];
        for (index, sample) in samples.iter().take(K).enumerate() {
            sample.put(0, &mut columns, index);
        }
        self.triangle.eliminate(&mut columns, FEATURES);
        let [_, _, _, _, _, _, _, _, _, _, _, _, left @ ..] = columns;
        left
    }

    /// Eliminates the other arms' columns from the remainder of the first rows and from the second and third row of
    /// each sample.
    pub(crate) fn absorb_others<const K: usize, const K2: usize, const K3: usize>(
        &mut self,
        samples: &[WhitenedSample<T>],
        left: &LeftOver<T, K>,
    ) {
        let mut columns = [[T::ZERO; K2]; JOINT_COLUMNS - FEATURES];
        copy_rows(left, &mut columns);
        for (index, sample) in samples.iter().take(K).enumerate() {
            sample.put(1, &mut columns, K + index);
        }
        self.triangle.eliminate(&mut columns, FEATURES);
        let mut last = [[T::ZERO; K3]; JOINT_COLUMNS - 2 * FEATURES];
        copy_rows(columns.get(FEATURES..).unwrap_or_default(), &mut last);
        for (index, sample) in samples.iter().take(K).enumerate() {
            sample.put(2, &mut last, K2 + index);
        }
        self.triangle.eliminate(&mut last, FEATURES + 1);
        self.count.add(samples.len() as u64);
        for sample in samples {
            self.mean.add(&sample.pose());
        }
    }

    /// Adds everything another factor has accumulated, as if its samples had been added to this one.
    ///
    /// # Errors
    /// [`MergeError::DifferentNominal`]; the factor is unchanged.
    pub(crate) fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        if self.nominal_arms != other.nominal_arms {
            return Err(MergeError::DifferentNominal);
        }
        self.triangle.merge_by_rows(&other.triangle);
        self.count.merge(&other.count);
        self.mean.add(&other.mean);
        Ok(())
    }

    /// Multiplies the weight of everything accumulated so far, and the sum of squares, by λ. λ is clamped to [0, 1];
    /// NaN forgets nothing.
    pub(crate) fn forget(&mut self, lambda: T) {
        if !(lambda < T::ONE) {
            return;
        }
        let lambda = lambda.larger(T::ZERO);
        self.triangle.scale(lambda.square_root());
        self.count.forget(lambda);
        self.mean.weight *= lambda;
    }

    /// Lets the samples fade for one more, while so many wait; not while a pair is half absorbed.
    pub(crate) fn fade(&mut self, forgetting: &Forgetting<T>, waiting: usize) {
        let most = if waiting > 2 { usize::MAX } else { BLOCK };
        let lambda = self.count.fading(forgetting, waiting, waiting == 2, most);
        self.forget(lambda);
    }

    #[inline(never)] // with `residual_sum` and `gradient` 1.1 kB of joint stack
    pub(crate) fn displaced(&self, corrections: &[[T; 8]; 3]) -> JointDisplacement<T> {
        let [first, second, third] = &self.nominal_arms;
        let [one, two, three] = corrections;
        JointDisplacement {
            arms: [
                Displacement::new(first, one),
                Displacement::new(second, two),
                Displacement::new(third, three),
            ],
        }
    }

    /// |R (δc, 1)|².
    #[inline(never)] // see `displaced`
    pub(crate) fn residual_sum(&self, at: &JointDisplacement<T>) -> T {
        let mut sum = self.least_sum_of_squares();
        for entry in self.triangle.leading_residual(&at.coefficients()) {
            sum += entry.squared();
        }
        sum
    }

    /// ½ ∂|R (δc, 1)|²/∂P.
    #[inline(never)] // see `displaced`
    pub(crate) fn gradient(&self, at: &JointDisplacement<T>) -> [T; 24] {
        let residual = self.triangle.leading_residual(&at.coefficients());
        at.gradient_of(&self.triangle.leading_transposed(&residual))
    }

    /// The least sum of squares over all coefficients, including those of no robot.
    pub(crate) fn least_sum_of_squares(&self) -> T {
        self.triangle.least_sum_of_squares()
    }

    /// The triangle of the features, and the right-hand side.
    pub(crate) const fn triangle(&self) -> &Triangle<T, { JOINT_COLUMNS - 1 }> {
        &self.triangle
    }
}

fn copy_rows<T: Copy, const K: usize, const L: usize>(from: &[[T; K]], to: &mut [[T; L]]) {
    for (target, source) in to.iter_mut().zip(from) {
        for (entry, value) in target.iter_mut().zip(source) {
            *entry = *value;
        }
    }
}

#[cfg(test)]
mod tests;
