//! Which poses a robot can take: limits of joints and ball joints, what rules out other poses, and a sweep of the
//! forward model; arms in cylindrical coordinates.

mod parallelograms;
mod region;
mod shape;

use crate::text::joint;
use delta_cal::kinematics::{JointLimits, KinematicsError, SingularityDistance};
use delta_cal::robot::{Arm, Drive};
use delta_cal::{ArmIndex, Real, Robot};
use nalgebra::Vector3;
pub(crate) use parallelograms::rotation;
pub use parallelograms::{NUMBERS, OF_ARM, Parallelograms, PlatformPose};
pub use region::Region;
pub(crate) use region::{below, uniform};
pub use shape::Shape;
use std::f64::consts::{PI, TAU};
use std::fmt;

/// The limit or singularity that rules out a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Limit {
    /// A joint would be below its smallest angle.
    JointMinimum(ArmIndex),
    /// A joint would be above its largest angle.
    JointMaximum(ArmIndex),
    /// The forearm would leave its arm's plane by a larger angle than its ball joints allow.
    Forearm(ArmIndex),
    /// Type 1: upper arm and forearm are in line or too short.
    Serial(ArmIndex),
    /// Type 2: the forearms lie in one plane.
    Parallel(ArmIndex),
    /// The plane of the elbows would be vertical: beyond it the platform would be above the plane, and
    /// [`Robot::forward`] finds it elsewhere. Occurs only with very wide joint limits; not a singularity. It concerns
    /// all arms; the first stands for them.
    Assembly(ArmIndex),
    /// The forearms do not meet.
    Unreachable(ArmIndex),
    /// A number is not finite.
    NonFinite(ArmIndex),
}

impl Limit {
    /// The arm at fault.
    pub const fn arm(self) -> ArmIndex {
        match self {
            Self::JointMinimum(arm)
            | Self::JointMaximum(arm)
            | Self::Forearm(arm)
            | Self::Serial(arm)
            | Self::Parallel(arm)
            | Self::Assembly(arm)
            | Self::Unreachable(arm)
            | Self::NonFinite(arm) => arm,
        }
    }

    /// The name in files: `joint_minimum_1`; [`Assembly`](Self::Assembly) has no number.
    pub fn name(self) -> String {
        let kind = match self {
            Self::JointMinimum(_) => "joint_minimum",
            Self::JointMaximum(_) => "joint_maximum",
            Self::Forearm(_) => "forearm_angle",
            Self::Serial(_) => "serial_singularity",
            Self::Parallel(_) => "parallel_singularity",
            Self::Assembly(_) => return "elbows_upright".to_owned(),
            Self::Unreachable(_) => "unreachable",
            Self::NonFinite(_) => "not_finite",
        };
        format!("{kind}_{}", self.arm().index() + 1)
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let arm = self.arm();
        match self {
            Self::JointMinimum(_) => write!(formatter, "the joint of {arm} is below its limit"),
            Self::JointMaximum(_) => write!(formatter, "the joint of {arm} is above its limit"),
            Self::Forearm(_) => write!(
                formatter,
                "the forearm of {arm} is further out of its arm's plane than forearm_max_deg allows"
            ),
            Self::Serial(_) => KinematicsError::Serial(arm).fmt(formatter),
            Self::Parallel(_) => KinematicsError::Parallel(arm).fmt(formatter),
            Self::Assembly(_) => formatter.write_str("the plane of the elbows would stand upright"),
            Self::Unreachable(_) => KinematicsError::Unreachable(arm).fmt(formatter),
            Self::NonFinite(_) => KinematicsError::NonFinite(arm).fmt(formatter),
        }
    }
}

impl From<KinematicsError> for Limit {
    fn from(error: KinematicsError) -> Self {
        match error {
            KinematicsError::Serial(arm) => Self::Serial(arm),
            KinematicsError::Parallel(arm) => Self::Parallel(arm),
            KinematicsError::Unreachable(arm) => Self::Unreachable(arm),
            error => Self::NonFinite(error.arm()),
        }
    }
}

/// The limits of the joints and of the ball joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// The range of all joints.
    pub limits: JointLimits<f64>,
    /// The largest angle of a forearm out of its arm's plane, radians; `None` if unlimited.
    pub forearm_limit: Option<f64>,
    /// Where the robot works; everywhere that it reaches without.
    pub within: Option<Region>,
}

impl Reach {
    /// The platform's position, mm, at these joint angles (radians).
    ///
    /// # Errors
    /// The limit or singularity that rules it out.
    pub fn position(&self, robot: &Robot<f64>, q: &[f64; 3]) -> Result<Vector3<f64>, Limit> {
        self.within_joints(q)?;
        let x = robot.forward(q)?;
        self.within_forearms(robot, &x, q)?;
        if robot.has_carriages_above(&x, q) {
            Ok(x)
        } else {
            Err(Limit::Serial(ArmIndex::First))
        }
    }

