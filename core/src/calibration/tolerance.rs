use crate::Real;
use crate::robot::{Parameter, ParameterKind};
use crate::samples::NominalArm;
use core::fmt;

/// Manufacturing tolerance: one standard deviation of each parameter about its nominal value. As a
/// prior it adds the eight rows (p − `p_nominal`)/tolerance to an arm's least-squares problem.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tolerance<T> {
    length: T,
    angle: T,
}

/// Why two numbers are not a tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ToleranceError {
    /// The tolerance of lengths must be a finite number greater than 0.
    Length,
    /// The tolerance of angles must be a finite number greater than 0.
    Angle,
}

impl fmt::Display for ToleranceError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Length => "the tolerance of lengths must be a finite number greater than 0",
            Self::Angle => "the tolerance of angles must be a finite number greater than 0",
        })
    }
}

impl core::error::Error for ToleranceError {}

impl<T: Real> Tolerance<T> {
    /// One σ of `Dx, Dy, Dz, La_x, La_y, Lb` (length) and of θ, α (radians).
    ///
    /// # Errors
    /// A number that is not finite or not positive.
    pub fn new(length: T, angle: T) -> Result<Self, ToleranceError> {
        if !(length > T::ZERO && length.finite()) {
            return Err(ToleranceError::Length);
        }
        if !(angle > T::ZERO && angle.finite()) {
            return Err(ToleranceError::Angle);
        }
        Ok(Self { length, angle })
    }

    /// One σ of a parameter: length or radians.
    pub fn of(&self, parameter: Parameter) -> T {
        match parameter.kind() {
            ParameterKind::Length => self.length,
            ParameterKind::Angle => self.angle,
        }
    }

    /// 1/tolerance of each parameter in the nominal arm's units.
    pub(crate) fn weights(&self, nominal: &NominalArm<T>) -> [T; 8] {
        Parameter::ALL.map(|parameter| nominal.unit_of(parameter) / self.of(parameter))
    }
}
