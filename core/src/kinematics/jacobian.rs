use super::error::{KinematicsError, Singularity};
use crate::Real;
use crate::robot::{Arm, ArmIndex, Robot};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// How the platform point moves with the joints and with the parameters, at one pose.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PlatformJacobian<T: Real> {
    /// ∂X/∂q = −(∂f/∂X)⁻¹ ∂f/∂q, the velocity Jacobian: Ẋ = by_joints · q̇. Length per radian.
    pub by_joints: Matrix3<T>,
    /// ∂X/∂Pᵢ = −(∂f/∂X)⁻¹ ∂f/∂Pᵢ of each arm, from differentiating (3.14); the printed (3.16),
    /// (3.17) and (3.18) differ in sign. Columns at the
    /// parameters' [places](crate::robot::Drive::places); dimensionless, or length per radian.
    pub by_parameters: [SMatrix<T, 3, 8>; 3],
}

impl<T: Real> Robot<T> {
    /// Both derivatives of the platform point at the pose (`x`, `q`), which must satisfy the
    /// constraints (as `x = self.forward(q)` does).
    ///
    /// # Errors
    /// [`Singularity::Parallel`] where |det| of the forearms' unit vectors is below √ε, naming the
    /// arm whose forearm lies nearest to the plane of the other two; [`Singularity::Serial`] where
    /// a joint does not move the platform; numbers that are not finite.
    ///
    /// ```
    /// use delta_cal::SymmetricRobot;
    /// # fn main() -> Result<(), Box<dyn core::error::Error>> {
    /// let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }
    ///     .robot()?;
    /// let q = [0.1, 0.2, 0.3];
    /// let jacobian = robot.platform_jacobian(&robot.forward(&q)?, &q)?;
    /// let step = 1e-6;
    /// let moved = robot.forward(&[0.1 + step, 0.2, 0.3])? - robot.forward(&q)?;
    /// assert!((moved / step - jacobian.by_joints.column(0)).norm() < 1e-3);
    /// # Ok(())
    /// # }
    /// ```
    pub fn platform_jacobian(
        &self,
        x: &Vector3<T>,
        q: &[T; 3],
    ) -> Result<PlatformJacobian<T>, KinematicsError> {
        let inverse = self.inverse_by_position(x, q)?;
        let [arm1, arm2, arm3] = self.arms();
        let [q1, q2, q3] = *q;
        let [column1, column2, column3] = inverse;
        let joint_column = |arm: &Arm<T>, q: T, column: &Vector3<T>, index: ArmIndex| {
            let by_joint = arm.constraint_by_joint(x, q);
            let scale = arm.lb() * arm.elbow_speed();
            if by_joint.magnitude() > T::EPSILON.square_root() * scale {
                Ok(column * -by_joint)
            } else {
                Err(KinematicsError::Singular(index, Singularity::Serial))
            }
        };
        let parameter_block = |arm: &Arm<T>, q: T, column: &Vector3<T>| {
            -(column * arm.constraint_by_parameters(x, q).transpose())
        };
        let jacobian = PlatformJacobian {
            by_joints: Matrix3::from_columns(&[
                joint_column(arm1, q1, &column1, ArmIndex::First)?,
                joint_column(arm2, q2, &column2, ArmIndex::Second)?,
                joint_column(arm3, q3, &column3, ArmIndex::Third)?,
            ]),
            by_parameters: [
                parameter_block(arm1, q1, &column1),
                parameter_block(arm2, q2, &column2),
                parameter_block(arm3, q3, &column3),
            ],
        };
        // Lengths near the ends of the scalar type's range.
        let blocks = jacobian.by_parameters.iter().flat_map(|block| block.iter());
        if jacobian
            .by_joints
            .iter()
            .chain(blocks)
            .all(|entry| entry.finite())
        {
            Ok(jacobian)
        } else {
            Err(KinematicsError::NonFinite(ArmIndex::First))
        }
    }

    /// How the platform point moves with the numbers of the [transmissions](crate::robot::Transmission), at a pose
    /// (`x`, `q`) that satisfies the constraints: five columns a joint. Length per radian; of the gains length.
    ///
    /// # Errors
    /// Those of [`platform_jacobian`](Self::platform_jacobian) at a parallel singularity.
    #[cfg(feature = "transmission")]
    pub fn by_transmissions(
        &self,
        x: &Vector3<T>,
        q: &[T; 3],
    ) -> Result<SMatrix<T, 3, 15>, KinematicsError> {
        let inverse = self.inverse_by_position(x, q)?;
        let mut jacobian = SMatrix::<T, 3, 15>::zeros();
        let mut columns = jacobian.column_iter_mut();
        for ((arm, q), by_constraint) in self.arms().iter().zip(q).zip(&inverse) {
            let by_numbers = arm.constraint_by_transmission(x, *q);
            for (by_number, mut column) in by_numbers.into_iter().zip(&mut columns) {
                column.copy_from(&(by_constraint * -by_number));
            }
        }
        Ok(jacobian)
    }

    /// The columns of (∂f/∂X)⁻¹, whose rows are 2wᵢ with wᵢ = X − Bᵢ, by cross products.
    pub(crate) fn inverse_by_position(
        &self,
        x: &Vector3<T>,
        q: &[T; 3],
    ) -> Result<[Vector3<T>; 3], KinematicsError> {
        let [arm1, arm2, arm3] = self.arms();
        let [q1, q2, q3] = *q;
        // In units of the forearm: products of three lengths must not overflow or vanish.
        let unit = arm1.lb().power_of_two_below();
        let forearms =
            [x - arm1.elbow(q1), x - arm2.elbow(q2), x - arm3.elbow(q3)].map(|w| w / unit);
        let mut lengths = T::ONE;
        for (forearm, index) in forearms.iter().zip(ArmIndex::ALL) {
            let squared = forearm.dot(forearm);
            if !squared.finite() {
                return Err(KinematicsError::NonFinite(index));
            }
            lengths *= squared.square_root();
        }
        let [w1, w2, w3] = forearms;
        let crosses = [w2.cross(&w3), w3.cross(&w1), w1.cross(&w2)];
        let [c1, c2, c3] = crosses;
        let determinant = w1.dot(&c1);
        if !(determinant.magnitude() > T::EPSILON.square_root() * lengths) {
            let mut flattest = (ArmIndex::First, T::ZERO);
            for ((cross, forearm), index) in crosses.iter().zip(&forearms).zip(ArmIndex::ALL) {
                // |wⱼ×wₖ||wᵢ| ∝ 1/sin of the angle between wᵢ and the plane of the others.
                let flatness = cross.dot(cross) * forearm.dot(forearm);
                if flatness > flattest.1 {
                    flattest = (index, flatness);
                }
            }
            return Err(KinematicsError::Singular(flattest.0, Singularity::Parallel));
        }
        let scale = T::HALF / determinant / unit;
        Ok([c1 * scale, c2 * scale, c3 * scale])
    }
}
