//! The FKM calibration: all 24 parameters at once from the distances between measured and computed
//! positions.
//!
//! ```text
//! minimise  Σ |Lₖ⁻¹ (Xₖ − FK(P; qₖ))|²  +  Σ ((pⱼ − pⱼ,nominal)/toleranceⱼ)²
//! Lₖ Lₖᵀ = σx² I + σq² J_q J_qᵀ
//! ```

use delta_cal::{Refusal, Robot, RobotOutcome, Sample, Settings};
use nalgebra::SMatrix;

/// A robot calibrated by the FKM method.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The robot and each arm's share of the result.
    pub robot: RobotOutcome<f64>,
    /// Covariance of all 24 parameters, arm by arm: the arms' covariances are its diagonal blocks.
    /// `None` where theirs are.
    pub covariance: Option<SMatrix<f64, 24, 24>>,
}

/// Calibrates a robot, which is the nominal of the tolerance and the start of the iteration.
///
/// # Errors
/// Every [`Refusal`] that the IKM method has.
pub fn calibrate(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
) -> Result<Outcome, Refusal> {
    let _ = (robot, samples, settings);
    Err(Refusal::Unfinished)
}
