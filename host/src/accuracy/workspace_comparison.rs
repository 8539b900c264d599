//! What a calibration means for positions all over the workspace, not only where it was measured.

use crate::accuracy::position_uncertainty::{PositionUncertainty, joint_grid};
use crate::fit::outcome::Outcome;
use delta_cal::Robot;
use delta_cal::kinematics::JointLimits;

/// Joint angles of the grid: in the middle of this many equal parts of the joints' range.
const PARTS: u32 = 4;

/// A change of less than this part of its own uncertainty is none.
const UNCHANGED: f64 = 0.1;
/// An uncertainty below this, in mm, is that of the arithmetic.
const NEGLIGIBLE: f64 = 1e-6;

/// How far the calibration moves the platform over a grid of poses within the joint limits, and
/// how uncertain the calibrated positions are there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkspaceComparison {
    /// Poses of the grid that both robots reach.
    pub poses: u32,
    /// rms distance between the calibrated and the original robot's positions, mm.
    pub change: f64,
    /// rms standard deviation of the calibrated positions, mm: √ of the mean of tr(J C Jᵀ).
    pub sigma: f64,
}

impl WorkspaceComparison {
    /// `None` if the covariance is not known, or no pose of the grid is reached by both robots.
    pub fn of(before: &Robot<f64>, outcome: &Outcome, limits: &JointLimits<f64>) -> Option<Self> {
        let covariance = outcome.covariance.as_ref()?;
        let after = &outcome.fit.robot;
        let uncertainty = PositionUncertainty {
            robot: after,
            covariance,
        };
        let mut poses = 0;
        let (mut change_squared, mut variance) = (0.0, 0.0);
        for q in joint_grid(limits, PARTS) {
            if let Ok(from) = before.forward(&q)
                && let Ok(to) = after.forward(&q)
                && let Some(at_pose) = uncertainty.covariance(&to, &q)
            {
                poses += 1;
                change_squared += (to - from).norm_squared();
                variance += at_pose.trace();
            }
        }
        (poses > 0).then(|| Self {
            poses,
            change: (change_squared / f64::from(poses)).sqrt(),
            sigma: (variance / f64::from(poses)).sqrt(),
        })
    }

    /// rms position error that the robot is expected to have without calibration, mm: what the
    /// change is beyond the part that its own uncertainty explains.
    pub fn expected_error_before(&self) -> f64 {
        (self.change.powi(2) - self.sigma.powi(2)).max(0.0).sqrt()
    }

    /// rms position error that the calibrated robot is expected to have, mm.
    pub fn expected_error_after(&self) -> f64 {
        self.sigma
    }

    /// Whether the calibrated robot is expected to be further off than the robot was before.
    ///
    /// Not if the calibration leaves the robot where it was, nor for exact samples of a robot that
    /// is exact already.
    pub fn expected_worse(&self) -> bool {
        !self.unchanged()
            && self.sigma > NEGLIGIBLE
            && self.expected_error_before() < self.expected_error_after()
    }

    /// Whether the calibration leaves the robot where it was, as the same samples calibrated again
    /// do.
    pub fn unchanged(&self) -> bool {
        self.change <= UNCHANGED * self.sigma
    }
}
