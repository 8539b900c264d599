//! What the causes found make of the calibrated robot's positions.

use super::cause::{Cause, CauseKind};
use super::hypotheses;
use super::subject::Corrections;
use crate::fit::fkm::Linearization;
use delta_cal::{Robot, Sample};
use nalgebra::Vector3;

/// The calibrated robot beside the one that has the causes: its parameters are wrong by what they have
/// taken up of the causes, and the causes themselves are left.
pub(super) struct Discrepancy<'a> {
    pub(super) robot: &'a Robot<f64>,
    pub(super) found: &'a [Cause],
    pub(super) corrections: &'a Corrections,
    /// The square of the distance from the robot's axis at which the sag is stated, mm².
    pub(super) radius_squared: f64,
}

impl Discrepancy<'_> {
    /// The mean square of the distance between the two robots' positions at these joint angles, mm²;
    /// over both directions of a backlash. `None` at a singular pose.
    fn squared(&self, pose: &Sample<f64>) -> Option<f64> {
        let joints = &pose.joints;
        let at = Linearization::new(self.robot, joints).ok()?;
        let by_joints = hypotheses::by_joints(self.robot, &at, joints);
        let mut error = at.jacobian() * self.corrections.parameters;
        let mut either_way = 0.0;
        for cause in self.found {
            match (cause.kind, cause.arm) {
                (CauseKind::Backlash, Some(arm)) => {
                    let half = cause.joint_error(0.0, 1.0);
                    either_way += (by_joints.column(arm.index()) * half).norm_squared();
                }
                (_, Some(arm)) => {
                    let index = arm.index();
                    error += by_joints.column(index) * cause.joint_error(joints[index], 0.0);
                }
                (CauseKind::Sag, None) if self.radius_squared > 0.0 => {
                    let part = at.position.xy().norm_squared() / self.radius_squared;
                    error -= Vector3::z() * (cause.size * part);
                }
                // The positions drift, not the robot.
                (_, None) => {}
            }
        }
        Some(error.norm_squared() + either_way)
    }

    /// √ of the mean over poses, mm.
    pub(super) fn rms(&self, poses: &[Sample<f64>]) -> f64 {
        let known = poses.iter().filter_map(|pose| self.squared(pose));
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), squared| {
            (sum + squared, count + 1.0)
        });
        if count > 0.0 {
            f64::sqrt(sum / count)
        } else {
            0.0
        }
    }
}
