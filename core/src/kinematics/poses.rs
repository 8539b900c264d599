use crate::Real;
use crate::robot::{Arm, ArmIndex, Drive, DriveOf, Robot};
use core::fmt;
use nalgebra::Vector3;

/// Which way a pose is singular.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Singularity {
    /// Type 1: upper arm and forearm are in line (in the arm plane); the joint cannot move the
    /// platform along the forearm. The edge of the workspace.
    Serial,
    /// Type 2: ∂f/∂X is singular, the forearms' directions lie in one plane; the joints do not
    /// hold the platform.
    Parallel,
}

/// Why a pose has no position, or a position no joint angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum KinematicsError {
    /// The forearms do not meet (forward; the named arm is the one that falls short most), or the
    /// arm does not reach the point (inverse).
    Unreachable(ArmIndex),
    /// The pose exists and is singular at the named arm. For [`Singularity::Parallel`] it is the
    /// arm whose forearm lies nearest to the plane of the other two.
    Singular(ArmIndex, Singularity),
    /// A joint angle or coordinate of this arm is NaN, infinite, or beyond the sine's range.
    NonFinite(ArmIndex),
}

impl KinematicsError {
    /// The arm at fault.
    pub const fn arm(&self) -> ArmIndex {
        match self {
            Self::Unreachable(arm) | Self::Singular(arm, _) | Self::NonFinite(arm) => *arm,
        }
    }
}

impl fmt::Display for KinematicsError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreachable(arm) => write!(formatter, "unreachable for {arm}"),
            Self::Singular(arm, Singularity::Serial) => write!(
                formatter,
                "singular (type 1): upper arm and forearm of {arm} are in line"
            ),
            Self::Singular(arm, Singularity::Parallel) => write!(
                formatter,
                "singular (type 2): the forearm of {arm} lies in the plane of the other two"
            ),
            Self::NonFinite(arm) => write!(formatter, "a number of {arm} is not finite"),
        }
    }
}

impl core::error::Error for KinematicsError {}

impl<T: Real> Robot<T> {
    /// Forward kinematics in closed form: the platform point at the joint angles `q` (radians).
    ///
    /// The point is the intersection of three spheres of centre Bᵢ(qᵢ) and radius Lbᵢ. Of the two
    /// it is the one below the plane of the elbows, "below" being against ez₁ + ez₂ + ez₃, which
    /// holds in any frame and for arms numbered either way round.
    ///
    /// # Errors
    /// [`KinematicsError::Unreachable`] if the forearms do not meet,
    /// [`KinematicsError::Singular`] with [`Singularity::Parallel`] if the elbows lie on one line
    /// or the platform in their plane (to within 4√ε), [`KinematicsError::NonFinite`] for a joint
    /// angle that is not a finite number.
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
        let [arm1, arm2, arm3] = self.arms();
        let [q1, q2, q3] = *q;
        let elbows = [arm1.elbow(q1), arm2.elbow(q2), arm3.elbow(q3)];
        for (elbow, index) in elbows.iter().zip(ArmIndex::ALL) {
            if !elbow.dot(elbow).finite() {
                return Err(KinematicsError::NonFinite(index));
            }
        }
        // In units of the forearm: products of five lengths must not overflow.
        let unit = arm1.lb().power_of_two_below();
        let inverse_unit = T::ONE / unit;
        let elbows = elbows.map(|elbow| elbow * inverse_unit);
        let [b1, b2, b3] = elbows;
        let (edge2, edge3) = (b2 - b1, b3 - b1);
        let normal = edge2.cross(&edge3);
        let normal_squared = normal.dot(&normal);
        let (edge2_squared, edge3_squared) = (edge2.dot(&edge2), edge3.dot(&edge3));
        // sin² of the angle between two edges, against ε: elbows on one line.
        if !(normal_squared > T::EPSILON * edge2_squared * edge3_squared) {
            return Err(KinematicsError::Singular(
                ArmIndex::First,
                Singularity::Parallel,
            ));
        }
        let [r1, r2, r3] = [arm1, arm2, arm3].map(|arm| (arm.lb() * inverse_unit).squared());
        // In the elbows' plane the point has equal power with respect to all three circles:
        // p · edge_k = (r₁ − r_k + |edge_k|²)/2, solved by the reciprocal basis of the edges.
        let along2 = (r1 - r2 + edge2_squared) * T::HALF;
        let along3 = (r1 - r3 + edge3_squared) * T::HALF;
        let in_plane =
            (edge3.cross(&normal) * along2 + normal.cross(&edge2) * along3) / normal_squared;
        let height_squared = r1 - in_plane.dot(&in_plane);
        if !height_squared.finite() {
            return Err(KinematicsError::NonFinite(ArmIndex::First));
        }
        let centre = b1 + in_plane;
        if !(height_squared.magnitude() > T::from_f64(16.0) * T::EPSILON * r1) {
            return Err(KinematicsError::Singular(
                farthest(&centre, &elbows, [r1, r2, r3]),
                Singularity::Parallel,
            ));
        }
        if !(height_squared > T::ZERO) {
            return Err(KinematicsError::Unreachable(farthest(
                &centre,
                &elbows,
                [r1, r2, r3],
            )));
        }
        let height = (height_squared / normal_squared).square_root();
        let below = if normal.dot(&self.up()) > T::ZERO {
            -height
        } else {
            height
        };
        let position = (centre + normal * below) * unit;
        // Lengths near the ends of the scalar type's range.
        if position.dot(&position).finite() {
            Ok(position)
        } else {
            Err(KinematicsError::NonFinite(ArmIndex::First))
        }
    }
}

