use super::poses::KinematicsError;
use crate::Real;
use crate::robot::{
    Arm, ArmAt, ArmBasis, ArmIndex, Drive, Robot, TRANSMISSION_NUMBERS, by_transmission,
};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

impl<T: Real> Arm<T> {
    /// f(P; X, q) = |X − B(q)|² − Lb² (paper, equation (3.8)). Length².
    ///
    /// ```
    /// use delta_cal::robot::Arm;
    /// use nalgebra::Vector3;
    /// # fn main() -> Result<(), delta_cal::robot::GeometryError> {
    /// let arm = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0])?;
    /// // The elbow is at (424, 0, 0); a forearm hanging straight down ends 480 below.
    /// assert_eq!(arm.constraint(&Vector3::new(424.0, 0.0, -480.0), 0.0), 0.0);
    /// # Ok(())
    /// # }
    /// ```
    pub fn constraint(&self, x: &Vector3<T>, q: T) -> T {
        let forearm = x - self.elbow(q);
        forearm.dot(&forearm) - self.lb() * self.lb()
    }

    /// ∂f/∂X = 2 (X − B(q)). Length.
    pub fn constraint_by_position(&self, x: &Vector3<T>, q: T) -> Vector3<T> {
        (x - self.elbow(q)) * T::TWO
    }

    /// ∂f/∂q = −2 (X − B(q)) · B′(q). Length² per radian, or length with a linear drive.
    pub fn constraint_by_joint(&self, x: &Vector3<T>, q: T) -> T {
        self.at(q).constraint_by_joint(x)
    }

    /// ∂f by the numbers of the [transmission](crate::robot::Transmission) of a rotary drive: ∂f/∂(arm angle) times q,
    /// cos q, sin q, cos 2q and sin 2q. Length² per radian; length² for the first.
    pub(crate) fn constraint_by_transmission(
        &self,
        x: &Vector3<T>,
        q: T,
    ) -> [T; TRANSMISSION_NUMBERS] {
        let slope = match self.transmission() {
            None => T::ONE,
            Some(transmission) => transmission.arm_angle(q).1,
        };
        let by_arm_angle = self.constraint_by_joint(x, q) / slope;
        by_transmission(q).map(|by_number| by_number * by_arm_angle)
    }

    /// ∂f/∂P: one row of the Jacobian (3.21), with parameters at their [places](Drive::places). Length for a length,
    /// length² for an angle or a ratio.
    pub fn constraint_by_parameters(&self, x: &Vector3<T>, q: T) -> SVector<T, 8> {
        self.gradient(x, &self.at(q))
    }

    fn gradient(&self, x: &Vector3<T>, at: &ArmAt<T>) -> SVector<T, 8> {
        let ArmBasis { ex, ey, ez, .. } = self.basis();
        let forearm = x - at.elbow;
        let (la, lb) = (self.la(), self.lb());
        constraint_gradient(self.drive(), [ex, ey, ez], la, lb, &forearm, at.turn)
    }
}

impl<T: Real> ArmAt<T> {
    fn constraint_by_joint(&self, x: &Vector3<T>) -> T {
        -((x - self.elbow).dot(&self.derivative) * T::TWO)
    }
}

