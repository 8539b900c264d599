use super::arm::Arm;
use super::arm_index::ArmIndex;
use super::drive::Drive;
use super::geometry_error::GeometryError;
#[cfg(feature = "transmission")]
use super::transmission::Transmission;
use crate::Real;
use nalgebra::Vector3;

/// A Delta robot: three arms that meet in the platform point. `3 × 8 = 24` parameters, or `3 × 7 = 21` with
/// linear drives.
///
/// Lengths are in any one unit; every length that comes out is in the same one.
///
/// ```
/// use delta_cal::{Robot, SymmetricRobot};
/// # fn main() -> Result<(), delta_cal::robot::GeometryError> {
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
    /// (it is 3 for a robot whose motor axes lie in the base plane); [`GeometryError::MixedDrives`].
    pub fn new(arms: [Arm<T>; 3]) -> Result<Self, GeometryError> {
        let robot = Self { arms };
        let [first, second, third] = &robot.arms;
        if first.drive() != second.drive() || first.drive() != third.drive() {
            return Err(GeometryError::MixedDrives);
        }
        let up = robot.up();
        if !(up.dot(&up) > T::from_f64(0.09)) {
            return Err(GeometryError::NoCommonUp);
        }
        Ok(robot)
    }

    /// The robot of 24 parameters, eight an arm in the order of [`Parameter::ROTARY`](crate::Parameter::ROTARY):
    /// lengths, and θ and α in radians.
    ///
    /// The table can stand in a controller's flash as a constant. The robot itself cannot: it holds the
    /// sines and cosines of the table's angles, which Rust does not compute at compile time, and it is
    /// checked when it is made.
    ///
    /// # Errors
    /// As [`Arm::new`] and [`Robot::new`].
    ///
    /// ```
    /// use delta_cal::Robot;
    /// // Dx, Dy, Dz, θ, α, La_x, La_y, Lb of each arm, mm and radians.
    /// const AS_DRAWN: [[f32; 8]; 3] = [
    ///     [164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0],
    ///     [-82.0, 142.02817, 0.0, 2.0943952, 0.0, 260.0, 0.0, 480.0],
    ///     [-82.0, -142.02817, 0.0, 4.1887903, 0.0, 260.0, 0.0, 480.0],
    /// ];
    /// let robot = Robot::from_parameters(AS_DRAWN)?;
    /// assert_eq!(robot.parameters(), AS_DRAWN);
    /// # Ok::<(), delta_cal::robot::GeometryError>(())
    /// ```
    pub fn from_parameters(parameters: [[T; 8]; 3]) -> Result<Self, GeometryError> {
        let [first, second, third] = parameters;
        Self::new([Arm::new(first)?, Arm::new(second)?, Arm::new(third)?])
    }

    /// A robot with the same drives and transmissions and other parameters, at their [places](Drive::places).
    ///
    /// # Errors
    /// As [`Arm::with_parameters`] and [`Robot::new`].
    pub fn with_parameters(&self, parameters: [[T; 8]; 3]) -> Result<Self, GeometryError> {
        let ([one, two, three], [first, second, third]) = (&self.arms, parameters);
        Self::new([
            one.with_parameters(first)?,
            two.with_parameters(second)?,
            three.with_parameters(third)?,
        ])
    }

    /// The same robot with other transmissions.
    ///
    /// # Errors
    /// [`GeometryError::TransmissionTooLarge`] of a robot with linear drives.
    #[cfg(feature = "transmission")]
    pub fn with_transmissions(
        &self,
        transmissions: [Transmission<T>; 3],
    ) -> Result<Self, GeometryError> {
        let ([one, two, three], [first, second, third]) = (self.arms, transmissions);
        Ok(Self {
            arms: [
                one.with_transmission(first)?,
                two.with_transmission(second)?,
                three.with_transmission(third)?,
            ],
        })
    }

    /// The transmission of each joint.
    #[cfg(feature = "transmission")]
    pub fn transmissions(&self) -> [Transmission<T>; 3] {
        let own = |arm: &Arm<T>| arm.transmission().copied().unwrap_or(Transmission::EXACT);
        let [first, second, third] = &self.arms;
        [own(first), own(second), own(third)]
    }

    /// How the joints move the elbows.
    #[inline]
    pub const fn drive(&self) -> Drive {
        let [first, ..] = &self.arms;
        first.drive()
    }

    /// All parameters, as [`from_parameters`](Self::from_parameters) takes them; of linear drives at their
    /// [places](Drive::places).
    pub const fn parameters(&self) -> [[T; 8]; 3] {
        let [first, second, third] = &self.arms;
        [first.parameters(), second.parameters(), third.parameters()]
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
