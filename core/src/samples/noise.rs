use crate::Real;
use core::fmt;

/// Measurement noise: one standard deviation, the same for every sample.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Noise<T> {
    position: T,
    joint: T,
}

/// Why two numbers are not a noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NoiseError {
    /// The position noise must be a finite number greater than 0.
    Position,
    /// The joint noise must be a finite number, 0 or greater.
    Joint,
}

impl fmt::Display for NoiseError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Position => "the position noise must be a finite number greater than 0",
            Self::Joint => "the joint noise must be a finite number, 0 or greater",
        })
    }
}

impl core::error::Error for NoiseError {}

impl<T: Real> Noise<T> {
    /// σx of each coordinate of the position (length), and σq of each joint angle (radians).
    ///
    /// # Errors
    /// σx that is not positive, σq that is negative, or either not finite.
    ///
    /// ```
    /// use delta_cal::Noise;
    /// assert!(Noise::new(0.001, 0.0).is_ok());
    /// assert!(Noise::new(0.0, 1e-4).is_err());
    /// ```
    pub fn new(position: T, joint: T) -> Result<Self, NoiseError> {
        if !(position > T::ZERO && position.finite()) {
            return Err(NoiseError::Position);
        }
        if !(joint >= T::ZERO && joint.finite()) {
            return Err(NoiseError::Joint);
        }
        Ok(Self { position, joint })
    }

    /// σx of each coordinate. Length.
    pub fn position(&self) -> T {
        self.position
    }

    /// σq of each joint angle. Radians.
    pub fn joint(&self) -> T {
        self.joint
    }
}
