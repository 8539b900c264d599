//! The robot before calibration, where no file states it.

use super::shape::{ArmShape, within_half_turn};
use delta_cal::Robot;
use delta_cal::robot::GeometryError;
use std::f64::consts::TAU;

/// Whether the arms are numbered counter-clockwise seen from above.
pub(crate) fn counter_clockwise(arms: &[ArmShape; 3]) -> bool {
    let [first, second, _] = arms;
    within_half_turn(second.azimuth - first.azimuth) >= 0.0
}

/// The azimuth of the first arm of the three evenly spaced arms that are nearest to these, radians.
pub(crate) fn first_azimuth(arms: &[ArmShape; 3]) -> f64 {
    let step = if counter_clockwise(arms) { TAU } else { -TAU } / 3.0;
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (number, arm) in [0.0, 1.0, 2.0].into_iter().zip(arms) {
        let (sin, cos) = (arm.azimuth - number * step).sin_cos();
        sine += sin;
        cosine += cos;
    }
    sine.atan2(cosine)
}

/// Three equal arms 120° apart, of the mean radius, height, lengths and joint zero of these arms.
pub fn symmetric_arms(arms: &[ArmShape; 3]) -> [ArmShape; 3] {
    let step = if counter_clockwise(arms) { TAU } else { -TAU } / 3.0;
    let first = first_azimuth(arms);
    let mean = |value: fn(&ArmShape) -> f64| arms.iter().map(value).sum::<f64>() / 3.0;
    [0.0, 1.0, 2.0].map(|number| ArmShape {
        azimuth: within_half_turn(first + number * step),
        radius: mean(|arm| arm.radius),
        side: 0.0,
        height: mean(|arm| arm.height),
        tilt: 0.0,
        upper: mean(|arm| arm.upper),
        zero: mean(|arm| arm.zero),
        lower: mean(|arm| arm.lower),
    })
}

/// The symmetric robot nearest to a calibrated one.
///
/// # Errors
/// The means of the arms are no robot.
pub fn nearest_symmetric(robot: &Robot<f64>) -> Result<Robot<f64>, GeometryError> {
    Robot::from_parameters(symmetric_arms(&ArmShape::all(robot)).map(|arm| arm.parameters()))
}