    /// The joint angles (radians), elbows out, for a position (mm).
    ///
    /// # Errors
    /// The limit or singularity that rules it out; also if [`Robot::forward`] finds another position at the joint
    /// angles, beyond a parallel singularity.
    pub fn joints(&self, robot: &Robot<f64>, x: &Vector3<f64>) -> Result<[f64; 3], Limit> {
        let q = robot.inverse(x)?.map(|q| self.in_turn(q));
        self.allows(robot, x, &q)?;
        Ok(q)
    }

    /// The same with elbows out or in: joint angles within the limits for which [`Robot::forward`] gives this position,
    /// if there are any. Elbows out are preferred.
    ///
    /// # Errors
    /// What rules the position out with elbows out.
    pub fn any_joints(&self, robot: &Robot<f64>, x: &Vector3<f64>) -> Result<[f64; 3], Limit> {
        let out = robot.inverse(x)?.map(|q| self.in_turn(q));
        let fault = match self.allows(robot, x, &out) {
            Ok(()) => return Ok(out),
            Err(fault) => fault,
        };
        self.within_forearms(robot, x, &out)?;
        if robot.drive() == Drive::Linear {
            // The other travel has its carriage below the platform.
            return Err(fault);
        }
        let within = |q: f64| q >= self.limits.minimum() && q <= self.limits.maximum();
        let mut elbows = [[None; 2]; 3];
        for (arm, (elbow, q)) in robot.arms().iter().zip(elbows.iter_mut().zip(out)) {
            let mirrored = self.in_turn(other_elbow(arm, x, q));
            *elbow = [q, mirrored].map(|q| within(q).then_some(q));
            if *elbow == [None; 2] {
                return Err(fault);
            }
        }
        for choice in 0..8_usize {
            let q = [0, 1, 2].map(|arm| elbows[arm][choice >> (2 - arm) & 1]);
            if let [Some(q1), Some(q2), Some(q3)] = q
                && hangs_below(robot, x, &[q1, q2, q3])
            {
                return Ok([q1, q2, q3]);
            }
        }
        Err(fault)
    }

    /// Checks a position (mm) with joint angles (radians) that satisfy the constraints.
    ///
    /// # Errors
    /// The limit or singularity that rules it out.
    pub fn allows(&self, robot: &Robot<f64>, x: &Vector3<f64>, q: &[f64; 3]) -> Result<(), Limit> {
        self.within_joints(q)?;
        self.within_forearms(robot, x, q)?;
        if !robot.has_carriages_above(x, q) {
            Err(Limit::Serial(ArmIndex::First))
        } else if hangs_below(robot, x, q) {
            Ok(())
        } else {
            Err(Limit::Parallel(ArmIndex::First))
        }
    }

    /// The same angle within half a turn of the middle of the joints' range. A travel is unchanged.
    pub fn in_turn(&self, q: f64) -> f64 {
        if self.limits.drive() == Drive::Linear {
            return q;
        }
        let middle = self.limits.at(0.5);
        if (q - middle).abs() <= PI {
            q
        } else {
            middle + (q - middle + PI).rem_euclid(TAU) - PI
        }
    }

    /// Same as [`position`](Self::position), but clear of singularities ([`SingularityDistance::is_clear`]).
    ///
    /// # Errors
    /// The limit that rules it out, or the singularity that is too close.
    pub fn clear_position(&self, robot: &Robot<f64>, q: &[f64; 3]) -> Result<Vector3<f64>, Limit> {
        let x = self.position(robot, q)?;
        let conditioning = robot.singularity_distance(&x, q);
        let nearest = ArmIndex::ALL
            .into_iter()
            .min_by(|a, b| {
                conditioning.serial[a.index()].total_cmp(&conditioning.serial[b.index()])
            })
            .unwrap_or(ArmIndex::First);
        if conditioning.is_clear() {
            Ok(x)
        } else if conditioning.parallel > SingularityDistance::<f64>::LEAST_PARALLEL {
            Err(Limit::Serial(nearest))
        } else {
            Err(Limit::Parallel(nearest))
        }
    }

    fn within_joints(&self, q: &[f64; 3]) -> Result<(), Limit> {
        for (q, arm) in q.iter().zip(ArmIndex::ALL) {
            if !(*q >= self.limits.minimum()) {
                return Err(Limit::JointMinimum(arm));
            }
            if !(*q <= self.limits.maximum()) {
                return Err(Limit::JointMaximum(arm));
            }
        }
        Ok(())
    }

