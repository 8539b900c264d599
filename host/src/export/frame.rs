//! The rigid motion between the robot's frame and the controller's.

use delta_cal::frame::RigidTransform;
use nalgebra::{Matrix3, Vector3};

/// A position x in the calibrated robot's frame is at R x + (x, y, z) in the controller's, with
/// R = Rz Ry Rx.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Frame {
    /// The shift, mm.
    pub shift: Vector3<f64>,
    /// The turns about x, y and z, radians.
    pub turns: Vector3<f64>,
}

impl Frame {
    /// R and the shift.
    pub fn transform(&self) -> RigidTransform<f64> {
        let ((sx, cx), (sy, cy), (sz, cz)) = (
            self.turns.x.sin_cos(),
            self.turns.y.sin_cos(),
            self.turns.z.sin_cos(),
        );
        RigidTransform {
            rotation: Matrix3::new(
                cz * cy,
                cz * sy * sx - sz * cx,
                cz * sy * cx + sz * sx,
                sz * cy,
                sz * sy * sx + cz * cx,
                sz * sy * cx - cz * sx,
                -sy,
                cy * sx,
                cy * cx,
            ),
            translation: self.shift,
        }
    }

    /// As it is stated: to 0.0001 mm and 0.0001°.
    pub(crate) fn rounded(&self) -> Self {
        Self {
            shift: self.shift.map(|value| (value * 1e4).round() / 1e4 + 0.0),
            turns: self
                .turns
                .map(|value| ((value.to_degrees() * 1e4).round() / 1e4 + 0.0).to_radians()),
        }
    }
}
