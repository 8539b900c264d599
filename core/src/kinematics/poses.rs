use crate::robot::{Arm, ArmIndex, Drive, DriveOf, Robot};
use crate::{Real, SettingError};
use nalgebra::Vector3;

/// Why the kinematics have no solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum KinematicsError {
    /// The forearms do not meet (forward; names the arm that falls shortest), or the arm does not reach the point
    /// (inverse).
    #[error("unreachable for {0}")]
    Unreachable(ArmIndex),
    /// The pose exists but is singular (type 1): upper arm and forearm are in line (in the arm plane), so the joint
    /// cannot move the platform along the forearm. This is the edge of the workspace.
    #[error("singular (type 1): upper arm and forearm of {0} are in line")]
    Serial(ArmIndex),
    /// The pose exists but is singular (type 2): ∂f/∂X is singular because the forearms are coplanar; the joints do not
    /// hold the platform. Names the arm whose forearm is nearest to the plane of the other two.
    #[error("singular (type 2): the forearm of {0} lies in the plane of the other two")]
    Parallel(ArmIndex),
    /// A joint angle or coordinate of this arm is NaN, infinite, or beyond the sine's range.
    #[error("a number of {0} is not finite")]
    NonFinite(ArmIndex),
}

impl KinematicsError {
    /// The arm at fault.
    pub const fn arm(&self) -> ArmIndex {
        match self {
            Self::Unreachable(arm)
            | Self::Serial(arm)
            | Self::Parallel(arm)
            | Self::NonFinite(arm) => *arm,
        }
    }
}

impl<T: Real> Robot<T> {
    /// Forward kinematics in closed form: the platform point at the joint angles `q` (radians).
    ///
    /// The point is an intersection of three spheres with centres Bᵢ(qᵢ) and radii Lbᵢ. Of the two intersections, it is
    /// the one below the plane of the elbows. "Below" is relative to ez₁ + ez₂ + ez₃, which holds in any frame and for
    /// either order of the arms.
    ///
    /// # Errors
    /// [`KinematicsError::Unreachable`] if the forearms do not meet, [`KinematicsError::Parallel`] if the elbows are collinear or the platform lies in their plane (within 4√ε),
    /// [`KinematicsError::NonFinite`] for a non-finite joint angle.
    ///
    /// ```
    /// use delta_cal::SymmetricRobot;
    /// # fn main() -> Result<(), Box<dyn core::error::Error>> {
    /// // The Delta of the Trossen forum: arms at −90°, 30°, 150°.
    /// let robot = SymmetricRobot {
    ///     base_radius: 457.3 / (2.0 * 3f64.sqrt()),
    ///     platform_radius: 115.0 / (2.0 * 3f64.sqrt()),
    ///     upper_arm: 112.0,
    ///     forearm: 232.0,
    /// }
    /// .robot_from_azimuth(-90f64.to_radians())?;
    /// let x = robot.forward(&[0.0, 0.0, 0.0])?;
    /// assert!((x.z - -96.8590).abs() < 5e-5);
    /// # Ok(())
    /// # }
    /// ```
    pub fn forward(&self, q: &[T; 3]) -> Result<Vector3<T>, KinematicsError> {
        T::forward(self, q)
    }

    pub(crate) fn point_at(&self, q: &[T; 3]) -> Result<Vector3<T>, KinematicsError> {
        let [arm1, arm2, arm3] = self.arms();
        let [q1, q2, q3] = *q;
        let elbows = [arm1.elbow(q1), arm2.elbow(q2), arm3.elbow(q3)];
        // In units of the forearm, so that products of five lengths do not overflow.
        let unit = arm1.lb().power_of_two_below();
        let inverse_unit = T::ONE / unit;
        let [b1, b2, b3] = elbows.map(|elbow| elbow * inverse_unit);
        let (edge2, edge3) = (b2 - b1, b3 - b1);
        let normal = edge2.cross(&edge3);
        let normal_squared = normal.dot(&normal);
        let (edge2_squared, edge3_squared) = (edge2.dot(&edge2), edge3.dot(&edge3));
        // sin² of the angle between two edges, against ε: collinear elbows, or one that is not finite.
        if !(normal_squared > T::EPSILON * edge2_squared * edge3_squared) {
            let mut arms = elbows.iter().zip(ArmIndex::ALL);
            let faulty = arms.find(|(elbow, _)| !elbow.dot(elbow).finite());
            return Err(match faulty {
                Some((_, index)) => KinematicsError::NonFinite(index),
                None => KinematicsError::Parallel(ArmIndex::First),
            });
        }
        let [r1, r2, r3] = [arm1, arm2, arm3].map(|arm| (arm.lb() * inverse_unit).squared());
        // The point in the plane of the elbows with equal power with respect to all three circles: p · edge_k = (r₁ −
        // r_k + |edge_k|²)/2, solved by the reciprocal basis of the edges.
        let along2 = (r1 - r2 + edge2_squared) * T::HALF;
        let along3 = (r1 - r3 + edge3_squared) * T::HALF;
        let in_plane =
            (edge3.cross(&normal) * along2 + normal.cross(&edge2) * along3) / normal_squared;
        let height_squared = r1 - in_plane.dot(&in_plane);
        if !height_squared.finite() {
            return Err(KinematicsError::NonFinite(ArmIndex::First));
        }
        let centre = b1 + in_plane;
        let least = T::from_f64(16.0) * T::EPSILON * r1;
        if !(height_squared > least) {
            let arm = farthest(&centre, &[b1, b2, b3], [r1, r2, r3]);
            return Err(if height_squared.magnitude() > least {
                KinematicsError::Unreachable(arm)
            } else {
                KinematicsError::Parallel(arm)
            });
        }
        let height = (height_squared / normal_squared).square_root();
        let below = if normal.dot(&self.up()) > T::ZERO {
            -height
        } else {
            height
        };
        let position = (centre + normal * below) * unit;
        // Lengths near the limits of the scalar type can overflow.
        if position.dot(&position).finite() {
            Ok(position)
        } else {
            Err(KinematicsError::NonFinite(ArmIndex::First))
        }
    }
}

