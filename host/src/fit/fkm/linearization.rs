//! How the platform point moves with the parameters at one pose, in the factors of Jacobian (3.18).

use delta_cal::kinematics::KinematicsError;
use delta_cal::{Robot, Sample};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// ∂X/∂P = −(∂f/∂X)⁻¹ ∂f/∂P, (3.18) with the sign that differentiating (3.14) gives. The arms are
/// coupled by the 3 × 3 factor alone: each arm's block is one of its columns times one row of eight.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearization {
    /// FK(P; q), mm.
    pub position: Vector3<f64>,
    /// −(∂f/∂X)⁻¹: how the point moves with each arm's constraint. 1/mm.
    pub by_constraints: Matrix3<f64>,
    /// ∂f/∂Pᵢ of each arm, in the order of [`Parameter::ROTARY`](delta_cal::Parameter::ROTARY): mm, or
    /// mm² per radian.
    pub constraints_by_parameters: [SVector<f64, 8>; 3],
}

impl Linearization {
    /// At the robot's own position for these joint angles (radians).
    ///
    /// # Errors
    /// No position, or a singular one.
    pub fn new(robot: &Robot<f64>, joints: &[f64; 3]) -> Result<Self, KinematicsError> {
        let position = robot.forward(joints)?;
        let inverse = by_constraints(
            robot,
            &Sample {
                joints: *joints,
                position,
            },
        );
        let [first, second, third] = robot.arms();
        let [q1, q2, q3] = *joints;
        Ok(Self {
            position,
            // Forward kinematics has refused a singular pose.
            by_constraints: inverse.unwrap_or_else(Matrix3::zeros),
            constraints_by_parameters: [
                first.constraint_by_parameters(&position, q1),
                second.constraint_by_parameters(&position, q2),
                third.constraint_by_parameters(&position, q3),
            ],
        })
    }

    /// The whole of (3.18): three rows, the arms side by side.
    pub fn jacobian(&self) -> SMatrix<f64, 3, 24> {
        let mut jacobian = SMatrix::<f64, 3, 24>::zeros();
        for (arm, by_parameters) in self.constraints_by_parameters.iter().enumerate() {
            jacobian
                .fixed_columns_mut::<8>(8 * arm)
                .copy_from(&(self.by_constraints.column(arm) * by_parameters.transpose()));
        }
        jacobian
    }
}

/// −(∂f/∂X)⁻¹ at a pose that need not satisfy the constraints; `None` where that is singular.
pub(super) fn by_constraints(robot: &Robot<f64>, pose: &Sample<f64>) -> Option<Matrix3<f64>> {
    let [first, second, third] = robot.arms();
    let [q1, q2, q3] = pose.joints;
    let inverse = Matrix3::from_columns(&[
        first.constraint_by_position(&pose.position, q1),
        second.constraint_by_position(&pose.position, q2),
        third.constraint_by_position(&pose.position, q3),
    ])
    .transpose()
    .try_inverse()?;
    inverse
        .iter()
        .all(|entry| entry.is_finite())
        .then_some(-inverse)
}
