//! The two rods of each arm, and the platform that tilts where they are no parallelogram.
//!
//! ```text
//! a± = B(q) + p ± s/2 (t + ψ r + ρ z)        joints at the elbow
//! b± = X + R (p ± (s + δs)/2 t)              joints at the platform
//! |b± − a±| = Lb ± δl/2
//! ```
//!
//! r is the radial direction of an arm, z up and t = z × r; p = Rb r is the platform's offset, which D has subtracted, s the
//! spacing of the rods. Six distances determine the platform's position X and rotation R. To first order the rotation
//! vector ω and the displacement δX of the platform point are those of two systems of three equations, with u the forearm's
//! direction:
//!
//! ```text
//! s (t × u) · ω = δl − δs (u · t) + s u · (ψ r + ρ z),        u · δX = −u · (ω × p)
//! ```

use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::KinematicsError;
use delta_cal::robot::Drive;
use delta_cal::{ArmIndex, Parameter, Real, Robot};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, SMatrix, UnitQuaternion, Vector3};

/// Numbers of an arm: δl and δs in mm, ψ and ρ in radians.
pub const OF_ARM: usize = 4;
/// Numbers of a robot.
pub const NUMBERS: usize = 3 * OF_ARM;
/// Below this |det| of the three (t × u), nothing holds the platform's rotation; 1 would be three perpendicular ones.
const UNHELD: f64 = 0.02;
/// Newton's steps; two are usual.
const STEPS: usize = 12;
/// A step is the last if it moves joints by less than this fraction of a forearm.
const SETTLED: f64 = 1e-14;

/// The rods of the three arms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parallelograms {
    /// Distance s between the two rods of an arm, mm.
    pub spacing: f64,
    /// Radius Rb of the platform, mm.
    pub platform_radius: f64,
    /// Of each arm, by how much the rods differ (δl) and by how much they are further apart at the platform (δs), mm; yaw ψ
    /// and roll ρ of the elbow's axis against the platform's, radians. The rod on the side of +t is the longer one.
    pub numbers: [[f64; OF_ARM]; 3],
    /// σ of the lengths, mm, and of the angles, radians.
    pub tolerance: [f64; 2],
}

/// Position and rotation of a platform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlatformPose {
    /// The platform point, mm.
    pub position: Vector3<f64>,
    /// The rotation vector, radians.
    pub tilt: Vector3<f64>,
}

impl PlatformPose {
    /// A platform that does not tilt.
    pub(crate) fn level(position: Vector3<f64>) -> Self {
        Self {
            position,
            tilt: Vector3::zeros(),
        }
    }

    /// The position of a point of the platform, mm.
    pub fn of(&self, point: &Vector3<f64>) -> Vector3<f64> {
        if self.tilt == Vector3::zeros() {
            return self.position + point;
        }
        self.position + UnitQuaternion::new(self.tilt) * point
    }
}

/// From the robot's axes to those of a frame.
pub(crate) fn rotation(frame: &RigidTransform<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(frame.rotation))
}

impl Parallelograms {
    /// Rods of which nothing is stated: how far apart they usually are, mm, and by what they usually differ.
    pub(crate) const USUAL: Self = Self {
        spacing: 50.0,
        platform_radius: 0.0,
        numbers: [[0.0; OF_ARM]; 3],
        tolerance: [0.1, 0.0],
    };

    /// Whether the platform tilts nowhere.
    pub(crate) fn are_exact(&self) -> bool {
        self.numbers == [[0.0; OF_ARM]; 3]
    }

    /// With these twelve numbers, arm by arm.
    pub(crate) fn with_numbers(mut self, numbers: &[f64]) -> Self {
        for (own, number) in self.numbers.as_flattened_mut().iter_mut().zip(numbers) {
            *own = *number;
        }
        self
    }

    /// σ of the twelve numbers.
    pub(crate) fn sigmas(&self) -> [f64; NUMBERS] {
        let [length, angle] = self.tolerance;
        std::array::from_fn(|place| if place % OF_ARM < 2 { length } else { angle })
    }

    /// The platform of a robot, by Newton's method from where Model 24 has it.
    ///
    /// # Errors
    /// The robot does not reach these joints (radians or mm); [`KinematicsError::Parallel`] also where nothing holds the
    /// platform's rotation.
    pub fn pose(
        &self,
        robot: &Robot<f64>,
        joints: &[f64; 3],
    ) -> Result<PlatformPose, KinematicsError> {
        let start = robot.forward(joints)?;
        if self.are_exact() {
            return Ok(PlatformPose::level(start));
        }
        let unheld = KinematicsError::Parallel(ArmIndex::First);
        let first = At::of(self, robot, &start, joints).ok_or(unheld)?;
        let [arm, ..] = robot.arms();
        let (mut position, mut rotation) = (start, UnitQuaternion::identity());
        for _ in 0..STEPS {
            let mut rows = DMatrix::zeros(6, 6);
            let mut off = DVector::zeros(6);
            for (index, (own, numbers)) in first.arms.iter().zip(&self.numbers).enumerate() {
                let [rods, spacing, yaw, roll] = *numbers;
                for (row, side) in [(2 * index, 0.5), (2 * index + 1, -0.5)] {
                    let axis = own.across + own.radial * yaw + Vector3::z() * roll;
                    let from = own.elbow + own.offset + axis * (side * self.spacing);
                    let lever = own.offset + own.across * (side * (self.spacing + spacing));
                    let lever = rotation * lever;
                    let rod = position + lever - from;
                    let length = rod.norm();
                    let along = rod / length;
                    let turned = lever.cross(&along);
                    rows.fixed_view_mut::<1, 3>(row, 0)
                        .copy_from(&along.transpose());
                    rows.fixed_view_mut::<1, 3>(row, 3)
                        .copy_from(&turned.transpose());
                    off[row] = robot.arms()[index].lb() + side * rods - length;
                }
            }
            let step = rows.try_inverse().ok_or(unheld)? * off;
            let turn = Vector3::new(step[3], step[4], step[5]);
            position += step.fixed_rows::<3>(0);
            rotation = UnitQuaternion::new(turn) * rotation;
            let size = step.fixed_rows::<3>(0).norm() + turn.norm() * self.spacing;
            if size < SETTLED * arm.lb() {
                break;
            }
        }
        let tilt = rotation.scaled_axis();
        if position.iter().chain(&tilt).all(|own| own.is_finite()) {
            Ok(PlatformPose { position, tilt })
        } else {
            Err(unheld)
        }
    }

