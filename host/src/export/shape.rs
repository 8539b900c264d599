//! An arm in the terms that controllers use.

use delta_cal::robot::Arm;
use delta_cal::{ArmIndex, Robot};
use nalgebra::Vector3;

/// An arm in cylindrical terms: lengths in mm, angles in radians.
///
/// With (r, t) the motor axis' point along and across the azimuth, the elbow stands at radius
/// r + U cos(q − φ), at the side t and at height h − U sin(q − φ), all tilted by α.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmShape {
    /// θ: the azimuth of the arm's plane.
    pub azimuth: f64,
    /// r: the motor axis from the base's z axis along the azimuth, platform offset subtracted.
    pub radius: f64,
    /// t: the same across the azimuth.
    pub side: f64,
    /// h: the height of the motor axis.
    pub height: f64,
    /// α: the tilt of the motor axis.
    pub tilt: f64,
    /// U: the upper arm.
    pub upper: f64,
    /// φ: the joint angle at which the upper arm is horizontal.
    pub zero: f64,
    /// L: the forearm.
    pub lower: f64,
}

impl ArmShape {
    /// Of an arm.
    pub fn of(arm: &Arm<f64>) -> Self {
        let [dx, dy, height, azimuth, tilt, la_x, la_y, lower] = arm.parameters();
        let (sin, cos) = azimuth.sin_cos();
        Self {
            azimuth,
            radius: dx * cos + dy * sin,
            side: dy * cos - dx * sin,
            height,
            tilt,
            upper: la_x.hypot(la_y),
            zero: la_y.atan2(la_x),
            lower,
        }
    }

    /// All three of a robot.
    pub fn all(robot: &Robot<f64>) -> [Self; 3] {
        ArmIndex::ALL.map(|index| Self::of(robot.arm(index)))
    }

    /// The eight parameters of the arm, in the order of `Parameter::ROTARY`.
    pub fn parameters(&self) -> [f64; 8] {
        let (sin, cos) = self.azimuth.sin_cos();
        let d = Vector3::new(
            self.radius * cos - self.side * sin,
            self.radius * sin + self.side * cos,
            self.height,
        );
        let (la_y, la_x) = self.zero.sin_cos();
        [
            d.x,
            d.y,
            d.z,
            self.azimuth,
            self.tilt,
            self.upper * la_x,
            self.upper * la_y,
            self.lower,
        ]
    }
}

/// The same angle in (−π, π].
pub(crate) fn within_half_turn(angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    sin.atan2(cos)
}
