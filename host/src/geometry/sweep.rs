//! The forward model swept over the joints' range.

use super::reach::Reach;
use delta_cal::Robot;
use delta_cal::kinematics::JointLimits;

/// Joint angles on each joint, both ends included.
const SWEEP: u32 = 33;
/// How many combinations there are.
pub(crate) const SWEPT: u32 = SWEEP.pow(3);

/// Whether the forearms meet at any pose of the sweep, whatever the ball joints.
pub(crate) fn reaches_anywhere(robot: &Robot<f64>, limits: &JointLimits<f64>) -> bool {
    let reach = Reach {
        limits: *limits,
        forearm_limit: None,
    };
    sweep(&reach).any(|q| robot.forward(&q).is_ok())
}

/// All combinations of evenly spaced joint angles within the limits, ends included.
pub(crate) fn sweep(reach: &Reach) -> impl Iterator<Item = [f64; 3]> + '_ {
    let angle = |part: u32| reach.limits.at(f64::from(part) / f64::from(SWEEP - 1));
    (0..SWEPT).map(move |cell| {
        [
            angle(cell / SWEEP / SWEEP),
            angle(cell / SWEEP % SWEEP),
            angle(cell % SWEEP),
        ]
    })
}
