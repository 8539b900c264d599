//! Which poses a robot may take, and what forbids the others.

use delta_cal::{ArmIndex, Conditioning, JointLimits, KinematicsError, Real, Robot, Singularity};
use nalgebra::Vector3;
use std::fmt;

/// What keeps the platform from a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Limit {
    /// A joint would be below its smallest angle.
    JointMinimum(ArmIndex),
    /// A joint would be above its largest angle.
    JointMaximum(ArmIndex),
    /// The forearm would stand further out of its arm's plane than its ball joints allow.
    Forearm(ArmIndex),
    /// Type 1: upper arm and forearm are in line, or do not reach that far.
    Serial(ArmIndex),
    /// Type 2: the forearms lie in one plane.
    Parallel(ArmIndex),
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
            | Self::Unreachable(arm)
            | Self::NonFinite(arm) => arm,
        }
    }

    /// As in the files: `joint_minimum_1`.
    pub fn name(self) -> String {
        let kind = match self {
            Self::JointMinimum(_) => "joint_minimum",
            Self::JointMaximum(_) => "joint_maximum",
            Self::Forearm(_) => "forearm_angle",
            Self::Serial(_) => "serial_singularity",
            Self::Parallel(_) => "parallel_singularity",
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
                "the forearm of {arm} stands further out of its arm's plane than the ball joints allow"
            ),
            Self::Serial(_) => KinematicsError::Singular(arm, Singularity::Serial).fmt(formatter),
            Self::Parallel(_) => {
                KinematicsError::Singular(arm, Singularity::Parallel).fmt(formatter)
            }
            Self::Unreachable(_) => KinematicsError::Unreachable(arm).fmt(formatter),
            Self::NonFinite(_) => KinematicsError::NonFinite(arm).fmt(formatter),
        }
    }
}

impl From<KinematicsError> for Limit {
    fn from(error: KinematicsError) -> Self {
        match error {
            KinematicsError::Singular(arm, Singularity::Serial) => Self::Serial(arm),
            KinematicsError::Singular(arm, Singularity::Parallel) => Self::Parallel(arm),
            KinematicsError::Unreachable(arm) => Self::Unreachable(arm),
            error => Self::NonFinite(error.arm()),
        }
    }
}

/// The limits of the joints and of the ball joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// The range of every joint.
    pub limits: JointLimits<f64>,
    /// The largest angle of a forearm out of its arm's plane, radians; `None` for any.
    pub forearm_limit: Option<f64>,
}

impl Reach {
    /// Where the platform is at these joint angles (radians), mm.
    ///
    /// # Errors
    /// What keeps it from there.
    pub fn position(&self, robot: &Robot<f64>, q: &[f64; 3]) -> Result<Vector3<f64>, Limit> {
        self.within_joints(q)?;
        let x = robot.forward(q)?;
        self.within_forearms(robot, &x, q)?;
        Ok(x)
    }

    /// The joint angles (radians) with which the platform is at a position (mm).
    ///
    /// # Errors
    /// What keeps it from there. The position may have joint angles at which the platform would be
    /// elsewhere, beyond a parallel singularity: that is an error too.
    pub fn joints(&self, robot: &Robot<f64>, x: &Vector3<f64>) -> Result<[f64; 3], Limit> {
        let q = robot.inverse(x)?;
        self.within_joints(&q)?;
        self.within_forearms(robot, x, &q)?;
        let there = robot.forward(&q)?;
        let arm = ArmIndex::First;
        if (there - x).norm() <= SAME_PLACE * robot.arm(arm).lb() {
            Ok(q)
        } else {
            Err(Limit::Parallel(arm))
        }
    }

    /// The same, and clear of singularities ([`Conditioning::is_clear`]).
    ///
    /// # Errors
    /// What keeps it from there, or which singularity is too near.
    pub fn clear_position(&self, robot: &Robot<f64>, q: &[f64; 3]) -> Result<Vector3<f64>, Limit> {
        let x = self.position(robot, q)?;
        let conditioning = robot.conditioning(&x, q);
        let nearest = ArmIndex::ALL
            .into_iter()
            .min_by(|a, b| {
                conditioning.serial[a.index()].total_cmp(&conditioning.serial[b.index()])
            })
            .unwrap_or(ArmIndex::First);
        if conditioning.is_clear() {
            Ok(x)
        } else if conditioning.parallel > Conditioning::<f64>::LEAST_PARALLEL {
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

/// Forward of inverse may be off by this part of the forearm.
const SAME_PLACE: f64 = 1e-6;

/// The angle of an arm's forearm out of the plane in which its upper arm moves, radians, 0 to π/2.
pub fn forearm_angle(robot: &Robot<f64>, arm: ArmIndex, x: &Vector3<f64>, q: f64) -> f64 {
    let arm = robot.arm(arm);
    let sine = (x - arm.elbow(q)).dot(&arm.basis().ey) / arm.lb();
    let sine = sine.abs().min(1.0);
    // The platform's arcsine has other bits on another system.
    sine.angle_over(((1.0 - sine) * (1.0 + sine)).square_root())
}
