use super::row_by_row;
use crate::Real;
use crate::calibration::{
    ArmProblem, Linearize, Means, Normal, Piece, Problem, SPREAD_STARTS, free_start,
    problem_of_an_arm, spread_start,
};
use crate::robot::{ArmIndex, Drive};
use crate::samples::{ArmFactor, ArmSample, Displacement, NominalArm, SampleError, Waiting};
use core::fmt;
use nalgebra::Vector3;

/// Up to `N` samples of one arm, each kept: the classical form of the IKM method, for work that
/// looks at every residual. Six numbers a sample; the position is centred and scaled, the joint
/// angle held as sine and cosine.
///
/// ```
/// use delta_cal::ArmIndex;
/// use delta_cal::classical::{StoredArmSamples, StoredError};
/// use delta_cal::robot::Arm;
/// use delta_cal::samples::NominalArm;
/// use nalgebra::Vector3;
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let arm = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0])?;
/// let nominal = NominalArm::new(&arm, &Vector3::new(0.0, 0.0, -450.0), None);
/// let mut stored: StoredArmSamples<f64, 1> = StoredArmSamples::new(nominal);
/// let x = Vector3::new(424.0, 0.0, -480.0);
/// stored.add(&x, 0.0, ArmIndex::First)?;
/// assert_eq!(stored.add(&x, 0.0, ArmIndex::First), Err(StoredError::Full));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct StoredArmSamples<T: Real, const N: usize> {
    nominal: NominalArm<T>,
    /// Vacant behind the last.
    samples: [ArmSample<T>; N],
    count: usize,
}

/// Why a sample is not stored; the store is unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StoredError {
    /// All `N` places are taken.
    Full,
    /// The sample itself is at fault.
    Sample(SampleError),
}

impl fmt::Display for StoredError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Full => formatter.write_str("the store of samples is full"),
            Self::Sample(error) => error.fmt(formatter),
        }
    }
}

impl core::error::Error for StoredError {}

impl<T: Real, const N: usize> StoredArmSamples<T, N> {
    /// An empty store.
    pub const fn new(nominal: NominalArm<T>) -> Self {
        Self {
            nominal,
            samples: [ArmSample::vacant(); N],
            count: 0,
        }
    }

    /// What the samples are expressed against.
    pub const fn nominal(&self) -> &NominalArm<T> {
        &self.nominal
    }

    /// How many samples are stored.
    pub const fn len(&self) -> usize {
        self.count
    }

    /// Whether none is.
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Stores one sample: platform position `x` (length) at joint angle `q` (radians).
    ///
    /// # Errors
    /// A full store, or a number that is not finite or out of range, blamed on `arm`.
    pub fn add(&mut self, x: &Vector3<T>, q: T, arm: ArmIndex) -> Result<(), StoredError> {
        let sample = self.prepare(x, q, arm)?;
        *self.samples.get_mut(self.count).ok_or(StoredError::Full)? = sample;
        self.count += 1;
        Ok(())
    }

    /// Whether [`add`](Self::add) would take the sample.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn check(&self, x: &Vector3<T>, q: T, arm: ArmIndex) -> Result<(), StoredError> {
        self.prepare(x, q, arm).map(|_| ())
    }

    fn prepare(&self, x: &Vector3<T>, q: T, arm: ArmIndex) -> Result<ArmSample<T>, StoredError> {
        if self.count >= N {
            return Err(StoredError::Full);
        }
        self.nominal.sample(x, q, arm).map_err(StoredError::Sample)
    }

    pub(super) fn samples(&self) -> &[ArmSample<T>] {
        self.samples.get(..self.count).unwrap_or_default()
    }

    /// The same in the constant-memory form.
    fn factor(&self) -> ArmFactor<T> {
        let mut factor = ArmFactor::new(self.nominal);
        factor.absorb(&self.samples);
        factor
    }
}

impl<T: Real, const N: usize> ArmProblem<T> for StoredArmSamples<T, N> {
    fn nominal(&self) -> &NominalArm<T> {
        self.nominal()
    }
}

problem_of_an_arm!(StoredArmSamples<T, N>, N);

impl<T: Real, const N: usize> Linearize<T> for StoredArmSamples<T, N> {
    fn linearize(&self, at: &Displacement<T>, normal: &mut Normal<T>) -> T {
        row_by_row::linearize(self.samples(), at, normal)
    }

    fn sum_of_squares(&self, at: &Displacement<T>) -> T {
        row_by_row::sum_of_squares(self.samples(), at)
    }

    fn taken_in(&self) -> u64 {
        self.len() as u64
    }

    fn effective(&self) -> T {
        T::from_count(self.len() as u64)
    }

    fn means(&self) -> Means<T> {
        row_by_row::means(self.samples())
    }

    /// A store keeps no sample waiting.
    fn absorb_waiting(&mut self, _: &Waiting<T>, _: ArmIndex) {}

    fn free_start(&self) -> Option<[T; 8]> {
        free_start(&self.factor())
    }

    fn least_sum_of_squares(&self) -> T {
        self.factor().least_sum_of_squares()
    }

    fn terms_squared(&self) -> T {
        Linearize::rows_squared(self)
    }

    fn rows_squared(&self) -> T {
        row_by_row::rows_squared(self.samples())
    }
}

#[cfg(test)]
mod tests;
