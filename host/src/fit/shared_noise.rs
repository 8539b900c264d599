//! The covariance between the arms of an IKM calibration.

use crate::fit::outcome::Outcome;
use crate::fit::weights::Fit;
use delta_cal::calibration::ArmOutcome;
use delta_cal::robot::Arm;
use delta_cal::{ArmIndex, Noise, Sample};
use nalgebra::{SMatrix, SVector, Vector3};

/// One arm's share in a sample.
struct Row {
    /// (∂f/∂P)/σf.
    gradient: SVector<f64, 8>,
    /// How its residual moves with the position's noise, in σ.
    by_position: Vector3<f64>,
}

/// Completes the covariance of a fit that treats the arms' closure errors as independent, as the IKM
/// method does. They share the noise of the position, so the errors of the arms' parameters are
/// correlated:
///
/// ```text
/// Cᵢⱼ = Cᵢ (Σ wₖ gᵢₖ ρᵢⱼₖ gⱼₖᵀ) Cⱼ,   gᵢ = (∂fᵢ/∂Pᵢ)/σfᵢ,   ρᵢⱼ = σx² (∂fᵢ/∂X)ᵀ(∂fⱼ/∂X)/(σfᵢ σfⱼ)
/// ```
///
/// with wₖ the sample's weight. The arms' own covariances stay as they are.
///
/// `samples`: those of the fit that are in memory; `stand_for`: how many each of them stands for.
pub(crate) fn complete(
    fit: &mut Fit,
    (samples, stand_for): (&[Sample<f64>], f64),
    noise: Option<&Noise<f64>>,
) {
    let mut between = [SMatrix::<f64, 8, 8>::zeros(); 3];
    let arms = fit.outcome.fit.robot.arms();
    for (sample, weight) in samples.iter().zip(&fit.samples) {
        if weight.suspected {
            continue;
        }
        let rows = ArmIndex::ALL.map(|index| {
            let i = index.index();
            row(&arms[i], sample, i, noise)
        });
        for (sum, (i, j)) in between.iter_mut().zip(PAIRS) {
            let shared = stand_for * weight.weight * rows[i].by_position.dot(&rows[j].by_position);
            *sum += rows[i].gradient * rows[j].gradient.transpose() * shared;
        }
    }
    let Outcome {
        fit: robot,
        covariance,
    } = &mut fit.outcome;
    let Some(all) = covariance else { return };
    // Without a stated noise an arm's covariance is that of its own residuals, per σ of which it is
    // divided here.
    let own = robot
        .arms
        .map(|arm| arm.covariance.zip(residual_sigma(&arm, noise)));
    for (sum, (i, j)) in between.iter().zip(PAIRS) {
        if let (Some((ci, si)), Some((cj, sj))) = (own[i], own[j]) {
            let block = ci * sum * cj / (si * sj);
            all.fixed_view_mut::<8, 8>(8 * i, 8 * j).copy_from(&block);
            all.fixed_view_mut::<8, 8>(8 * j, 8 * i)
                .copy_from(&block.transpose());
        }
    }
}

const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

fn row(arm: &Arm<f64>, sample: &Sample<f64>, index: usize, noise: Option<&Noise<f64>>) -> Row {
    let (x, q) = (&sample.position, sample.joints[index]);
    let by_position = arm.constraint_by_position(x, q);
    let (sigma, position) = match noise {
        Some(noise) => {
            let joint = arm.constraint_by_joint(x, q) * noise.joint();
            let position = noise.position();
            ((by_position.norm() * position).hypot(joint), position)
        }
        None => (by_position.norm(), 1.0),
    };
    Row {
        gradient: arm.constraint_by_parameters(x, q) / sigma,
        by_position: by_position * (position / sigma),
    }
}

/// σ of the residuals in the unit of the rows, as it is in the arm's covariance.
fn residual_sigma(arm: &ArmOutcome<f64>, noise: Option<&Noise<f64>>) -> Option<f64> {
    if noise.is_some() {
        return Some(1.0);
    }
    let freedom = arm.degrees_of_freedom;
    let spare = freedom - delta_cal::calibration::limits::LEAST_FREEDOM;
    let sigma = arm.estimated_noise?;
    (spare > 0.0).then(|| sigma * (freedom / spare).sqrt())
}
