use crate::Real;
use crate::robot::{Drive, Parameter, ParameterKind};
use crate::samples::NominalArm;
use core::fmt;

/// Manufacturing tolerance: one standard deviation of each parameter about its nominal value. As a
/// prior it adds the eight rows (p − `p_nominal`)/tolerance to an arm's least-squares problem.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tolerance<T> {
    length: T,
    angle: T,
    #[cfg(feature = "linear")]
    zero: T,
    #[cfg(feature = "linear")]
    scale: T,
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
    /// The tolerance of the carriages' zero must be a finite number greater than 0.
    Zero,
    /// The tolerance of scales must be a finite number greater than 0.
    Scale,
}

impl fmt::Display for ToleranceError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Length => "the tolerance of lengths must be a finite number greater than 0",
            Self::Angle => "the tolerance of angles must be a finite number greater than 0",
            Self::Zero => {
                "the tolerance of the carriages' zero must be a finite number greater than 0"
            }
            Self::Scale => "the tolerance of scales must be a finite number greater than 0",
        })
    }
}

impl core::error::Error for ToleranceError {}

impl<T: Real> Tolerance<T> {
    /// One σ of `Dx, Dy, Dz, La_x, La_y, Lb` (length) and of θ, α (radians). Of linear drives the first holds
    /// for `Dx, Dy, Dz, Lb` and the second for the leans and the scale.
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
        Ok(Self {
            length,
            angle,
            #[cfg(feature = "linear")]
            zero: length,
            #[cfg(feature = "linear")]
            scale: angle,
        })
    }

    /// The same with one σ of the carriages' zero (length), which end stops hold worse than machining, and of
    /// the scale of their travel (no unit).
    ///
    /// # Errors
    /// A number that is not finite or not positive.
    #[cfg(feature = "linear")]
    pub fn with_linear(mut self, zero: T, scale: T) -> Result<Self, ToleranceError> {
        if !(zero > T::ZERO && zero.finite()) {
            return Err(ToleranceError::Zero);
        }
        if !(scale > T::ZERO && scale.finite()) {
            return Err(ToleranceError::Scale);
        }
        (self.zero, self.scale) = (zero, scale);
        Ok(self)
    }

    /// One σ of a parameter: length, radians or no unit.
    pub fn of(&self, parameter: Parameter) -> T {
        match parameter {
            #[cfg(feature = "linear")]
            Parameter::Zero => self.zero,
            #[cfg(feature = "linear")]
            Parameter::Scale => self.scale,
            _ => match parameter.kind() {
                ParameterKind::Length => self.length,
                ParameterKind::Angle | ParameterKind::Ratio => self.angle,
            },
        }
    }

    /// One σ at each [place](Drive::places) of an arm's parameters; 0 at an empty one.
    pub fn of_places(&self, drive: Drive) -> [T; 8] {
        let places = drive.places();
        places.map(|parameter| parameter.map_or(T::ZERO, |parameter| self.of(parameter)))
    }

    /// 1/tolerance of each parameter in the nominal arm's units; zeros without one. Nothing else holds the
    /// place that an arm leaves empty.
    pub(crate) fn weights(tolerance: Option<&Self>, nominal: &NominalArm<T>) -> [T; 8] {
        nominal
            .arm()
            .drive()
            .places()
            .map(|parameter| match (parameter, tolerance) {
                (Some(parameter), Some(tolerance)) => {
                    nominal.unit_of(parameter) / tolerance.of(parameter)
                }
                (Some(_), None) => T::ZERO,
                (None, _) => T::ONE,
            })
    }
}
