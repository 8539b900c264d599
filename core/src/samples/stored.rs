use super::reference::ArmSample;
use super::{ArmFactor, Reference, SampleError};
use crate::{ArmIndex, Real};
use core::fmt;
use heapless::Vec;
use nalgebra::Vector3;

/// Up to `N` samples of one arm, each kept: the classical form of the IKM method, for work that
/// looks at every residual. Six numbers a sample; the position is centred and scaled, the joint
/// angle held as sine and cosine.
///
/// ```
/// use delta_cal::{Arm, ArmIndex, Reference, StoredArmSamples, StoredError};
/// use nalgebra::Vector3;
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let arm = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0])?;
/// let reference = Reference::new(&arm, &Vector3::new(0.0, 0.0, -450.0), None);
/// let mut stored: StoredArmSamples<f64, 1> = StoredArmSamples::new(reference);
/// let x = Vector3::new(424.0, 0.0, -480.0);
/// stored.add(&x, 0.0, ArmIndex::First)?;
/// assert_eq!(stored.add(&x, 0.0, ArmIndex::First), Err(StoredError::Full));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct StoredArmSamples<T: Real, const N: usize> {
    reference: Reference<T>,
    samples: Vec<ArmSample<T>, N>,
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
    pub const fn new(reference: Reference<T>) -> Self {
        Self {
            reference,
            samples: Vec::new(),
        }
    }

    /// What the samples are expressed against.
    pub const fn reference(&self) -> &Reference<T> {
        &self.reference
    }

    /// How many samples are stored.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Stores one sample: platform position `x` (length) at joint angle `q` (radians).
    ///
    /// # Errors
    /// A full store, or a number that is not finite or out of range, blamed on `arm`.
    pub fn add(&mut self, x: &Vector3<T>, q: T, arm: ArmIndex) -> Result<(), StoredError> {
        let sample = self.prepare(x, q, arm)?;
        self.samples.push(sample).map_err(|_| StoredError::Full)
    }

    /// Whether [`add`](Self::add) would take the sample.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn check(&self, x: &Vector3<T>, q: T, arm: ArmIndex) -> Result<(), StoredError> {
        self.prepare(x, q, arm).map(|_| ())
    }

    fn prepare(&self, x: &Vector3<T>, q: T, arm: ArmIndex) -> Result<ArmSample<T>, StoredError> {
        if self.samples.is_full() {
            return Err(StoredError::Full);
        }
        self.reference
            .sample(x, q, arm)
            .map_err(StoredError::Sample)
    }

    pub(crate) fn samples(&self) -> &[ArmSample<T>] {
        &self.samples
    }

    /// The same in the constant-memory form.
    pub(crate) fn factor(&self) -> ArmFactor<T> {
        let mut factor = ArmFactor::new(self.reference);
        factor.absorb(&self.samples);
        factor
    }
}
