use crate::Real;
#[cfg(feature = "linear")]
use crate::robot::Drive;
use crate::robot::{Arm, Parameter, ParameterKind};
use core::fmt;

/// Manufacturing tolerance: one standard deviation of each parameter about its nominal value. As a
/// prior it adds the eight rows (p − `p_nominal`)/tolerance to an arm's least-squares problem.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tolerance<T> {
    length: T,
    angle: T,
    joint_zero: Option<T>,
    #[cfg(feature = "linear")]
    zero: T,
    #[cfg(feature = "linear")]
    scale: T,
    #[cfg(feature = "linear")]
    radius: T,
    #[cfg(feature = "linear")]
    forearm: T,
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
    /// The tolerance of the joints' zeros must be a finite number greater than 0.
    JointZero,
    /// The tolerance of the carriages' zero must be a finite number greater than 0.
    Zero,
    /// The tolerance of scales must be a finite number greater than 0.
    Scale,
    /// The tolerance of the towers' common radius must be a finite number, 0 or greater.
    Radius,
    /// The tolerance of the forearms' common length must be a finite number, 0 or greater.
    Forearm,
}

impl fmt::Display for ToleranceError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Length => "the tolerance of lengths must be a finite number greater than 0",
            Self::Angle => "the tolerance of angles must be a finite number greater than 0",
            Self::JointZero => {
                "the tolerance of the joints' zeros must be a finite number greater than 0"
            }
            Self::Zero => {
                "the tolerance of the carriages' zero must be a finite number greater than 0"
            }
            Self::Scale => "the tolerance of scales must be a finite number greater than 0",
            Self::Radius => {
                "the tolerance of the towers' common radius must be a finite number, 0 or greater"
            }
            Self::Forearm => {
                "the tolerance of the forearms' common length must be a finite number, 0 or greater"
            }
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
            joint_zero: None,
            #[cfg(feature = "linear")]
            zero: length,
            #[cfg(feature = "linear")]
            scale: angle,
            #[cfg(feature = "linear")]
            radius: T::ZERO,
            #[cfg(feature = "linear")]
            forearm: T::ZERO,
        })
    }

    /// The same with one σ of each rotary joint's zero, in radians: of the direction that the upper arm has where the
    /// joint reads 0. The upper arm's length √(`La_x`² + `La_y`²) then has the σ of lengths. Without it `La_x` and `La_y`
    /// have the σ of lengths each, which is a zero known to that length over the upper arm's.
    ///
    /// Linear drives have no such zero, and do not heed it.
    ///
    /// # Errors
    /// A number that is not finite or not positive.
    pub fn with_joint_zero(mut self, sigma: T) -> Result<Self, ToleranceError> {
        if !(sigma > T::ZERO && sigma.finite()) {
            return Err(ToleranceError::JointZero);
        }
        self.joint_zero = Some(sigma);
        Ok(self)
    }

    /// One σ of each rotary joint's zero, if it is stated. Radians.
    pub const fn joint_zero(&self) -> Option<T>
    where
        T: Copy,
    {
        self.joint_zero
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

    /// The same with one σ of the radius common to all towers (length), beside each one's own; 0 for none. The
    /// calibration of an arm by itself knows nothing of the others: there a tower's place has the σ of both.
    ///
    /// # Errors
    /// A number that is not finite or is negative.
    #[cfg(feature = "linear")]
    pub fn with_radius(mut self, radius: T) -> Result<Self, ToleranceError> {
        if !(radius >= T::ZERO && radius.finite()) {
            return Err(ToleranceError::Radius);
        }
        self.radius = radius;
        Ok(self)
    }

    /// One σ of the radius common to all towers. Length.
    #[cfg(feature = "linear")]
    pub const fn radius(&self) -> T
    where
        T: Copy,
    {
        self.radius
    }

    /// The same with one σ of the length common to all forearms, beside each one's own; 0 for none. As with the
    /// radius, an arm calibrated by itself has the σ of both.
    ///
    /// # Errors
    /// A number that is not finite or is negative.
    #[cfg(feature = "linear")]
    pub fn with_forearm(mut self, forearm: T) -> Result<Self, ToleranceError> {
        if !(forearm >= T::ZERO && forearm.finite()) {
            return Err(ToleranceError::Forearm);
        }
        self.forearm = forearm;
        Ok(self)
    }

    /// One σ of the length common to all forearms of towers. Length.
    #[cfg(feature = "linear")]
    pub const fn forearm(&self) -> T
    where
        T: Copy,
    {
        self.forearm
    }

    /// By how much the common radius moves D of a tower, along x and y. Length.
    #[cfg(feature = "linear")]
    pub fn outwards(&self, arm: &Arm<T>) -> [T; 2] {
        match arm.drive() {
            Drive::Linear => arm.outwards().map(|part| self.radius * part),
            Drive::Rotary => [T::ZERO; 2],
        }
    }

    /// One σ of a parameter: length, radians or no unit. Of where a tower stands without what all have in
    /// common.
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

    /// One σ at each [place](Drive::places) of an arm's parameters, with what it has in common with the others;
    /// 0 at an empty one.
    pub fn of_places(&self, arm: &Arm<T>) -> [T; 8] {
        let places = arm.drive().places();
        places.map(|parameter| parameter.map_or(T::ZERO, |parameter| self.of_arm(arm, parameter)))
    }

    /// One σ of a parameter of this arm, with what it has in common with the others. With a
    /// [joint zero](Self::joint_zero) that of `La_x` and `La_y` is its first order at this arm.
    pub fn of_arm(&self, arm: &Arm<T>, parameter: Parameter) -> T {
        let own = self.of(parameter);
        #[cfg(feature = "linear")]
        if arm.drive() == Drive::Linear {
            let [x, y] = self.outwards(arm);
            let common = match parameter {
                Parameter::Dx => x,
                Parameter::Dy => y,
                Parameter::Lb => self.forearm,
                _ => T::ZERO,
            };
            if common != T::ZERO {
                return (own.squared() + common.squared()).square_root();
            }
            return own;
        }
        let Some(zero) = self.joint_zero else {
            return own;
        };
        let (x, y) = arm.la();
        let (along, across) = match parameter {
            Parameter::LaX => (x, y),
            Parameter::LaY => (y, x),
            _ => return own,
        };
        let along = along / arm.upper_arm_length() * own;
        (along.squared() + (across * zero).squared()).square_root()
    }
}
