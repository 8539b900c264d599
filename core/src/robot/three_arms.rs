use super::arm::Arm;
use super::parameter::{ArmIndex, Drive, GeometryError, Parameter};
use super::transmission::Transmission;
use crate::Real;
use nalgebra::Vector3;

/// A Delta robot: three arms that meet in the platform point. `3 × 8 = 24` parameters, or `3 × 7 = 21` with linear
/// drives.
///
/// Lengths are in any one unit; results use the same unit.
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
#[derive(Debug, PartialEq)]
pub struct Robot<T: Real> {
    arms: [Arm<T>; 3],
}

// Derived, it copies number by number, which is a kilobyte of a small firmware.
impl<T: Real> Clone for Robot<T> {
    #[inline]
    fn clone(&self) -> Self {
        Self { arms: self.arms }
    }
}

impl<T: Real> Robot<T> {
    /// A robot from three arms, in joint order.
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

    /// A robot from 24 parameters, eight per arm in the order of [`Parameter::ROTARY`](crate::Parameter::ROTARY):
    /// lengths, and θ and α in radians.
    ///
    /// The table can be a constant in a controller's flash. The robot itself cannot: it holds the sines and cosines of
    /// the table's angles, which Rust does not compute at compile time, and it is validated at construction.
    ///
    /// # Errors
    /// Same as [`Arm::new`] and [`Robot::new`].
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

    /// A robot with the same drives and transmissions but other parameters, each at its [place](Drive::places).
    ///
    /// # Errors
    /// Same as [`Arm::with_parameters`] and [`Robot::new`].
    pub fn with_parameters(&self, parameters: [[T; 8]; 3]) -> Result<Self, GeometryError> {
        let ([one, two, three], [first, second, third]) = (&self.arms, parameters);
        Self::new([
            one.with_parameters(first)?,
            two.with_parameters(second)?,
            three.with_parameters(third)?,
        ])
    }

    /// The same robot with different transmissions.
    ///
    /// # Errors
    /// [`GeometryError::TransmissionTooLarge`] if the robot has linear drives.
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

    /// How the joints drive the elbows.
    #[inline]
    pub const fn drive(&self) -> Drive {
        let [first, ..] = &self.arms;
        first.drive()
    }

    /// All parameters, in the layout of [`from_parameters`](Self::from_parameters); for linear drives, each at its
    /// [place](Drive::places).
    pub const fn parameters(&self) -> [[T; 8]; 3] {
        let [first, second, third] = &self.arms;
        [first.parameters(), second.parameters(), third.parameters()]
    }

    /// Three arms already known to form a valid robot.
    pub(crate) const fn of_valid(arms: [Arm<T>; 3]) -> Self {
        Self { arms }
    }

    /// The three arms, in joint order.
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

    /// ez₁ + ez₂ + ez₃: points away from the platform, across the plane of the elbows.
    pub fn up(&self) -> Vector3<T> {
        let [first, second, third] = &self.arms;
        first.basis().ez + second.basis().ez + third.basis().ez
    }

    /// Converts the robot to another scalar type; `f64` to `f32` rounds each parameter to nearest.
    ///
    /// # Errors
    /// A [`GeometryError`] if a parameter overflows or vanishes in the narrower type.
    pub fn cast<U: Real>(&self) -> Result<Robot<U>, GeometryError> {
        let [first, second, third] = &self.arms;
        Robot::new([first.cast()?, second.cast()?, third.cast()?])
    }
}

/// The nominal robot as a data sheet specifies it: three identical arms 120° apart, no tilt.
///
/// Lengths in any one unit.
///
/// ```
/// use delta_cal::SymmetricRobot;
/// let paper = SymmetricRobot { base_radius: 194.0_f64, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// assert!(paper.robot().is_ok());
/// assert!(SymmetricRobot { forearm: 0.0, ..paper }.robot().is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SymmetricRobot<T> {
    /// Ra: base centre to motor axes. Length.
    pub base_radius: T,
    /// Rb: platform point to the ends of the forearms. Length.
    pub platform_radius: T,
    /// La: upper arm. Length.
    pub upper_arm: T,
    /// Lb: forearm. Length.
    pub forearm: T,
}

