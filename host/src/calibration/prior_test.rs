//! Whether a robot is as far from nominal as its stated tolerance allows: χ² of all parameters at once.
//!
//! In tolerances, the robot's difference δ from nominal has the covariance I, and the samples measure
//! it with the information A = W⁻¹ (Σ JᵀJ) W⁻¹, W being 1/tolerance and J the weighted Jacobian of the
//! positions. Along the eigenvectors of A, with eigenvalues Λ, what the samples say of δ has the variance
//! 1 + 1/Λ. The sum of squares over this variance, over all eigenvectors, is the smallest cost that
//! samples and tolerance have together, less that of the samples alone. Here it is summed over those
//! combinations only that the samples determine clearly better than the tolerance does: the others
//! say nothing of the tolerance.

use crate::accuracy::evaluation::differences;
use crate::accuracy::information::{position_rows, tolerance_weights};
use crate::fit::fkm::weighted_residual;
use crate::fit::outcome::Outcome;
use crate::fit::weights::SampleWeight;
use crate::text::numbers::{probability, significant};
use delta_cal::{Noise, Parameter, Robot, Sample, Tolerance};
use nalgebra::{SMatrix, SVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// A stated tolerance is contradicted below this probability: 3 σ of a normal distribution.
const IMPROBABLE: f64 = 0.0027;
/// Λ from which on a combination counts: the samples' σ is half of the tolerance.
const DETERMINED: f64 = 4.0;
/// All parameters.
const ALL: u32 = 24;

/// What a calibrated robot says of its stated tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PriorTest {
    /// How many tolerances the parameters are off, rms over the combinations that the samples
    /// determine: √(χ²/ν). 1 is expected.
    pub ratio: f64,
    /// ν: combinations that the samples determine at least twice as well as the tolerance does.
    pub combinations: u32,
    /// The probability of a ratio as large if the tolerance is as stated.
    pub probability: f64,
}

impl PriorTest {
    /// `noise` is the stated one, otherwise the estimated, with its degrees of freedom. `None` if the
    /// samples determine nothing better than the tolerance.
    pub(crate) fn of(
        nominal: &Robot<f64>,
        tolerance: &Tolerance<f64>,
        outcome: &Outcome,
        samples: &[Sample<f64>],
        weights: &[SampleWeight],
        stated: Option<&Noise<f64>>,
    ) -> Option<Self> {
        let estimated = || Noise::new(outcome.estimated_noise()?, 0.0).ok();
        let noise = stated.copied().or_else(estimated)?;
        let robot = &outcome.fit.robot;
        let tolerances = tolerance_weights(nominal, Some(tolerance)).map(|weight| 1.0 / weight);
        let found = differences(robot, nominal);
        let mut information = SMatrix::<f64, 24, 24>::zeros();
        let mut right = SVector::<f64, 24>::zeros();
        for (sample, weight) in samples.iter().zip(weights) {
            if weight.suspected {
                continue;
            }
            let (Some(rows), Some(residual)) = (
                position_rows(robot, sample, &noise),
                weighted_residual(robot, sample, &noise),
            ) else {
                continue;
            };
            // What the sample says of δ, linearised at the result.
            let said = residual + rows * found;
            information.gemm_tr(weight.weight, &rows, &rows, 1.0);
            right.gemv_tr(weight.weight, &rows, &said, 1.0);
        }
        let scaled = information.component_mul(&(tolerances * tolerances.transpose()));
        let eigen = scaled.symmetric_eigen();
        let along = eigen.eigenvectors.tr_mul(&right.component_mul(&tolerances));
        let (mut chi_square, mut combinations) = (0.0, 0);
        for (value, along) in eigen.eigenvalues.iter().zip(&along) {
            if *value > DETERMINED {
                chi_square += along * along / (value * (1.0 + value));
                combinations += 1;
            }
        }
        if combinations == 0 {
            return None;
        }
        let freedom = f64::from(combinations);
        let probability = if stated.is_some() {
            ChiSquared::new(freedom).ok()?.sf(chi_square)
        } else {
            let arms = outcome.fit.arms.iter();
            let spare = arms.map(|arm| arm.degrees_of_freedom).sum::<f64>();
            let distribution = FisherSnedecor::new(freedom, spare).ok()?;
            distribution.sf(chi_square / freedom)
        };
        Some(Self {
            ratio: (chi_square / freedom).sqrt(),
            combinations,
            probability,
        })
    }

    /// Whether the stated tolerance is contradicted: too small.
    pub fn contradicts(&self) -> bool {
        self.probability < IMPROBABLE
    }

    /// Whether the samples determine all parameters better than the tolerance does.
    pub fn samples_decide(&self) -> bool {
        self.combinations == ALL
    }

    /// The tolerance that agrees with the robot.
    pub(crate) fn widened(&self, tolerance: &Tolerance<f64>) -> Option<Tolerance<f64>> {
        let [length, angle] =
            [Parameter::Lb, Parameter::Theta].map(|parameter| self.ratio * tolerance.of(parameter));
        Tolerance::new(length, angle).ok()
    }

    /// What was found, in words.
    pub(crate) fn found(&self) -> String {
        let chance = if self.probability < 1e-4 {
            "with less than 1 of 10 000 robots".to_owned()
        } else {
            format!("with {} of all robots", probability(self.probability))
        };
        format!(
            "the robot is {:.1} times as far from nominal as the stated [tolerance] allows (rms over \
             {} of 24 combinations of parameters; by chance that happens {chance})",
            self.ratio, self.combinations
        )
    }

    /// What to write into the robot file.
    pub(crate) fn statement(&self, tolerance: Option<&Tolerance<f64>>) -> String {
        let widened = tolerance.and_then(|tolerance| self.widened(tolerance));
        widened.map_or_else(
            || "state a larger [tolerance]".to_owned(),
            |tolerance| {
                format!(
                    "state a [tolerance] of length_mm = {} and angle_deg = {}",
                    significant(tolerance.of(Parameter::Lb), 2),
                    significant(tolerance.of(Parameter::Theta).to_degrees(), 2)
                )
            },
        )
    }
}