/// The arm whose forearm falls short most, relative to its length, of the point of equal power.
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

/// Why one arm alone has no joint angle for a point.
enum Fault {
    Unreachable,
    Serial,
    NonFinite,
}

impl<T: Real> Arm<T> {
    /// The elbow-out joint angle at which the forearm reaches `x`; of an exact transmission in (−π, π].
    ///
    /// The constraint is A cos q + B sin q = C with A = u·w, B = v·w, w = X − D,
    /// C = (|w|² + La² − Lb²)/2, so q = atan2(B, A) − acos(C/√(A²+B²)); with
    /// S = √(A² + B² − C²) that is q = atan2(BC − AS, AC + BS), which needs one function only.
    fn joint_at(&self, x: &Vector3<T>) -> Result<T, Fault> {
        if self.drive() == Drive::Linear {
            return self.travel_at(x);
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
            return Err(Fault::NonFinite);
        }
        // S/√(A²+B²) is the sine of the angle between the arm's two links seen in its plane; below
        // 4√ε its square is rounding, and the joint angle has lost half of its digits.
        if !(root_squared.magnitude() > T::from_f64(16.0) * T::EPSILON * reach_squared) {
            return Err(Fault::Serial);
        }
        if !(root_squared > T::ZERO) {
            return Err(Fault::Unreachable);
        }
        let s = root_squared.square_root();
        Ok(self.joint_angle((b * c - a * s).angle_over(a * c + b * s)))
    }

    /// The travel at which the forearm reaches `x` from above: |w − s v|² = Lb², w = X − D, so that
    /// s = (v·w + √((v·w)² − |v|² (|w|² − Lb²)))/|v|².
    fn travel_at(&self, x: &Vector3<T>) -> Result<T, Fault> {
        let w = x - self.d();
        let v = &self.basis().v;
        let (along, speed_squared) = (v.dot(&w), v.dot(v));
        // The point's distance from the tower, squared, without the difference of two large squares.
        let beside = w - v * (along / speed_squared);
        let lb_squared = self.lb() * self.lb();
        let rise_squared = lb_squared - beside.dot(&beside);
        if !(rise_squared.finite() && along.finite()) {
            return Err(Fault::NonFinite);
        }
        if !(rise_squared.magnitude() > T::from_f64(16.0) * T::EPSILON * lb_squared) {
            return Err(Fault::Serial);
        }
        if !(rise_squared > T::ZERO) {
            return Err(Fault::Unreachable);
        }
        Ok(along / speed_squared + (rise_squared / speed_squared).square_root())
    }
}

