use crate::Real;
use crate::robot::{Drive, DriveOf};
use core::fmt;

/// The range of every joint.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct JointLimits<T> {
    minimum: T,
    maximum: T,
    drive: DriveOf,
}

/// Why two angles are not a joint's range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum JointLimitsError {
    /// An angle is NaN or infinite.
    NonFinite,
    /// The minimum is not below the maximum.
    Empty,
    /// The range is wider than a turn.
    TooWide,
}

impl fmt::Display for JointLimitsError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::NonFinite => "a joint limit is not a finite number",
            Self::Empty => "the smallest joint limit must be below the largest",
            Self::TooWide => "the joint limits span more than one turn",
        })
    }
}

impl core::error::Error for JointLimitsError {}

impl<T: Real> JointLimits<T> {
    /// All joints from `minimum` to `maximum`, in radians.
    ///
    /// # Errors
    /// Limits that are not finite, empty or wider than a turn.
    pub fn new(minimum: T, maximum: T) -> Result<Self, JointLimitsError> {
        if !(minimum.finite() && maximum.finite()) {
            return Err(JointLimitsError::NonFinite);
        }
        if !(minimum < maximum) {
            return Err(JointLimitsError::Empty);
        }
        if !(maximum - minimum <= T::TWO * T::PI) {
            return Err(JointLimitsError::TooWide);
        }
        Ok(Self {
            minimum,
            maximum,
            drive: DriveOf::ROTARY,
        })
    }

    /// All joints of linear drives from `minimum` to `maximum`, lengths.
    ///
    /// # Errors
    /// Limits that are not finite, or empty.
    #[cfg(feature = "linear")]
    pub fn travel(minimum: T, maximum: T) -> Result<Self, JointLimitsError> {
        if !(minimum.finite() && maximum.finite()) {
            return Err(JointLimitsError::NonFinite);
        }
        if !(minimum < maximum) {
            return Err(JointLimitsError::Empty);
        }
        Ok(Self {
            minimum,
            maximum,
            drive: DriveOf::LINEAR,
        })
    }

    /// Whether these are angles or travels.
    pub const fn drive(&self) -> Drive {
        self.drive.get()
    }

    /// Smallest joint angle, radians; of linear drives the smallest travel, length.
    pub fn minimum(&self) -> T {
        self.minimum
    }

    /// Largest joint angle, radians; of linear drives the largest travel, length.
    pub fn maximum(&self) -> T {
        self.maximum
    }

    /// The angle at `fraction` of the range, 0 to 1.
    pub fn at(&self, fraction: T) -> T {
        self.minimum + (self.maximum - self.minimum) * fraction
    }
}