/// ∂f/∂P from the arm's directions and the forearm vector w = X − B.
///
/// With a = La_x cos q + La_y sin q (radial) and b = La_y cos q − La_x sin q (up), the elbow is
/// B = D + a ex + b ez, and ∂f/∂p = −2 w · ∂B/∂p, ∂f/∂Lb = −2 Lb. The derivatives of the
/// directions are ∂ex/∂θ = t, ∂ez/∂θ = sin α · ex, ∂ez/∂α = −ey, with the tangent
/// t = (−sin θ, cos θ, 0).
///
/// For a linear drive with travel s instead of (sin q, cos q): ∂B/∂D = 1, ∂B/∂lean = s · scale · ∂n/∂lean, ∂B/∂scale =
/// s n.
pub(crate) fn constraint_gradient<T: Real>(
    drive: Drive,
    [ex, ey, ez]: [&Vector3<T>; 3],
    (la_x, la_y): (T, T),
    lb: T,
    forearm: &Vector3<T>,
    (sin_q, cos_q): (T, T),
) -> SVector<T, 8> {
    let w = forearm * -T::TWO;
    if drive == Drive::Linear {
        let (travel, scaled) = (sin_q, sin_q * la_x);
        return SVector::from([
            w.x,
            w.y,
            w.z,
            scaled * w.dot(ex),
            scaled * w.dot(ey),
            travel * w.dot(ez),
            T::ZERO,
            -(lb * T::TWO),
        ]);
    }
    let radial = la_x * cos_q + la_y * sin_q;
    let up = la_y * cos_q - la_x * sin_q;
    let tangent = Vector3::new(-ex.y, ex.x, T::ZERO);
    let sin_alpha = ey.z;
    let (along_ex, along_ez) = (w.dot(ex), w.dot(ez));
    SVector::from([
        w.x,
        w.y,
        w.z,
        radial * w.dot(&tangent) + up * sin_alpha * along_ex,
        -(up * w.dot(ey)),
        along_ex * cos_q - along_ez * sin_q,
        along_ex * sin_q + along_ez * cos_q,
        -(lb * T::TWO),
    ])
}

/// How the platform point moves with the joints and the parameters, at one pose.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PlatformJacobian<T: Real> {
    /// ∂X/∂q = −(∂f/∂X)⁻¹ ∂f/∂q, the velocity Jacobian: Ẋ = by_joints · q̇. Length per radian.
    pub by_joints: Matrix3<T>,
    /// ∂X/∂Pᵢ = −(∂f/∂X)⁻¹ ∂f/∂Pᵢ for each arm, from differentiating (3.14); the printed (3.16) and (3.17) lack the
    /// minus sign. Columns at the parameters' [places](crate::robot::Drive::places); dimensionless, or length per
    /// radian.
    pub by_parameters: [SMatrix<T, 3, 8>; 3],
}

impl<T: Real> Robot<T> {
    /// Both derivatives of the platform point at the pose (`x`, `q`), which must satisfy the
    /// constraints (as `x = self.forward(q)` does).
    ///
    /// # Errors
    /// [`KinematicsError::Parallel`] if |det| of the forearms' unit vectors is below √ε, naming the arm whose forearm is
    /// nearest to the plane of the other two; [`KinematicsError::Serial`] if a joint does not move the platform; non-finite
    /// numbers.
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
        let [arm1, arm2, arm3] = self.arms();
        let [q1, q2, q3] = *q;
        let [at1, at2, at3] = [arm1.at(q1), arm2.at(q2), arm3.at(q3)];
        let inverse = self.inverse_at(x, [&at1.elbow, &at2.elbow, &at3.elbow])?;
        let [column1, column2, column3] = inverse;
        let joint_column = |arm: &Arm<T>, at: &ArmAt<T>, column: &Vector3<T>, index: ArmIndex| {
            let by_joint = at.constraint_by_joint(x);
            let scale = arm.lb() * arm.elbow_speed();
            if by_joint.magnitude() > T::EPSILON.square_root() * scale {
                Ok(column * -by_joint)
            } else {
                Err(KinematicsError::Serial(index))
            }
        };
        let parameter_block = |arm: &Arm<T>, at: &ArmAt<T>, column: &Vector3<T>| {
            -(column * arm.gradient(x, at).transpose())
        };
        let jacobian = PlatformJacobian {
            by_joints: Matrix3::from_columns(&[
                joint_column(arm1, &at1, &column1, ArmIndex::First)?,
                joint_column(arm2, &at2, &column2, ArmIndex::Second)?,
                joint_column(arm3, &at3, &column3, ArmIndex::Third)?,
            ]),
            by_parameters: [
                parameter_block(arm1, &at1, &column1),
                parameter_block(arm2, &at2, &column2),
                parameter_block(arm3, &at3, &column3),
            ],
        };
        // Lengths near the limits of the scalar type can overflow.
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
    /// (`x`, `q`) that satisfies the constraints: five columns per joint. Length per radian; length for the gains.
    ///
    /// # Errors
    /// Same as [`platform_jacobian`](Self::platform_jacobian) at a parallel singularity.
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