/// The arm whose forearm falls shortest of the point of equal power, relative to its length.
fn farthest<T: Real>(centre: &Vector3<T>, elbows: &[Vector3<T>; 3], squared: [T; 3]) -> ArmIndex {
    let mut worst = (ArmIndex::First, T::ZERO);
    for ((elbow, radius_squared), index) in elbows.iter().zip(squared).zip(ArmIndex::ALL) {
        let offset = centre - elbow;
        let excess = offset.dot(&offset) / radius_squared;
        if excess > worst.1 {
            worst = (index, excess);
        }
    }
    worst.0
}

impl<T: Real> Arm<T> {
    /// The elbow-out joint angle at which the forearm reaches `x`; in (−π, π] if the transmission is exact.
    ///
    /// The constraint is A cos q + B sin q = C with A = u·w, B = v·w, w = X − D,
    /// C = (|w|² + La² − Lb²)/2, so q = atan2(B, A) − acos(C/√(A²+B²)); with
    /// S = √(A² + B² − C²) that is q = atan2(BC − AS, AC + BS), which needs a single function call.
    fn joint_at(&self, x: &Vector3<T>, arm: ArmIndex) -> Result<T, KinematicsError> {
        if self.drive() == Drive::Linear {
            return self.travel_at(x, arm);
        }
        let w = x - self.d();
        let basis = self.basis();
        let a = basis.u.dot(&w);
        let b = basis.v.dot(&w);
        let (la_x, la_y) = self.la();
        let c = (w.dot(&w) + la_x * la_x + la_y * la_y - self.lb() * self.lb()) * T::HALF;
        let reach_squared = a * a + b * b;
        let root_squared = reach_squared - c * c;
        if !(reach_squared.finite() && (c * c).finite()) {
            return Err(KinematicsError::NonFinite(arm));
        }
        // S/√(A²+B²) is the sine of the angle between the arm's two links, projected onto its plane; below 4√ε its
        // square is rounding, and the joint angle has lost half of its digits.
        if !(root_squared.magnitude() > T::from_f64(16.0) * T::EPSILON * reach_squared) {
            return Err(KinematicsError::Serial(arm));
        }
        if !(root_squared > T::ZERO) {
            return Err(KinematicsError::Unreachable(arm));
        }
        let s = root_squared.square_root();
        Ok(self.joint_angle((b * c - a * s).angle_over(a * c + b * s)))
    }

    /// The travel at which the forearm reaches `x` from above: |w − s v|² = Lb² with w = X − D gives s = (v·w +
    /// √((v·w)² − |v|² (|w|² − Lb²)))/|v|².
    fn travel_at(&self, x: &Vector3<T>, arm: ArmIndex) -> Result<T, KinematicsError> {
        let w = x - self.d();
        let v = &self.basis().v;
        let (along, speed_squared) = (v.dot(&w), v.dot(v));
        // The squared distance of the point from the tower, avoiding the difference of two large squares.
        let beside = w - v * (along / speed_squared);
        let lb_squared = self.lb() * self.lb();
        let rise_squared = lb_squared - beside.dot(&beside);
        if !(rise_squared.finite() && along.finite()) {
            return Err(KinematicsError::NonFinite(arm));
        }
        if !(rise_squared.magnitude() > T::from_f64(16.0) * T::EPSILON * lb_squared) {
            return Err(KinematicsError::Serial(arm));
        }
        if !(rise_squared > T::ZERO) {
            return Err(KinematicsError::Unreachable(arm));
        }
        Ok(along / speed_squared + (rise_squared / speed_squared).square_root())
    }
}

