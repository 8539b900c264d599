use super::count::SampleCount;
use super::displacement::Displacement;
use super::nominal_arm::{ArmSample, COLUMNS, NominalArm};
use super::sample::SampleError;
use super::triangle::{Triangle, put_row};
use crate::Real;
use crate::robot::{Arm, ArmIndex};
use crate::snapshot::state;
use core::fmt;
use nalgebra::Vector3;

/// Rows reduced together when many samples are added at once.
const LARGE_BLOCK: usize = 16;
/// Rows reduced together otherwise: as a block they cost half of what they cost one by one, and
/// round R once.
pub(crate) const BLOCK: usize = 4;

/// Every sample ever seen of one arm, in constant memory: the 13 × 13 triangular factor R of the
/// stacked rows (φ, f(P₀)) of [`NominalArm`], 91 numbers.
///
/// Σ (f/σf)² = |R (c(P) − c(P₀), 1)|² for any parameters P, exactly, so nothing of the samples is
/// lost that the calibration could use. A solve costs the same after 20 samples and 20 million.
///
/// Every update rounds R once. In single precision that stays below the statistical error for some
/// hundred thousand samples added one by one, and for a million in blocks
/// ([`add_many`](Self::add_many), or a [`Calibrator`](crate::Calibrator), which blocks them by
/// itself); for longer streams fill a second factor and [`merge`](Self::merge) it in every thousand
/// samples, or [`forget`](Self::forget).
///
/// ```
/// use delta_cal::ArmIndex;
/// use delta_cal::robot::Arm;
/// use delta_cal::samples::{ArmFactor, NominalArm};
/// use nalgebra::Vector3;
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let arm: Arm<f64> = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0])?;
/// let nominal = NominalArm::new(&arm, &Vector3::new(0.0, 0.0, -450.0), None);
/// let mut factor = ArmFactor::new(nominal);
/// factor.add(&Vector3::new(424.0, 0.0, -481.0), 0.0, ArmIndex::First)?;
/// // The point is 481 below the elbow, the forearm 480 long: f = 481² − 480², weighted by 1/(2 Lb).
/// let expected = (481f64.powi(2) - 480f64.powi(2)) / 960.0;
/// assert!((factor.sum_of_squares(&arm).sqrt() * nominal.scale() - expected).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmFactor<T: Real> {
    nominal: NominalArm<T>,
    triangle: Triangle<T, COLUMNS, 91>,
    count: SampleCount<T>,
}

state!(ArmFactor<T>: triangle: Triangle<T, COLUMNS, 91>, count: SampleCount<T>);

/// Why two factors do not merge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MergeError {
    /// The factors were started from different arms, centres, units or noises.
    DifferentNominal,
}

impl fmt::Display for MergeError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("the factors do not share their nominal arm, centre and noise")
    }
}

impl core::error::Error for MergeError {}

impl<T: Real> ArmFactor<T> {
    /// An empty factor.
    pub const fn new(nominal: NominalArm<T>) -> Self {
        Self {
            nominal,
            triangle: Triangle::zero(),
            count: SampleCount::none(),
        }
    }

    /// What the samples are expressed against.
    pub const fn nominal(&self) -> &NominalArm<T> {
        &self.nominal
    }

    /// How many samples were taken in, forgotten ones included.
    pub const fn samples(&self) -> u64 {
        self.count.seen()
    }

    /// The effective number of samples: each counts λ for every time it was forgotten by λ.
    pub fn effective_samples(&self) -> T {
        self.count.effective()
    }

    /// Takes in one sample: platform position `x` (length) at joint angle `q` (radians).
    ///
    /// # Errors
    /// A number that is not finite or out of range, blamed on `arm`; the factor is unchanged.
    pub fn add(&mut self, x: &Vector3<T>, q: T, arm: ArmIndex) -> Result<(), SampleError> {
        let sample = self.nominal.sample(x, q, arm)?;
        self.absorb_block::<1>(&[sample]);
        Ok(())
    }

