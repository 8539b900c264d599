//! The robot file: geometry, joint limits, and what is known of tolerance and noise.

mod draft;
mod instruments;
mod messages;
mod read;
mod record;
mod schema;
mod write;

pub use draft::Draft;
pub use instruments::{InstrumentFacts, KnownPlane, NamedPoint};
pub use record::Record;

use crate::geometry::reach::Reach;
use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::TransmissionTolerance;
use delta_cal::{Noise, Robot, Tolerance};

/// What a robot file says.
///
/// ```toml
/// [nominal]                    # either: three equal arms 120° apart
/// # kind = "linear"            # carriages on towers: tower_radius_mm, forearm_mm and, if the towers do not
/// #                            # stand at [210, 330, 90], tower_deg
/// base_radius_mm = 194
/// platform_radius_mm = 30
/// upper_arm_mm = 260
/// forearm_mm = 480
///
/// # [[arm]]                    # or: exactly three of these
/// # dx_mm = 164.0              # dx_mm, dy_mm, dz_mm, theta_deg, alpha_deg, la_x_mm, la_y_mm, lb_mm; with
/// #                            # linear drives dx_mm, dy_mm, dz_mm, lean_x_deg, lean_y_deg, scale, lb_mm;
/// #                            # what a gear and encoder do beside turning the arm, as a calibration found it:
/// #                            # transmission_gain, transmission_cos_deg, transmission_sin_deg,
/// #                            # transmission_cos2_deg, transmission_sin2_deg
///
/// [joints]                     # with linear drives min_mm and max_mm, and nothing else
/// min_deg = -60
/// max_deg = 90
/// forearm_max_deg = 45         # optional: the ball joints; a forearm's angle out of its arm's plane
///
/// [tolerance]                  # optional: one σ of every parameter; the prior
/// length_mm = 0.5
/// angle_deg = 0.2
/// # scale = 0.001              # of linear drives: of the travel's scale, and
/// # zero_mm = 5                # of the end stops, if not as of other lengths, and
/// # radius_mm = 2              # of the radius common to all towers, beside each one's own length_mm
/// # transmission_deg = 0.05    # of rotary drives: gears and encoders that are to be found as well
///
/// [noise]                      # optional: one σ of a measurement; the weights
/// position_mm = 0.02           # or [0.02, 0.02, 0.1]: along x, y and z of the robot's frame
/// joint_deg = 0.002            # with linear drives joint_mm
/// height_mm = 0.02             # of a height above a plane; with it or
/// distance_mm = 0.005          # a distance, position_mm may be left out
///
/// [planes.NAME]                # optional: a plane that crosses the z axis at a known height
/// z_mm = -560
/// sigma_mm = 0.05
/// tilt_deg = 0.1               # optional: one σ of its tilt, where it is known to be nearly level
/// blocks_mm = [0, 60, 120]     # optional: gauge blocks that a plan measures on; 0 is the bare plane
///
/// [points.NAME]                # optional: a point that distances begin at
/// x_mm = 100                   # x_mm, y_mm, z_mm and sigma_mm, if its place is known
/// y_mm = 0
/// z_mm = -600
/// sigma_mm = 0.1
/// offset = "unknown"           # its sensor reads a constant too much that is not known
/// length_mm = [100, 600]       # optional: the distances that can be measured; a bar of 300 mm: [300, 300]
///
/// [distances]                  # optional: the same of distances between two poses
/// length_mm = [50, 600]
///
/// [target]                     # optional: the point that is measured, from the platform point
/// x_mm = 0
/// y_mm = 0
/// z_mm = -40
///
/// [robot]                      # optional: for reports and certificates
/// name = "Packer 3"
/// serial = "D24-0117"
///
/// [measurement]                # optional: the same; a calibration does not copy it to its result
/// operator = "A. Meier"
/// instrument = "laser tracker LT-400, no. 52"
/// date = "2026-03-14"
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
    /// What is known of the joints' transmissions, if they are to be found as well.
    pub transmission: Option<TransmissionTolerance<f64>>,
    /// The measurement noise, if stated.
    pub noise: Option<Noise<f64>>,
    /// From the robot's frame to the sensor's, if an earlier calibration found it.
    pub sensor_frame: Option<RigidTransform<f64>>,
    /// What is known of other instruments.
    pub instruments: InstrumentFacts,
    /// Which robot it is, and how it was measured.
    pub record: Record,
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
