//! The FKM calibration: all 24 parameters at once from the distances between measured and computed
//! positions.
//!
//! ```text
//! minimise  Σ |Lₖ⁻¹ (Xₖ − FK(P; qₖ))|²  +  Σ ((pⱼ − pⱼ,nominal)/toleranceⱼ)²
//! Lₖ Lₖᵀ = σx² I + σq² J_q J_qᵀ
//! ```
//!
//! Forward kinematics may not exist at a trial step: such a step is rejected and a shorter one tried.

mod judgement;
mod linearization;
mod normal;
mod problem;
pub(crate) mod robust;
mod search;
mod solver;

pub use crate::fit::outcome::Outcome;
pub use linearization::Linearization;

use delta_cal::calibration::{Start, StartUsed};
use delta_cal::{
    ArmIndex, Calibrator, Noise, Refusal, Robot, RobotOutcome, Sample, Settings, Tolerance,
};
use nalgebra::SMatrix;
use normal::Vector24;
use problem::Problem;
use search::Search;

/// Calibrates a robot, which is the nominal of the tolerance and the start of the iteration.
///
/// The IKM method's solution is a second start, taken if the first leads nowhere or to a worse fit;
/// with fewer than twelve samples, which may have several solutions, also if it leads to one that is
/// nearer to the robot.
///
/// # Errors
/// Every [`Refusal`] that the IKM method has. A refusal that concerns the whole robot names the arm
/// that has the largest part in it.
///
/// ```
/// use delta_cal::{Sample, Settings, SymmetricRobot};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let truth = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..nominal }.robot()?;
/// let mut samples = Vec::new();
/// for k in 0..20 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     samples.push(Sample { joints, position: truth.forward(&joints)? });
/// }
/// let outcome = delta_cal_host::fit::fkm::calibrate(&nominal.robot()?, &samples, &Settings::default())?;
/// assert!((outcome.fit.robot.arms()[2].lb() - 479.1).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
pub fn calibrate(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
) -> Result<Outcome, Refusal> {
    let (count, needed) = (samples.len() as u64, settings.samples_needed());
    if count < needed {
        return Err(Refusal::TooFewSamples {
            arm: ArmIndex::First,
            samples: count,
            needed,
        });
    }
    let ikm = ikm_solution(robot, samples, settings);
    if let Err(refusal @ (Refusal::WrongSide | Refusal::NonFinite { .. })) = ikm {
        return Err(refusal);
    }
    let weights = match (settings.start, &ikm) {
        (Start::Nominal, _) => *robot,
        (Start::Free, Ok(solution)) => solution.robot,
        (Start::Free, Err(refusal)) => return Err(*refusal),
    };
    let problem = Problem::new(
        robot,
        &weights,
        samples,
        settings.noise.as_ref(),
        settings.tolerance.as_ref(),
    );
    let mut search = Search::new(&problem, settings);
    if settings.start == Start::Nominal {
        search.start(&Vector24::zeros(), StartUsed::Nominal);
    }
    if let Ok(solution) = &ikm {
        search.second_start(solution);
    }
    search.balance_tolerance();
    search.outcome(ikm.err())
}

/// How far each sample is off, in σ of the noise as it is where the robot stands, √(|L⁻¹ (X − FK)|²/3):
/// 1 is expected, less where few samples are left over. `None` where the robot does not reach the
/// joint angles.
pub(crate) fn residuals_in_sigmas(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    noise: &Noise<f64>,
) -> Vec<Option<f64>> {
    samples
        .iter()
        .map(|sample| problem::residual_in_sigmas(robot, sample, noise))
        .collect()
}

/// The inverse of the information that samples of a robot hold of its parameters: mm², angles times
/// the upper arm's length. `None` if they do not determine it.
pub(crate) fn covariance_at(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    noise: &Noise<f64>,
    tolerance: Option<&Tolerance<f64>>,
) -> Option<SMatrix<f64, 24, 24>> {
    let problem = Problem::new(robot, robot, samples, Some(noise), tolerance);
    problem
        .linearize(&Vector24::zeros(), &problem.tolerance_weights)?
        .covariance()
}

/// L⁻¹ ∂X/∂P of one pose of a robot: rows in σ of the position's noise, columns per mm and radian.
/// `None` where the pose is singular or out of reach.
pub(crate) fn weighted_jacobian(
    robot: &Robot<f64>,
    pose: &Sample<f64>,
    noise: &Noise<f64>,
) -> Option<SMatrix<f64, 3, 24>> {
    let at = Linearization::new(robot, &pose.joints).ok()?;
    Some(problem::whitening(robot, pose, noise) * at.jacobian())
}

fn ikm_solution(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
) -> Result<RobotOutcome<f64>, Refusal> {
    let mut calibrator = Calibrator::new(robot, settings);
    let overflow = |_| Refusal::NonFinite {
        arm: ArmIndex::First,
    };
    calibrator.add_many(samples).map_err(overflow)?;
    calibrator.solve()
}