    /// Takes in up to a block of samples that were checked when they came.
    #[inline(never)]
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
        self.triangle.absorb(&mut columns);
        self.count.add(count);
    }

    /// Takes in a sample that was checked, its squared residual multiplied by a weight.
    pub(crate) fn absorb_weighted(&mut self, x: &Vector3<T>, q: T, weight: T) {
        if weight > T::ZERO {
            let mut sample = self.nominal.prepare(x, q);
            sample.weight *= weight.square_root();
            self.absorb_block::<1>(&[sample]);
        }
    }

    /// Sets what all samples are worth together.
    pub(crate) fn count_as(&mut self, effective_samples: T) {
        self.count.set_effective(effective_samples);
    }

    /// Takes in prepared samples.
    fn absorb(&mut self, samples: &[ArmSample<T>]) {
        let (blocks, rest) = samples.as_chunks::<LARGE_BLOCK>();
        for block in blocks {
            self.absorb_block::<LARGE_BLOCK>(block);
        }
        for block in rest.chunks(BLOCK) {
            self.absorb_block::<BLOCK>(block);
        }
    }

    /// Takes in up to K samples.
    fn absorb_block<const K: usize>(&mut self, samples: &[ArmSample<T>]) {
        let mut columns = [[T::ZERO; K]; COLUMNS];
        for (index, sample) in samples.iter().enumerate() {
            put_row(&mut columns, index, 0, &sample.row());
        }
        self.triangle.absorb(&mut columns);
        self.count.add(samples.len() as u64);
    }

    /// Takes in many samples, in blocks; a block costs less than its samples one by one.
    ///
    /// # Errors
    /// The first faulty sample's position in the sequence and its fault; the factor is unchanged.
    pub fn add_many<'a, I>(&mut self, samples: I, arm: ArmIndex) -> Result<(), (usize, SampleError)>
    where
        I: IntoIterator<Item = (&'a Vector3<T>, T)>,
    {
        let mut updated = *self;
        let mut block = [ArmSample::vacant(); LARGE_BLOCK];
        let mut count = 0;
        for (index, (x, q)) in samples.into_iter().enumerate() {
            let sample = self
                .nominal
                .sample(x, q, arm)
                .map_err(|error| (index, error))?;
            if let Some(place) = block.get_mut(count) {
                *place = sample;
                count += 1;
            }
            if count == LARGE_BLOCK {
                updated.absorb(&block);
                count = 0;
            }
        }
        updated.absorb(block.get(..count).unwrap_or_default());
        *self = updated;
        Ok(())
    }

    /// Adds everything another factor has seen, as if its samples had been added to this one.
    ///
    /// # Errors
    /// [`MergeError::DifferentNominal`]; the factor is unchanged.
    pub fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        if self.nominal != other.nominal {
            return Err(MergeError::DifferentNominal);
        }
        self.triangle.merge(&other.triangle);
        self.count.merge(&other.count);
        Ok(())
    }

    /// Lets everything seen so far count λ times as much: Σ f² is multiplied by λ. λ is clamped to
    /// [0, 1]; NaN forgets nothing.
    pub fn forget(&mut self, lambda: T) {
        if !(lambda < T::ONE) {
            return;
        }
        let lambda = lambda.larger(T::ZERO);
        self.triangle.scale(lambda.square_root());
        self.count.forget(lambda);
    }

    /// Samples since it last forgot.
    pub(crate) const fn recent(&self) -> u64 {
        self.count.recent()
    }

    /// Σ (f(P)/σf)² over everything seen, for any parameters; without a stated noise σf = 2 Lb and
    /// the sum is in units of [`NominalArm::scale`] squared.
    pub fn sum_of_squares(&self, arm: &Arm<T>) -> T {
        let correction = self.nominal.correction_to(arm);
        self.residual(&Displacement::new(&self.nominal, &correction))
            .1
    }

    /// R (δc, 1): its first twelve entries, and the sum of the squares of all thirteen.
    pub(crate) fn residual(&self, at: &Displacement<T>) -> ([T; 12], T) {
        let mut residual = [T::ZERO; 12];
        let mut sum = T::ZERO;
        for (index, row) in self.triangle.rows().enumerate() {
            let Some((right, coefficients)) = row.split_last() else {
                continue;
            };
            let mut entry = *right;
            let below = at.coefficients.get(index..).unwrap_or_default();
            for (factor, coefficient) in coefficients.iter().zip(below) {
                entry += *factor * *coefficient;
            }
            if let Some(target) = residual.get_mut(index) {
                *target = entry;
            }
            sum += entry * entry;
        }
        (residual, sum)
    }

    /// The least sum of squares that any coefficients whatever could leave.
    pub(crate) fn least_sum_of_squares(&self) -> T {
        self.triangle.least_sum_of_squares()
    }

    /// The square triangular part of the features, and the right-hand side.
    pub(crate) fn triangle(&self) -> &Triangle<T, COLUMNS, 91> {
        &self.triangle
    }
}
