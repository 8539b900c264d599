use super::error::{KinematicsError, Singularity};
use crate::Real;
use crate::robot::{ArmIndex, Robot};
use nalgebra::Vector3;

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
