//! The robot: three arms of eight geometric parameters (Model 24).

mod arm;
mod frame;
mod parameter;
mod symmetric;

pub use arm::{Arm, ArmBasis};
pub use frame::{AlignmentError, RigidTransform};
pub use parameter::{Parameter, ParameterKind};
pub use symmetric::SymmetricRobot;

use crate::Real;
use core::fmt;
use nalgebra::Vector3;

/// One of the robot's three arms, counted from 1 as the joints `q1`, `q2`, `q3` are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ArmIndex {
    /// Arm 1, driven by `q1`.
    First,
    /// Arm 2, driven by `q2`.
    Second,
    /// Arm 3, driven by `q3`.
    Third,
}

impl ArmIndex {
    /// All three, in order.
    pub const ALL: [Self; 3] = [Self::First, Self::Second, Self::Third];

    /// Position in an array of three: 0, 1 or 2.
    pub const fn index(self) -> usize {
        match self {
            Self::First => 0,
            Self::Second => 1,
            Self::Third => 2,
        }
    }
}

impl fmt::Display for ArmIndex {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "arm {}", self.index() + 1)
    }
}

/// Why eight numbers are not the geometry of an arm, or three arms not a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum GeometryError {
    /// A parameter is NaN or infinite.
    NonFinite(Parameter),
    /// The upper arm (La_x, La_y) or the forearm Lb is not longer than 0.
    NotPositive(Parameter),
    /// |α| ≥ 90°: the arm plane's "up" would point down, or be undefined.
    TiltTooLarge,
    /// |θ| > 360°.
    AzimuthTooLarge,
    /// The base or the platform radius is negative or NaN.
    RadiusInvalid,
    /// The arms' "up" directions cancel, so that "below the base" has no meaning.
    NoCommonUp,
}

impl fmt::Display for GeometryError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NonFinite(parameter) => write!(formatter, "{parameter} is not a finite number"),
            Self::NotPositive(parameter) => {
                write!(formatter, "the length {parameter} must be greater than 0")
            }
            Self::TiltTooLarge => formatter.write_str("the tilt alpha must lie within ±90°"),
            Self::AzimuthTooLarge => formatter.write_str("the azimuth theta must lie within ±360°"),
            Self::RadiusInvalid => {
                formatter.write_str("the base and platform radii must not be negative")
            }
            Self::NoCommonUp => {
                formatter.write_str("the arms' up directions cancel: the robot has no below")
            }
        }
    }
}

impl core::error::Error for GeometryError {}

/// A Delta robot: three arms that meet in the platform point. `3 × 8 = 24` parameters.
///
/// Lengths are in any one unit; every length that comes out is in the same one.
///
/// ```
/// use delta_cal::{Robot, SymmetricRobot};
/// # fn main() -> Result<(), delta_cal::GeometryError> {
/// let robot: Robot<f64> = SymmetricRobot {
///     base_radius: 194.0,
///     platform_radius: 30.0,
///     upper_arm: 260.0,
///     forearm: 480.0,
/// }
/// .robot()?;
/// assert_eq!(robot.arms()[0].d().x, 164.0);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robot<T: Real> {
    arms: [Arm<T>; 3],
}

impl<T: Real> Robot<T> {
    /// Three arms, in the order of their joints.
    ///
    /// # Errors
    /// [`GeometryError::NoCommonUp`] if the sum of the arms' up directions is shorter than 0.3
    /// (it is 3 for a robot whose motor axes lie in the base plane).
    pub fn new(arms: [Arm<T>; 3]) -> Result<Self, GeometryError> {
        let robot = Self { arms };
        let up = robot.up();
        if !(up.dot(&up) > T::from_f64(0.09)) {
            return Err(GeometryError::NoCommonUp);
        }
        Ok(robot)
    }

    /// Three arms that were a robot before.
    pub(crate) const fn of_valid(arms: [Arm<T>; 3]) -> Self {
        Self { arms }
    }

    /// The three arms, in the order of their joints.
    pub const fn arms(&self) -> &[Arm<T>; 3] {
        &self.arms
    }

    /// One arm.
    pub const fn arm(&self, arm: ArmIndex) -> &Arm<T> {
        let [first, second, third] = &self.arms;
        match arm {
            ArmIndex::First => first,
            ArmIndex::Second => second,
            ArmIndex::Third => third,
        }
    }

    /// ez₁ + ez₂ + ez₃: the platform is on the other side of the elbows' plane.
    pub fn up(&self) -> Vector3<T> {
        let [first, second, third] = &self.arms;
        first.basis().ez + second.basis().ez + third.basis().ez
    }

    /// The same robot in another scalar type; `f64` to `f32` rounds each parameter to nearest.
    ///
    /// # Errors
    /// A [`GeometryError`] if a parameter overflows or vanishes in the narrower type.
    pub fn cast<U: Real>(&self) -> Result<Robot<U>, GeometryError> {
        let [first, second, third] = &self.arms;
        Robot::new([first.cast()?, second.cast()?, third.cast()?])
    }
}
