//! Joint angles outside the limits.

use crate::text::units::degrees;
use delta_cal::kinematics::JointLimits;

/// A joint angle may be this many degrees outside the limits: encoder zeros differ.
const LIMIT_MARGIN: f64 = 1.0;

/// Whether a joint angle is further outside the limits than that, and how to say so.
pub(crate) fn outside_limits(angle: f64, limits: &JointLimits<f64>) -> Option<String> {
    let margin = LIMIT_MARGIN.to_radians();
    (angle < limits.minimum() - margin || angle > limits.maximum() + margin).then(|| {
        format!(
            "{:.3}° is more than {LIMIT_MARGIN}° outside the joint limits of {}° to {}°",
            degrees(angle),
            degrees(limits.minimum()),
            degrees(limits.maximum()),
        )
    })
}
