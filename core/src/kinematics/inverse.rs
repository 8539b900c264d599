use super::error::{KinematicsError, Singularity};
use crate::Real;
use crate::robot::{Arm, ArmIndex, Drive, Robot};
use nalgebra::Vector3;

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