impl<T: Real> Robot<T> {
    /// Whether every carriage of a linear drive is above the platform, along its tower, at a pose (`x`, `q`) that
    /// satisfies the constraints. [`forward`](Self::forward) also finds poses with a forearm pointing upwards. No robot
    /// reaches these from a hanging pose: in between, the forearm is perpendicular to its tower. Always true for rotary
    /// drives.
    pub fn has_carriages_above(&self, x: &Vector3<T>, q: &[T; 3]) -> bool {
        self.drive() == Drive::Rotary
            || self
                .arms()
                .iter()
                .zip(q)
                .all(|(arm, s)| (x - arm.elbow(*s)).dot(&arm.basis().v) < T::ZERO)
    }

    /// Inverse kinematics in closed form: the joint angles (radians, in (−π, π]) at which the
    /// platform is at `x`, on the branch q = atan2(B, A) − acos(C/√(A²+B²)) of each arm.
    ///
    /// With linear drives: the travel at which the carriage is above the platform.
    ///
    /// This is the "elbows out" branch for a robot whose motor axes lie in the base plane. A pose in which an arm has
    /// swung through the line of its forearm is on the other branch, so a different joint angle is returned.
    ///
    /// # Errors
    /// The first arm that does not reach the point, is fully stretched or folded ([`KinematicsError::Serial`], |C| within a
    /// few ε of √(A²+B²)), or has a non-finite coordinate.
    ///
    /// ```
    /// use delta_cal::{ArmIndex, SymmetricRobot};
    /// use delta_cal::kinematics::KinematicsError;
    /// use nalgebra::Vector3;
    /// # fn main() -> Result<(), Box<dyn core::error::Error>> {
    /// let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }
    ///     .robot()?;
    /// let q = robot.inverse(&Vector3::new(20.0, -30.0, -450.0))?;
    /// let x = robot.forward(&q)?;
    /// assert!((x - Vector3::new(20.0, -30.0, -450.0)).norm() < 1e-9);
    /// assert_eq!(
    ///     robot.inverse(&Vector3::new(0.0, 0.0, -2000.0)),
    ///     Err(KinematicsError::Unreachable(ArmIndex::First)),
    /// );
    /// # Ok(())
    /// # }
    /// ```
    pub fn inverse(&self, x: &Vector3<T>) -> Result<[T; 3], KinematicsError> {
        T::inverse(self, x)
    }

    pub(crate) fn joints_at(&self, x: &Vector3<T>) -> Result<[T; 3], KinematicsError> {
        let [first, second, third] = self.arms();
        Ok([
            first.joint_at(x, ArmIndex::First)?,
            second.joint_at(x, ArmIndex::Second)?,
            third.joint_at(x, ArmIndex::Third)?,
        ])
    }
}

/// The range common to all joints.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct JointLimits<T> {
    minimum: T,
    maximum: T,
    drive: DriveOf,
}

impl<T: Real> JointLimits<T> {
    /// All joints range from `minimum` to `maximum`, in radians.
    ///
    /// # Errors
    /// Limits that are not finite, empty or wider than a full turn.
    pub fn new(minimum: T, maximum: T) -> Result<Self, SettingError> {
        let limits = Self::of(minimum, maximum, DriveOf::ROTARY)?;
        if !(maximum - minimum <= T::TWO * T::PI) {
            return Err(SettingError::JointLimitsTooWide);
        }
        Ok(limits)
    }

    fn of(minimum: T, maximum: T, drive: DriveOf) -> Result<Self, SettingError> {
        if !(minimum.finite() && maximum.finite()) {
            return Err(SettingError::JointLimitNonFinite);
        }
        if !(minimum < maximum) {
            return Err(SettingError::JointLimitsEmpty);
        }
        Ok(Self {
            minimum,
            maximum,
            drive,
        })
    }

    /// All joints of a linear drive range from `minimum` to `maximum`, lengths.
    ///
    /// # Errors
    /// Limits that are not finite, or empty.
    #[cfg(feature = "linear")]
    pub fn travel(minimum: T, maximum: T) -> Result<Self, SettingError> {
        Self::of(minimum, maximum, DriveOf::LINEAR)
    }

    /// Whether the limits are angles or travels.
    pub const fn drive(&self) -> Drive {
        self.drive.get()
    }

    /// Smallest joint angle, radians; smallest travel, length, for linear drives.
    pub fn minimum(&self) -> T {
        self.minimum
    }

    /// Largest joint angle, radians; largest travel, length, for linear drives.
    pub fn maximum(&self) -> T {
        self.maximum
    }

    /// The joint value at `fraction` of the range, 0 to 1.
    pub fn at(&self, fraction: T) -> T {
        self.minimum + (self.maximum - self.minimum) * fraction
    }
}
