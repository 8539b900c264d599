//! The FKM calibration: all 24 parameters at once from the distances between measured and computed
//! positions.
//!
//! ```text
//! minimise  Σ |Lₖ⁻¹ (Xₖ − FK(P; qₖ))|²  +  Σ ((pⱼ − pⱼ,nominal)/toleranceⱼ)²
//! Lₖ Lₖᵀ = σx² I + σq² J_q J_qᵀ
//! ```
//!
//! Forward kinematics may not exist at a trial step: such a step is rejected and a shorter one tried.

mod linearization;
mod problem;

pub use crate::fit::outcome::Outcome;
pub use linearization::Linearization;
pub(crate) use problem::{residual_in_sigmas, whitening};

use crate::fit::joint;
use crate::fit::options::Frame;
use crate::fit::weights::Weights;
use delta_cal::calibration::{JointOutcome, Prior as _, Problem as _, Start, StartUsed};
use delta_cal::{Noise, Refusal, Robot, Sample, Settings, Tolerance};
use nalgebra::{SMatrix, Vector3};
use problem::{ALL, Problem};

/// Calibrates a robot, which is the nominal of the tolerance and the start of the iteration.
///
/// The solution of the joint calibration is a second start, taken if the first leads nowhere or to a worse
/// fit.
///
/// # Errors
/// Every [`Refusal`] that the joint calibration has.
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
    calibrate_weighted(robot, samples, None, settings, Frame::Base)
}

/// The same of samples that count as a robust fit or a stream has them.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_weighted(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    weights: Option<&Weights>,
    settings: &Settings<f64>,
    frame: Frame,
) -> Result<Outcome, Refusal> {
    let joint = joint::calibrate_weighted(robot, samples.into(), weights, settings, frame);
    if let Err(
        refusal @ (Refusal::TooFewSamples { .. } | Refusal::WrongSide | Refusal::NonFinite { .. }),
    ) = joint
    {
        return Err(refusal);
    }
    let weights_at = match (settings.start, &joint) {
        (Start::Nominal, _) => *robot,
        (Start::Free, Ok(solution)) => solution.fit.robot,
        (Start::Free, Err(refusal)) => return Err(*refusal),
    };
    // The robot need not reach a sample that does not count.
    let (samples, factors): (Vec<_>, Vec<_>) = match weights {
        None => (samples.to_vec(), Vec::new()),
        Some(weights) => samples
            .iter()
            .zip(weights.factors.iter().copied())
            .filter(|(_, factor)| *factor > 0.0)
            .unzip(),
    };
    let mut problem = Problem::new(robot, &weights_at, &samples, settings.noise.as_ref());
    if let Some(weights) = weights {
        problem = problem.weighted(&factors, weights.effective_samples);
    }
    if let Ok(solution) = &joint {
        problem = problem.started_from(&solution.fit.robot);
    }
    let mut estimate = joint::estimate(&problem, robot, settings, frame)?;
    if estimate.start == StartUsed::Free && settings.start == Start::Nominal {
        estimate.start = StartUsed::Joint;
    }
    let robot = problem.robot(&estimate.correction)?;
    Ok(Outcome::from(JointOutcome { robot, estimate }))
}

/// The inverse of the information that samples of a robot hold of its parameters: mm², angles times
/// the upper arm's length. `None` if they do not determine it.
pub(crate) fn covariance_at(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    noise: &Noise<f64>,
    tolerance: Option<&Tolerance<f64>>,
) -> Option<SMatrix<f64, 24, 24>> {
    let problem = Problem::new(robot, robot, samples, Some(noise));
    let prior = joint::tolerance_prior(&problem, robot, tolerance);
    let mut normal = prior.rows(1.0, &[0.0; ALL]);
    let sum = problem
        .linearize(&Some(*robot), &mut normal, 0)
        .sum_of_squares;
    let mut factor = SMatrix::<f64, ALL, ALL>::zeros();
    for (index, row) in normal.rows().take(ALL).enumerate() {
        for (column, entry) in (index..ALL).zip(row) {
            factor[(index, column)] = *entry;
        }
    }
    let mut inverse = factor.solve_upper_triangular(&SMatrix::<f64, ALL, ALL>::identity())?;
    for (parameter, mut row) in inverse.row_iter_mut().enumerate() {
        // Nothing is stated of a place that the arms leave empty.
        row *= if problem.unit_of(parameter) > 0.0 {
            problem.upper_arm(parameter)
        } else {
            0.0
        };
    }
    let covariance = inverse * inverse.transpose();
    (sum.is_finite() && covariance.iter().all(|entry| entry.is_finite())).then_some(covariance)
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

/// L⁻¹ (X − FK) of a sample, in σ of the position's noise. `None` where the robot does not reach the
/// joint angles.
pub(crate) fn weighted_residual(
    robot: &Robot<f64>,
    sample: &Sample<f64>,
    noise: &Noise<f64>,
) -> Option<Vector3<f64>> {
    let position = robot.forward(&sample.joints).ok()?;
    Some(problem::whitening(robot, sample, noise) * (sample.position - position))
}
