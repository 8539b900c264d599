use crate::Real;
use core::fmt;

/// Measurement noise: one standard deviation, the same for every sample. The position's may differ by
/// axis, as that of a tracker whose distances are better than its angles.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Noise<T> {
    position: [T; 3],
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
    /// The noise of a height must be a finite number greater than 0.
    Height,
    /// The noise of a distance must be a finite number greater than 0.
    Distance,
}

impl fmt::Display for NoiseError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Position => "the position noise must be a finite number greater than 0",
            Self::Joint => "the joint noise must be a finite number, 0 or greater",
            Self::Height => "the noise of a height must be a finite number greater than 0",
            Self::Distance => "the noise of a distance must be a finite number greater than 0",
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
        Self::by_axis([position; 3], joint)
    }

    /// σx, σy, σz of the position (length), and σq of each joint angle (radians).
    ///
    /// # Errors
    /// As [`new`](Self::new).
    ///
    /// ```
    /// use delta_cal::Noise;
    /// let noise = Noise::by_axis([0.02, 0.02, 0.1], 0.0)?;
    /// assert!(noise.isotropic().is_none() && noise.position() > 0.06);
    /// # Ok::<(), delta_cal::samples::NoiseError>(())
    /// ```
    pub fn by_axis(position: [T; 3], joint: T) -> Result<Self, NoiseError> {
        if !position
            .iter()
            .all(|sigma| *sigma > T::ZERO && sigma.finite())
        {
            return Err(NoiseError::Position);
        }
        if !(joint >= T::ZERO && joint.finite()) {
            return Err(NoiseError::Joint);
        }
        Ok(Self { position, joint })
    }

    /// σx of each coordinate; where it differs by axis, the root mean square. Length.
    pub fn position(&self) -> T {
        self.isotropic().unwrap_or_else(|| {
            let [x, y, z] = self.position.map(T::squared);
            ((x + y + z) / T::from_f64(3.0)).square_root()
        })
    }

    /// σx, σy, σz. Length.
    pub const fn position_by_axis(&self) -> [T; 3] {
        self.position
    }

    /// The position's σ if it is the same in every direction. Length.
    pub fn isotropic(&self) -> Option<T> {
        let [x, y, z] = self.position;
        (x == y && y == z).then_some(x)
    }

    /// σq of each joint angle. Radians.
    pub fn joint(&self) -> T {
        self.joint
    }
}
