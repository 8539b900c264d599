//! Klipper's own kinematics, forward and inverse: positions from the steps that the motors took from their end
//! stops, and these steps from positions. Written from klippy/kinematics/delta.py, rotary_delta.py, mathutil.py and
//! klippy/chelper/kin_rotary_delta.c.

use crate::export::controllers::{Arm, all_named};
use crate::support::Point;
use nalgebra::Vector3;

/// `kinematics: delta`.
#[derive(Clone, Copy)]
pub(crate) struct Delta {
    pub(crate) radius: f64,
    pub(crate) angles: Point,
    pub(crate) arms: Point,
    pub(crate) endstops: Point,
    pub(crate) step_lengths: Point,
}

impl Delta {
    /// Of the options in lines to paste.
    pub(crate) fn pasted(lines: &str, step_lengths: Point) -> Self {
        let three = |key: &str| Point::try_from(all_named(lines, key, ": ")).unwrap();
        Self {
            radius: all_named(lines, "delta_radius", ": ")[0],
            angles: three("angle"),
            arms: three("arm_length"),
            endstops: three("position_endstop"),
            step_lengths,
        }
    }

    fn towers(&self) -> [[f64; 2]; 3] {
        self.angles.map(|angle| {
            let (sin, cos) = angle.to_radians().sin_cos();
            [cos * self.radius, sin * self.radius]
        })
    }

    pub(crate) fn absolute_endstops(&self) -> Point {
        [0, 1, 2].map(|k| self.endstops[k] + (self.arms[k].powi(2) - self.radius.powi(2)).sqrt())
    }

    /// The carriages' heights after these steps from the end stops.
    pub(crate) fn stepped(&self, steps: Point) -> Point {
        let high = self.absolute_endstops();
        [0, 1, 2].map(|k| high[k] - steps[k] * self.step_lengths[k])
    }

    /// The steps from the end stops to these heights of the carriages.
    pub(crate) fn steps_of(&self, carriages: Point) -> Point {
        let high = self.absolute_endstops();
        [0, 1, 2].map(|k| (high[k] - carriages[k]) / self.step_lengths[k])
    }

    pub(crate) fn position(&self, steps: Point) -> Point {
        let (towers, carriages) = (self.towers(), self.stepped(steps));
        let spheres = [0, 1, 2].map(|k| [towers[k][0], towers[k][1], carriages[k]]);
        trilateration(spheres, self.arms.map(|arm| arm * arm))
    }

    /// The carriages' heights.
    pub(crate) fn carriages(&self, at: Point) -> Point {
        let towers = self.towers();
        [0, 1, 2].map(|k| {
            let [x, y] = towers[k];
            let across = (x - at[0]).powi(2) + (y - at[1]).powi(2);
            (self.arms[k].powi(2) - across).sqrt() + at[2]
        })
    }

    pub(crate) fn steps(&self, at: Point) -> Point {
        self.steps_of(self.carriages(at))
    }
}

/// `kinematics: rotary_delta`. Step lengths in radians.
pub(crate) struct RotaryDelta {
    pub(crate) arms: [Arm; 3],
    pub(crate) endstops: Point,
    pub(crate) step_lengths: Point,
}

impl RotaryDelta {
    /// The arms' angles, up positive, radians.
    fn angles(&self, at: [Point; 3]) -> Point {
        [0, 1, 2].map(|k| self.arms[k].above_horizontal(at[k]).to_radians())
    }

    fn angles_at_endstops(&self) -> Point {
        self.angles(self.endstops.map(|z| [0.0, 0.0, z]))
    }

    pub(crate) fn position(&self, steps: Point) -> Point {
        let high = self.angles_at_endstops();
        let elbows = [0, 1, 2].map(|k| {
            let (arm, angle) = (self.arms[k], high[k] - steps[k] * self.step_lengths[k]);
            let out = arm.upper * angle.cos() + arm.radius;
            let (sin, cos) = arm.azimuth.to_radians().sin_cos();
            [out * cos, out * sin, arm.upper * angle.sin() + arm.height]
        });
        trilateration(elbows, self.arms.map(|arm| arm.lower * arm.lower))
    }

    pub(crate) fn steps(&self, at: Point) -> Point {
        let (high, angles) = (self.angles_at_endstops(), self.angles([at; 3]));
        [0, 1, 2].map(|k| (high[k] - angles[k]) / self.step_lengths[k])
    }
}

/// The lower of the two points at these squared distances from three others.
fn trilateration(places: [Point; 3], square: Point) -> Point {
    let [one, two, three] = places.map(Vector3::from);
    let (s21, s31) = (two - one, three - one);
    let d = s21.norm();
    let ex = s21 / d;
    let i = ex.dot(&s31);
    let ey = (s31 - ex * i).normalize();
    let ez = ex.cross(&ey);
    let j = ey.dot(&s31);
    let x = (square[0] - square[1] + d * d) / (2.0 * d);
    let y = (square[0] - square[2] - x * x + (x - i).powi(2) + j * j) / (2.0 * j);
    let z = -(square[0] - x * x - y * y).sqrt();
    (one + ex * x + ey * y + ez * z).into()
}
