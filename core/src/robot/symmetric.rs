use super::arm::Arm;
use super::geometry_error::GeometryError;
use super::parameter::Parameter;
use super::three_arms::Robot;
use crate::Real;

/// The nominal robot as a data sheet gives it: three equal arms 120° apart, no tilt.
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
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SymmetricRobot<T> {
    /// Ra: from the base centre to the motor axes. Length.
    pub base_radius: T,
    /// Rb: from the platform point to the forearms' ends. Length.
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
    /// A [`GeometryError`] if a length is not finite, an arm is not longer than 0 or a radius is
    /// negative.
    pub fn robot(&self) -> Result<Robot<T>, GeometryError> {
        self.robot_from_azimuth(T::ZERO)
    }

    /// The robot with its first arm at `azimuth` (radians) and the others 120° and 240° further.
    ///
    /// # Errors
    /// As [`robot`](Self::robot); also an azimuth that takes an arm beyond ±360°.
    pub fn robot_from_azimuth(&self, azimuth: T) -> Result<Robot<T>, GeometryError> {
        if !(self.base_radius >= T::ZERO && self.platform_radius >= T::ZERO) {
            return Err(GeometryError::RadiusInvalid);
        }
        if !(self.upper_arm > T::ZERO) {
            return Err(GeometryError::NotPositive(Parameter::LaX));
        }
        let arm = |third: f64| {
            let theta = azimuth + T::from_f64(third * 2.0 / 3.0) * T::PI;
            let radius = self.base_radius - self.platform_radius;
            let (sin_theta, cos_theta) = theta.sine_cosine();
            Arm::new([
                radius * cos_theta,
                radius * sin_theta,
                T::ZERO,
                theta,
                T::ZERO,
                self.upper_arm,
                T::ZERO,
                self.forearm,
            ])
        };
        Robot::new([arm(0.0)?, arm(1.0)?, arm(2.0)?])
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