    fn within_forearms(
        &self,
        robot: &Robot<f64>,
        x: &Vector3<f64>,
        q: &[f64; 3],
    ) -> Result<(), Limit> {
        let Some(limit) = self.forearm_limit else {
            return Ok(());
        };
        for (q, arm) in q.iter().zip(ArmIndex::ALL) {
            if !(forearm_angle(robot, arm, x, *q) <= limit) {
                return Err(Limit::Forearm(arm));
            }
        }
        Ok(())
    }
}

/// Least distance of the platform from the plane of the elbows, as a fraction of the forearm: closer,
/// [`Robot::forward`] treats the pose as singular.
const LEAST_HEIGHT: f64 = 6e-8;

/// The joint angle, radians, with the elbow on the other side of the line from motor to platform, for an arm of a rotary
/// drive whose forearm reaches `x` at joint angle `q`.
pub(crate) fn other_elbow(arm: &Arm<f64>, x: &Vector3<f64>, q: f64) -> f64 {
    let w = x - arm.d();
    2.0 * arm.basis().v.dot(&w).atan2(arm.basis().u.dot(&w)) - q
}

/// Whether, at a pose (`x`, `q`) that satisfies the constraints, the platform is off the plane of the elbows, on the
/// side where [`Robot::forward`] finds it.
pub fn hangs_below(robot: &Robot<f64>, x: &Vector3<f64>, q: &[f64; 3]) -> bool {
    let [arm1, arm2, arm3] = robot.arms();
    let [q1, q2, q3] = *q;
    let elbow = arm1.elbow(q1);
    let normal = (arm2.elbow(q2) - elbow).cross(&(arm3.elbow(q3) - elbow));
    let height = (x - elbow).dot(&normal) * normal.dot(&robot.up()).signum();
    height < -LEAST_HEIGHT * arm1.lb() * normal.norm()
}

/// The angle of a forearm out of the plane in which its upper arm moves, radians, 0 to π/2.
pub fn forearm_angle(robot: &Robot<f64>, arm: ArmIndex, x: &Vector3<f64>, q: f64) -> f64 {
    let arm = robot.arm(arm);
    let sine = (x - arm.elbow(q)).dot(&arm.basis().ey) / arm.lb();
    let sine = sine.abs().min(1.0);
    // The platform's arcsine differs in the last bits between systems.
    sine.angle_over(((1.0 - sine) * (1.0 + sine)).square_root())
}

/// Smaller moves, radians or mm, are the noise of a joint's readings.
const STILL: f64 = 3e-4;

/// The direction of each joint's last move, −1 or 1; 0 before its first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Directions {
    before: Option<[f64; 3]>,
    directions: [f64; 3],
}

impl Directions {
    /// The directions after a move to these joint angles or travels.
    pub(crate) fn next(&mut self, joints: &[f64; 3]) -> [f64; 3] {
        let before = self.before.replace(*joints).unwrap_or(*joints);
        for ((direction, to), from) in self.directions.iter_mut().zip(joints).zip(before) {
            if (to - from).abs() > STILL {
                *direction = (to - from).signum();
            }
        }
        self.directions
    }
}

/// A joint may be this many degrees or millimetres outside the limits, because encoder zeros vary.
pub(crate) const LIMIT_MARGIN: f64 = 1.0;

/// Whether a joint is outside the limits by more than [`LIMIT_MARGIN`].
pub(crate) fn outside_limits(joint: f64, limits: &JointLimits<f64>) -> bool {
    let margin = joint::inwards(limits.drive(), LIMIT_MARGIN);
    joint < limits.minimum() - margin || joint > limits.maximum() + margin
}

/// The smallest and largest value; (∞, −∞) if there are none.
pub fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    values
        .into_iter()
        .fold(none, |(low, high), value| (low.min(value), high.max(value)))
}

/// The mean of points; 0 of nothing.
pub(crate) fn centroid(points: impl IntoIterator<Item = Vector3<f64>>) -> Vector3<f64> {
    let none = (Vector3::zeros(), 0.0);
    let points = points.into_iter();
    let (sum, count) = points.fold(none, |(sum, count), own| (sum + own, count + 1.0));
    sum / f64::max(count, 1.0)
}

/// Joint angles per joint, both ends included.
const SWEEP: u32 = 33;
/// The number of combinations.
pub(crate) const SWEPT: u32 = SWEEP.pow(3);

/// Whether the forearms meet in any pose of the sweep, ignoring limits of the ball joints.
pub(crate) fn reaches_anywhere(robot: &Robot<f64>, limits: &JointLimits<f64>) -> bool {
    let reach = Reach {
        limits: *limits,
        forearm_limit: None,
        within: None,
    };
    sweep(&reach).any(|q| robot.forward(&q).is_ok())
}

/// All combinations of evenly spaced joint angles within the limits, both ends included.
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
