//! Joint angles outside the limits.

use crate::text::joint::{in_file, mark};
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Drive;

/// A joint may be this many degrees or millimetres outside the limits: encoder zeros differ.
const LIMIT_MARGIN: f64 = 1.0;

/// Whether a joint is further outside the limits than that, and how to say so.
pub(crate) fn outside_limits(angle: f64, limits: &JointLimits<f64>) -> Option<String> {
    let drive = limits.drive();
    let (margin, what) = match drive {
        Drive::Rotary => (LIMIT_MARGIN.to_radians(), "joint limits"),
        Drive::Linear => (LIMIT_MARGIN, "limits of the travel"),
    };
    (angle < limits.minimum() - margin || angle > limits.maximum() + margin).then(|| {
        format!(
            "{:.3}{mark} is more than {LIMIT_MARGIN}{mark} outside the {what} of {}{mark} to {}{mark}",
            in_file(drive, angle),
            in_file(drive, limits.minimum()),
            in_file(drive, limits.maximum()),
            mark = mark(drive),
        )
    })
}