impl<T: Real> Robot<T> {
    /// Whether every carriage of linear drives is above the platform, each along its tower, at a pose (`x`, `q`)
    /// that satisfies the constraints. [`forward`](Self::forward) also finds poses in which a forearm points
    /// upwards; no robot gets there from where it hangs down, for between the two it is square to its tower.
    /// Always true of rotary drives.
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
    /// With linear drives it is the travel at which the carriage is above the platform.
    ///
    /// That is "elbows out" for a robot whose motor axes lie in the base plane. A pose whose arm has
    /// swung through its line with the forearm is on the other branch, and comes back with another
    /// joint angle.
    ///
    /// # Errors
    /// The first arm that does not reach, is stretched or folded to its edge
    /// ([`Singularity::Serial`], |C| within some ε of √(A²+B²)), or whose coordinate is not
    /// finite.
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
        let [first, second, third] = self.arms();
        let joint = |arm: &Arm<T>, index: ArmIndex| {
            arm.joint_at(x).map_err(|fault| match fault {
                Fault::Unreachable => KinematicsError::Unreachable(index),
                Fault::Serial => KinematicsError::Singular(index, Singularity::Serial),
                Fault::NonFinite => KinematicsError::NonFinite(index),
            })
        };
        Ok([
            joint(first, ArmIndex::First)?,
            joint(second, ArmIndex::Second)?,
            joint(third, ArmIndex::Third)?,
        ])
    }
}

/// The range of every joint.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct JointLimits<T> {
    minimum: T,
    maximum: T,
    drive: DriveOf,
}

/// Why two angles are not a joint's range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum JointLimitsError {
    /// An angle is NaN or infinite.
    NonFinite,
    /// The minimum is not below the maximum.
    Empty,
    /// The range is wider than a turn.
    TooWide,
}

impl fmt::Display for JointLimitsError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::NonFinite => "a joint limit is not a finite number",
            Self::Empty => "the smallest joint limit must be below the largest",
            Self::TooWide => "the joint limits span more than one turn",
        })
    }
}

impl core::error::Error for JointLimitsError {}

impl<T: Real> JointLimits<T> {
    /// All joints from `minimum` to `maximum`, in radians.
    ///
    /// # Errors
    /// Limits that are not finite, empty or wider than a turn.
    pub fn new(minimum: T, maximum: T) -> Result<Self, JointLimitsError> {
        if !(minimum.finite() && maximum.finite()) {
            return Err(JointLimitsError::NonFinite);
        }
        if !(minimum < maximum) {
            return Err(JointLimitsError::Empty);
        }
        if !(maximum - minimum <= T::TWO * T::PI) {
            return Err(JointLimitsError::TooWide);
        }
        Ok(Self {
            minimum,
            maximum,
            drive: DriveOf::ROTARY,
        })
    }

    /// All joints of linear drives from `minimum` to `maximum`, lengths.
    ///
    /// # Errors
    /// Limits that are not finite, or empty.
    #[cfg(feature = "linear")]
    pub fn travel(minimum: T, maximum: T) -> Result<Self, JointLimitsError> {
        if !(minimum.finite() && maximum.finite()) {
            return Err(JointLimitsError::NonFinite);
        }
        if !(minimum < maximum) {
            return Err(JointLimitsError::Empty);
        }
        Ok(Self {
            minimum,
            maximum,
            drive: DriveOf::LINEAR,
        })
    }

    /// Whether these are angles or travels.
    pub const fn drive(&self) -> Drive {
        self.drive.get()
    }

    /// Smallest joint angle, radians; of linear drives the smallest travel, length.
    pub fn minimum(&self) -> T {
        self.minimum
    }

    /// Largest joint angle, radians; of linear drives the largest travel, length.
    pub fn maximum(&self) -> T {
        self.maximum
    }

    /// The angle at `fraction` of the range, 0 to 1.
    pub fn at(&self, fraction: T) -> T {
        self.minimum + (self.maximum - self.minimum) * fraction
    }
}
