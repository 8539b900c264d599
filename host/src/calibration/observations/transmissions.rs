//! What a calibration found of gears and encoders.

use crate::fit::outcome::{PARAMETERS, RobotCovariance};
use delta_cal::Robot;

/// Numbers of a joint.
const NUMBERS: usize = 5;

/// What the gear and encoder of a joint do beside turning the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransmissionFound {
    /// gain (no unit), and cosine and sine of the first and of the second harmonic, radians.
    pub numbers: [f64; NUMBERS],
    /// One σ of each.
    pub sigmas: [f64; NUMBERS],
    /// Amplitude of the first harmonic and one σ of it, radians: an eccentric gear or encoder.
    pub first_harmonic: (f64, f64),
    /// The same of the second.
    pub second_harmonic: (f64, f64),
}

impl TransmissionFound {
    /// Of each joint.
    pub(super) fn of(robot: &Robot<f64>, covariance: Option<&RobotCovariance>) -> [Self; 3] {
        let transmissions = robot.transmissions();
        std::array::from_fn(|joint| {
            let numbers = transmissions[joint].numbers();
            let first = PARAMETERS + NUMBERS * joint;
            let with =
                |a: usize, b: usize| covariance.map_or(f64::NAN, |all| all[(first + a, first + b)]);
            // σ of √(c² + s²) along (c, s).
            let amplitude = |cosine: usize| {
                let (c, s) = (numbers[cosine], numbers[cosine + 1]);
                let size = c.hypot(s);
                let (x, y) = if size > 0.0 {
                    (c / size, s / size)
                } else {
                    (1.0, 0.0)
                };
                let variance = x * x * with(cosine, cosine)
                    + 2.0 * x * y * with(cosine, cosine + 1)
                    + y * y * with(cosine + 1, cosine + 1);
                (size, variance.sqrt())
            };
            Self {
                numbers,
                sigmas: std::array::from_fn(|number| with(number, number).sqrt()),
                first_harmonic: amplitude(1),
                second_harmonic: amplitude(3),
            }
        })
    }
}
