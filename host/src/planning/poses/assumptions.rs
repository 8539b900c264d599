//! The noise and the tolerance that poses are planned for.

use crate::files::robot_file::RobotFile;
use delta_cal::samples::NoiseError;
use delta_cal::{Noise, Tolerance};

/// What is known of the measurements, or assumed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assumptions {
    /// One σ of a measurement.
    pub noise: Noise<f64>,
    /// Whether the robot file states it; otherwise it is [`Assumptions::POSITION`] and
    /// [`Assumptions::JOINT_DEGREES`].
    pub noise_stated: bool,
    /// The prior; `None` if the robot file states none.
    pub tolerance: Option<Tolerance<f64>>,
}

impl Assumptions {
    /// What a laser tracker does in a robot's workspace, mm.
    pub const POSITION: f64 = 0.02;
    /// What an encoder on a geared joint does, degrees.
    pub const JOINT_DEGREES: f64 = 0.002;

    /// What the file states, and the rest by default.
    ///
    /// # Errors
    /// None is known: the defaults are a noise.
    pub fn of(file: &RobotFile) -> Result<Self, NoiseError> {
        let noise = match file.noise {
            Some(stated) => stated,
            None => Noise::new(Self::POSITION, Self::JOINT_DEGREES.to_radians())?,
        };
        Ok(Self {
            noise,
            noise_stated: file.noise.is_some(),
            tolerance: file.tolerance,
        })
    }
}
