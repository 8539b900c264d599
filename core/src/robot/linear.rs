use super::arm::Arm;
use super::geometry_error::GeometryError;
use super::three_arms::Robot;
use crate::Real;

/// The nominal robot with linear drives as a data sheet gives it: three upright towers at the same distance from
/// the centre. Travel is counted upwards from the height at which z is 0.
///
/// ```
/// use delta_cal::robot::SymmetricLinearRobot;
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let printer = SymmetricLinearRobot { tower_radius: 140.0_f64, forearm: 330.0 }.robot()?;
/// // All carriages at the same height: the platform hangs below the centre.
/// let position = printer.forward(&[400.0; 3])?;
/// let below = f64::sqrt(330.0 * 330.0 - 140.0 * 140.0);
/// assert!(position.x.abs() < 1e-9 && (position.z - (400.0 - below)).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SymmetricLinearRobot<T> {
    /// From the centre to the forearms' upper ends, less the platform's radius ("delta radius"). Length.
    pub tower_radius: T,
    /// Lb: forearm. Length.
    pub forearm: T,
}

impl<T: Real> SymmetricLinearRobot<T> {
    /// The robot with its towers at 210°, 330° and 90°, as most printers number them.
    ///
    /// # Errors
    /// A [`GeometryError`] if a length is not finite, the forearm is not longer than 0 or the radius is negative.
    pub fn robot(&self) -> Result<Robot<T>, GeometryError> {
        let sixth = T::PI / T::from_f64(6.0);
        self.robot_at([7.0, 11.0, 3.0].map(|sixths| sixth * T::from_f64(sixths)))
    }

    /// The robot with its towers at these azimuths, radians.
    ///
    /// # Errors
    /// As [`robot`](Self::robot).
    pub fn robot_at(&self, azimuths: [T; 3]) -> Result<Robot<T>, GeometryError> {
        if !(self.tower_radius >= T::ZERO) {
            return Err(GeometryError::RadiusInvalid);
        }
        let arm = |azimuth: T| {
            let (sine, cosine) = azimuth.sine_cosine();
            let zero = T::ZERO;
            Arm::linear([
                self.tower_radius * cosine,
                self.tower_radius * sine,
                zero,
                zero,
                zero,
                T::ONE,
                self.forearm,
            ])
        };
        let [first, second, third] = azimuths;
        Robot::new([arm(first)?, arm(second)?, arm(third)?])
    }
}
