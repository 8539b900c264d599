//! Arms and towers in the parameters that controllers use.

use delta_cal::robot::{Arm, Drive, GeometryError};
use delta_cal::{Real, Robot};

/// What controllers hold of an arm, in cylindrical coordinates: lengths in mm, angles in radians.
///
/// The motor axis is at radius r. The elbow is at radius r + U cos(q − φ) and height h − U sin(q − φ). An upright tower has
/// only r, h and L: the rod's upper end is at radius r and height h + s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shape {
    /// θ: the azimuth of the arm's plane or of the tower.
    pub azimuth: f64,
    /// r: the distance of the motor axis or tower from the z axis, minus the platform radius.
    pub radius: f64,
    /// h: the height of the motor axis, or of the rod's upper end at travel 0.
    pub height: f64,
    /// U: the upper arm.
    pub upper: f64,
    /// L: the forearm or rod.
    pub lower: f64,
    /// φ: the joint angle at which the upper arm is level.
    pub zero: f64,
}

impl Shape {
    /// Three with these azimuths in degrees, heights, upper arms and forearms, mm.
    pub(crate) fn three(
        azimuths: [f64; 3],
        radius: f64,
        [heights, uppers, lowers]: [[f64; 3]; 3],
    ) -> [Self; 3] {
        [0, 1, 2].map(|index| Self {
            azimuth: azimuths[index].to_radians(),
            radius,
            height: heights[index],
            upper: uppers[index],
            lower: lowers[index],
            zero: 0.0,
        })
    }

    fn arm(&self, drive: Drive) -> Result<Arm<f64>, GeometryError> {
        let (sine, cosine) = self.azimuth.sine_cosine();
        let [x, y, z] = [self.radius * cosine, self.radius * sine, self.height];
        let (sine, cosine) = self.zero.sine_cosine();
        let (la_x, la_y) = (self.upper * cosine, self.upper * sine);
        match drive {
            Drive::Linear => Arm::linear([x, y, z, 0.0, 0.0, 1.0, self.lower]),
            Drive::Rotary => Arm::new([x, y, z, self.azimuth, 0.0, la_x, la_y, self.lower]),
        }
    }

    /// The robot with these arms or upright towers.
    ///
    /// # Errors
    /// They are not a valid robot.
    pub fn robot([a, b, c]: &[Self; 3], drive: Drive) -> Result<Robot<f64>, GeometryError> {
        Robot::new([a.arm(drive)?, b.arm(drive)?, c.arm(drive)?])
    }
}