    /// The columns of (∂f/∂X)⁻¹ by cross products. The rows of ∂f/∂X are 2wᵢ with wᵢ = X − Bᵢ.
    pub(crate) fn inverse_by_position(
        &self,
        x: &Vector3<T>,
        q: &[T; 3],
    ) -> Result<[Vector3<T>; 3], KinematicsError> {
        let [arm1, arm2, arm3] = self.arms();
        let [q1, q2, q3] = *q;
        self.inverse_at(x, [&arm1.elbow(q1), &arm2.elbow(q2), &arm3.elbow(q3)])
    }

    fn inverse_at(
        &self,
        x: &Vector3<T>,
        [b1, b2, b3]: [&Vector3<T>; 3],
    ) -> Result<[Vector3<T>; 3], KinematicsError> {
        // In units of the forearm, so that products of three lengths neither overflow nor underflow.
        let [arm, ..] = self.arms();
        let unit = arm.lb().power_of_two_below();
        let forearms = [x - b1, x - b2, x - b3].map(|w| w / unit);
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
            return Err(KinematicsError::Parallel(flattest.0));
        }
        let scale = T::HALF / determinant / unit;
        Ok([c1 * scale, c2 * scale, c3 * scale])
    }
}

/// How far a pose is from both types of singularity. Dimensionless: 0 at a singularity, 1 at best.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SingularityDistance<T> {
    /// Type 1: |cosine| of the angle between each forearm and its elbow's direction of motion; 0 if upper arm and
    /// forearm are in line, or a forearm is perpendicular to its tower.
    pub serial: [T; 3],
    /// Type 2: |det| of the forearms' unit vectors, the volume they span; 0 if they are coplanar.
    pub parallel: T,
}

impl<T: Real> SingularityDistance<T> {
    /// [`serial`](Self::serial) above which a pose is clear of singularities: the forearm at least 6° off its upper
    /// arm's line.
    pub const LEAST_SERIAL: f64 = 0.1;
    /// [`parallel`](Self::parallel) above which a pose is clear of singularities.
    pub const LEAST_PARALLEL: f64 = 0.05;

    /// Whether the pose is clear of both types.
    pub fn is_clear(&self) -> bool {
        let least = T::from_f64(Self::LEAST_SERIAL);
        self.serial.iter().all(|serial| *serial > least)
            && self.parallel > T::from_f64(Self::LEAST_PARALLEL)
    }
}

impl<T: Real> Robot<T> {
    /// The distance from singularities at the pose (`x`, `q`), which must satisfy the constraints (as `x =
    /// self.forward(q)` does): ∂f/∂q of each arm over 2 La Lb, and det ∂f/∂X over 8 Lb³.
    ///
    /// ```
    /// use delta_cal::SymmetricRobot;
    /// # fn main() -> Result<(), Box<dyn core::error::Error>> {
    /// let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }
    ///     .robot()?;
    /// let q = [0.1, 0.2, 0.3];
    /// assert!(robot.singularity_distance(&robot.forward(&q)?, &q).is_clear());
    /// # Ok(())
    /// # }
    /// ```
    pub fn singularity_distance(&self, x: &Vector3<T>, q: &[T; 3]) -> SingularityDistance<T> {
        let mut forearms = [Vector3::zeros(); 3];
        let mut serial = [T::ZERO; 3];
        let poses = self.arms().iter().zip(q);
        for ((arm, q), (forearm, serial)) in poses.zip(forearms.iter_mut().zip(&mut serial)) {
            let at = arm.at(*q);
            *forearm = (x - at.elbow) / arm.lb();
            let tangent = at.derivative / arm.elbow_speed();
            *serial = forearm.dot(&tangent).magnitude();
        }
        let [w1, w2, w3] = forearms;
        SingularityDistance {
            serial,
            parallel: w1.dot(&w2.cross(&w3)).magnitude(),
        }
    }
}
