//! The numbers of a robot, and their fingerprint.

use crate::wire::fields;
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use delta_cal::robot::{GeometryError, Transmission};
use delta_cal::{Real, Robot};

/// The numbers of a robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry<T> {
    /// Eight parameters an arm, in the order of [`delta_cal::Parameter::ROTARY`]: mm and radians.
    pub arms: [[T; 8]; 3],
    /// Five numbers a joint, in the order of [`Transmission::numbers`]: no unit, and radians. `None` if all are 0.
    pub transmissions: Option<[[T; 5]; 3]>,
}

impl<T: Real> Geometry<T> {
    /// Of a robot.
    pub fn of(robot: &Robot<T>) -> Self {
        let numbers = robot.transmissions().map(|own| own.numbers());
        let exact = numbers
            .as_flattened()
            .iter()
            .all(|number| *number == T::ZERO);
        Self {
            arms: robot.parameters(),
            transmissions: (!exact).then_some(numbers),
        }
    }

    /// The robot.
    ///
    /// # Errors
    /// Numbers that are not those of a robot.
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

    /// A checksum of all numbers, bit by bit: names a geometry in a message, so that nothing else than what was
    /// looked at is applied or reverted.
    ///
    /// CRC-32 of the parameters and then of the transmissions, if there are any, as `f64`, little-endian, arm by arm.
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

fields!(Geometry<T> { arms, transmissions });