impl<T: Real> SymmetricRobot<T> {
    /// The robot with its arms at azimuth 0°, 120° and 240°.
    ///
    /// # Errors
    /// A [`GeometryError`] if a length is not finite, an arm length is not positive or a radius is negative.
    pub fn robot(&self) -> Result<Robot<T>, GeometryError> {
        self.robot_from_azimuth(T::ZERO)
    }

    /// The robot with its first arm at `azimuth` (radians) and the others at +120° and +240°.
    ///
    /// # Errors
    /// Same as [`robot`](Self::robot), and an azimuth that puts an arm beyond ±360°.
    pub fn robot_from_azimuth(&self, azimuth: T) -> Result<Robot<T>, GeometryError> {
        if !(self.base_radius >= T::ZERO && self.platform_radius >= T::ZERO) {
            return Err(GeometryError::RadiusInvalid);
        }
        if !(self.upper_arm > T::ZERO) {
            return Err(GeometryError::NotPositive(Parameter::LaX));
        }
        let turns = [T::ZERO, T::from_f64(2.0 / 3.0), T::from_f64(4.0 / 3.0)];
        Robot::from_parameters(turns.map(|turn| {
            let theta = azimuth + turn * T::PI;
            let radius = self.base_radius - self.platform_radius;
            let (sin_theta, cos_theta) = theta.sine_cosine();
            [
                radius * cos_theta,
                radius * sin_theta,
                T::ZERO,
                theta,
                T::ZERO,
                self.upper_arm,
                T::ZERO,
                self.forearm,
            ]
        }))
    }
}

#[cfg(test)]
impl SymmetricRobot<f64> {
    /// The paper's robot, mm.
    pub(crate) const PAPER: Self = Self {
        base_radius: 194.0,
        platform_radius: 30.0,
        upper_arm: 260.0,
        forearm: 480.0,
    };
}

#[cfg(feature = "linear")]
impl<T: Real> Robot<T> {
    /// The nominal robot with linear drives as a data sheet specifies it: three upright towers at the same distance from
    /// the centre. Travel is measured upwards from z = 0.
    ///
    /// `tower_radius`: centre to the upper ends of the forearms, minus the platform radius ("delta radius"). Lengths.
    /// `azimuths`: radians; `None` for 210°, 330° and 90°, the usual numbering on printers.
    ///
    /// # Errors
    /// A [`GeometryError`] if a length is not finite, the forearm length is not positive or the radius is negative.
    ///
    /// ```
    /// use delta_cal::Robot;
    /// # fn main() -> Result<(), Box<dyn core::error::Error>> {
    /// let printer = Robot::linear(140.0_f64, 330.0, None)?;
    /// // With all carriages at the same height, the platform hangs below the centre.
    /// let position = printer.forward(&[400.0; 3])?;
    /// let below = f64::sqrt(330.0 * 330.0 - 140.0 * 140.0);
    /// assert!(position.x.abs() < 1e-9 && (position.z - (400.0 - below)).abs() < 1e-9);
    /// # Ok(())
    /// # }
    /// ```
    pub fn linear(
        tower_radius: T,
        forearm: T,
        azimuths: Option<[T; 3]>,
    ) -> Result<Self, GeometryError> {
        if !(tower_radius >= T::ZERO) {
            return Err(GeometryError::RadiusInvalid);
        }
        let arm = |azimuth: T| {
            let (sine, cosine) = azimuth.sine_cosine();
            let zero = T::ZERO;
            Arm::linear([
                tower_radius * cosine,
                tower_radius * sine,
                zero,
                zero,
                zero,
                T::ONE,
                forearm,
            ])
        };
        let sixth = T::PI / T::from_f64(6.0);
        let usual = [7.0, 11.0, 3.0].map(|sixths| sixth * T::from_f64(sixths));
        let [first, second, third] = azimuths.unwrap_or(usual);
        Self::new([arm(first)?, arm(second)?, arm(third)?])
    }
}
