//! A robot's parameters as numbers, and their fingerprint.

use crate::wire::fields;
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use delta_cal::robot::{Arm, GeometryError, Transmission};
use delta_cal::{Real, Robot};

/// A robot's parameters as numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry<T> {
    /// Eight parameters per arm, in the order of [`delta_cal::Parameter::ROTARY`]: mm and radians.
    pub arms: [[T; 8]; 3],
    /// Five numbers per joint, in the order of [`Transmission::numbers`]: unitless or radians. `None` if all are 0.
    pub transmissions: Option<[[T; 5]; 3]>,
}

impl<T: Real> Geometry<T> {
    /// The geometry of a robot.
    pub fn of(robot: &Robot<T>) -> Self {
        let own = robot.arms().each_ref().map(Arm::transmission);
        let any = own.iter().any(Option::is_some);
        let numbers = own.map(|own| own.map_or([T::ZERO; 5], Transmission::numbers));
        Self {
            arms: robot.parameters(),
            transmissions: any.then_some(numbers),
        }
    }

    /// The robot with this geometry.
    ///
    /// # Errors
    /// The numbers do not describe a valid robot, or the robot has transmissions and the core lacks its feature `transmission`.
    pub fn robot(&self) -> Result<Robot<T>, GeometryError> {
        let robot = Robot::from_parameters(self.arms)?;
        let Some([first, second, third]) = self.transmissions else {
            return Ok(robot);
        };
        robot.with_transmissions([
            Transmission::new(first)?,
            Transmission::new(second)?,
            Transmission::new(third)?,
        ])
    }

    /// A checksum over the bits of all numbers. A message names a geometry by it, so that only the geometry that was
    /// inspected is applied or reverted.
    ///
    /// CRC-32 of the parameters followed by the transmissions, if any, as little-endian `f64`, arm by arm.
    pub fn fingerprint(&self) -> u32 {
        let crc = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
        let mut digest = crc.digest();
        let transmissions = self.transmissions.iter().flatten().flatten();
        for value in self.arms.as_flattened().iter().chain(transmissions) {
            digest.update(&value.to_f64().to_bits().to_le_bytes());
        }
        digest.finalize()
    }
}

fields! { Geometry<T> { arms, transmissions } }