    /// To first order, the displacement of a point of the platform by each of the twelve numbers, at a pose of Model 24: mm
    /// per mm or radian. `None` if nothing holds the platform's rotation.
    pub fn columns(
        &self,
        robot: &Robot<f64>,
        (position, joints): (&Vector3<f64>, &[f64; 3]),
        point: &Vector3<f64>,
    ) -> Option<SMatrix<f64, 3, NUMBERS>> {
        let at = At::of(self, robot, position, joints)?;
        let forearms = Matrix3::from_rows(&at.arms.each_ref().map(|own| own.along.transpose()));
        let forearms = forearms.try_inverse()?;
        let mut columns = SMatrix::<f64, 3, NUMBERS>::zeros();
        for (number, turn) in at.turns(self.spacing).column_iter().enumerate() {
            let shift = at.arms.each_ref();
            let shift = shift.map(|own| -own.along.dot(&turn.cross(&own.offset)));
            columns.set_column(
                number,
                &(forearms * Vector3::from(shift) + turn.cross(point)),
            );
        }
        Some(columns)
    }

    /// To first order, the rotation vector of the platform by each of the twelve numbers: radians per mm or radian. `None`
    /// if nothing holds the platform's rotation.
    pub(crate) fn turns(
        &self,
        robot: &Robot<f64>,
        (position, joints): (&Vector3<f64>, &[f64; 3]),
    ) -> Option<SMatrix<f64, 3, NUMBERS>> {
        Some(At::of(self, robot, position, joints)?.turns(self.spacing))
    }
}

/// An arm at a pose of Model 24.
struct ArmAt {
    /// B(q).
    elbow: Vector3<f64>,
    /// u, from the elbow to the platform.
    along: Vector3<f64>,
    /// r and t.
    radial: Vector3<f64>,
    across: Vector3<f64>,
    /// p.
    offset: Vector3<f64>,
}

/// The arms at a pose, and the rotation of the platform by each arm's right-hand side.
struct At {
    arms: [ArmAt; 3],
    by_arms: Matrix3<f64>,
}

impl At {
    fn of(
        own: &Parallelograms,
        robot: &Robot<f64>,
        position: &Vector3<f64>,
        joints: &[f64; 3],
    ) -> Option<Self> {
        let arms = [0, 1, 2].map(|index| {
            let arm = &robot.arms()[index];
            let elbow = arm.elbow(joints[index]);
            let azimuth = match arm.drive() {
                Drive::Rotary => arm.get(Parameter::Theta),
                Drive::Linear => arm.d().y.angle_over(arm.d().x),
            };
            let (sine, cosine) = azimuth.sine_cosine();
            let radial = Vector3::new(cosine, sine, 0.0);
            ArmAt {
                elbow,
                along: (position - elbow).normalize(),
                radial,
                across: Vector3::new(-sine, cosine, 0.0),
                offset: radial * own.platform_radius,
            }
        });
        let rows = arms
            .each_ref()
            .map(|own| own.across.cross(&own.along).transpose());
        let rows = Matrix3::from_rows(&rows);
        if !(rows.determinant().abs() > UNHELD) {
            return None;
        }
        let by_arms = (rows * own.spacing).try_inverse()?;
        Some(Self { arms, by_arms })
    }

    /// The rotation of the platform by each of the twelve numbers.
    fn turns(&self, spacing: f64) -> SMatrix<f64, 3, NUMBERS> {
        SMatrix::from_fn(|axis, number| {
            let (arm, along) = (number / OF_ARM, self.arms[number / OF_ARM].along);
            let by = match number % OF_ARM {
                0 => 1.0,
                1 => -along.dot(&self.arms[arm].across),
                2 => spacing * along.dot(&self.arms[arm].radial),
                _ => spacing * along.z,
            };
            self.by_arms[(axis, arm)] * by
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Parallelograms;
    use delta_cal::kinematics::KinematicsError;
    use delta_cal::{ArmIndex, SymmetricRobot};

    /// The integration tests `tilt` compare poses and derivatives with those of another solver.
    #[test]
    fn vertical_forearms_hold_no_rotation() {
        let own = SymmetricRobot {
            base_radius: 30.0,
            platform_radius: 230.0,
            upper_arm: 200.0,
            forearm: 480.0,
        };
        let rods = Parallelograms {
            spacing: 60.0,
            platform_radius: 30.0,
            numbers: [[0.1, -0.07, 0.002, 0.001]; 3],
            tolerance: [0.1, 0.002],
        };
        let unheld = Err(KinematicsError::Parallel(ArmIndex::First));
        assert_eq!(rods.pose(&own.robot().unwrap(), &[0.0; 3]), unheld);
    }
}
