//! The robot file: geometry, joint limits, and what is known of tolerance and noise.

mod messages;
mod read;
mod schema;
mod write;

use crate::geometry::reach::Reach;
use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::JointLimits;
use delta_cal::{Noise, Robot, Tolerance};

/// What a robot file says.
///
/// ```toml
/// [nominal]                    # either: three equal arms 120° apart
/// base_radius_mm = 194
/// platform_radius_mm = 30
/// upper_arm_mm = 260
/// forearm_mm = 480
///
/// # [[arm]]                    # or: exactly three of these
/// # dx_mm = 164.0              # dx_mm, dy_mm, dz_mm, theta_deg, alpha_deg, la_x_mm, la_y_mm, lb_mm
///
/// [joints]
/// min_deg = -60
/// max_deg = 90
/// forearm_max_deg = 45         # optional: the ball joints; a forearm's angle out of its arm's plane
///
/// [tolerance]                  # optional: one σ of every parameter; the prior
/// length_mm = 0.5
/// angle_deg = 0.2
///
/// [noise]                      # optional: one σ of a measurement; the weights
/// position_mm = 0.02
/// joint_deg = 0.002
///
/// [sensor_frame]               # written by a calibration in the sensor's frame
/// rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]     # X_sensor = rotation · X_robot + translation
/// translation_mm = [0, 0, 0]
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RobotFile {
    /// The file's name, for messages.
    pub name: String,
    /// Its geometry; lengths in millimetres.
    pub robot: Robot<f64>,
    /// The range of every joint.
    pub limits: JointLimits<f64>,
    /// The largest angle of a forearm out of its arm's plane that the ball joints allow, radians;
    /// `None` for any.
    pub forearm_limit: Option<f64>,
    /// The manufacturing tolerance, if stated.
    pub tolerance: Option<Tolerance<f64>>,
    /// The measurement noise, if stated.
    pub noise: Option<Noise<f64>>,
    /// From the robot's frame to the sensor's, if an earlier calibration found it.
    pub sensor_frame: Option<RigidTransform<f64>>,
}

impl RobotFile {
    /// Which poses the robot may take.
    pub const fn reach(&self) -> Reach {
        Reach {
            limits: self.limits,
            forearm_limit: self.forearm_limit,
        }
    }
}
