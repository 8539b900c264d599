//! Whether a robot is as far from nominal as its stated tolerance allows: χ² of all parameters at once.
//!
//! In tolerances, the robot's difference δ from nominal has the covariance I, and the samples measure
//! it with the information A = U⁻ᵀ (Σ JᵀJ) U⁻¹, U being 1/tolerance and J the weighted Jacobian of the
//! positions. Along the eigenvectors of A, with eigenvalues Λ, what the samples say of δ has the variance
//! 1 + 1/Λ. The sum of squares over this variance, over all eigenvectors, is the smallest cost that
//! samples and tolerance have together, less that of the samples alone. Here it is summed over those
//! combinations only that the samples determine clearly better than the tolerance does: the others
//! say nothing of the tolerance. With the sensor's frame to be found, what its six unknowns explain as well is left out of A.

use super::causes::frame_movements;
use crate::accuracy::evaluation::differences;
use crate::accuracy::information::{position_rows, rows_of_prior, tolerance_prior};
use crate::fit::fkm::{weighted_residual, whitening};
use crate::fit::options::Frame;
use crate::fit::outcome::Outcome;
use crate::fit::weights::SampleWeight;
use crate::text::numbers::{probability, significant};
use delta_cal::robot::Drive;
use delta_cal::{Noise, Parameter, Robot, Sample, Tolerance};
use nalgebra::{SMatrix, SVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// A stated tolerance is contradicted below this probability: 3 σ of a normal distribution.
const IMPROBABLE: f64 = 0.0027;
/// Λ from which on a combination counts: the samples' σ is half of the tolerance.
const DETERMINED: f64 = 4.0;
/// Unknowns of the sensor's frame.
const FRAME: u32 = 6;

/// What a calibrated robot says of its stated tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PriorTest {
    /// How many tolerances the parameters are off, rms over the combinations that the samples
    /// determine: √(χ²/ν). 1 is expected.
    pub ratio: f64,
    /// ν: combinations that the samples determine at least twice as well as the tolerance does.
    pub combinations: u32,
    /// How many there are: the parameters, less those that move the robot as a whole if the sensor's frame is to be found.
    pub of: u32,
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
        frame: Frame,
    ) -> Option<Self> {
        let estimated = || Noise::new(outcome.estimated_noise()?, 0.0).ok();
        let noise = stated.copied().or_else(estimated)?;
        let robot = &outcome.fit.robot;
        let rows = rows_of_prior(&tolerance_prior(nominal, Some(tolerance)));
        let tolerances = rows.solve_upper_triangular(&SMatrix::identity())?;
        let found = differences(robot, nominal);
        let mut information = SMatrix::<f64, 24, 24>::zeros();
        let mut right = SVector::<f64, 24>::zeros();
        // The same of the frame's unknowns, and both together.
        let mut of_frame = SMatrix::<f64, 6, 6>::zeros();
        let mut mixed = SMatrix::<f64, 24, 6>::zeros();
        let mut right_of_frame = SVector::<f64, 6>::zeros();
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
            if frame == Frame::Sensor {
                let moves = frame_movements(&sample.position);
                let moves = whitening(robot, sample, &noise) * SMatrix::from_columns(&moves);
                of_frame.gemm_tr(weight.weight, &moves, &moves, 1.0);
                mixed.gemm_tr(weight.weight, &rows, &moves, 1.0);
                right_of_frame.gemv_tr(weight.weight, &moves, &said, 1.0);
            }
        }
        let parameters = outcome.fit.robot.drive().parameters();
        let mut of = parameters.iter().fold(0, |count, _| count + 3);
        if frame == Frame::Sensor {
            let explained = of_frame.cholesky()?;
            information -= mixed * explained.solve(&mixed.transpose());
            right -= mixed * explained.solve(&right_of_frame);
            of -= FRAME;
        }
        let scaled: SMatrix<f64, 24, 24> = tolerances.transpose() * information * tolerances;
        let eigen = scaled.symmetric_eigen();
        let along = eigen.eigenvectors.tr_mul(&tolerances.tr_mul(&right));
        let (mut chi_square, mut combinations) = (0.0, 0);
        let mut pairs: Vec<_> = eigen.eigenvalues.iter().zip(&along).collect();
        pairs.sort_by(|a, b| b.0.total_cmp(a.0));
        // Without a noise the information is so large that its rounding would count where there is none.
        let largest = pairs.into_iter().take(usize::try_from(of).unwrap_or(0));
        for (value, along) in largest.filter(|(value, _)| **value > DETERMINED) {
            chi_square += along * along / (value * (1.0 + value));
            combinations += 1;
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
            of,
            probability,
        })
    }

    /// Whether the stated tolerance is contradicted: too small.
    pub fn contradicts(&self) -> bool {
        self.probability < IMPROBABLE
    }

    /// Whether the samples determine all parameters better than the tolerance does.
    pub fn samples_decide(&self) -> bool {
        self.combinations >= self.of
    }

    /// The tolerance that agrees with the robot.
    pub(crate) fn widened(&self, tolerance: &Tolerance<f64>) -> Option<Tolerance<f64>> {
        let of = |parameter| self.ratio * tolerance.of(parameter);
        Tolerance::new(of(Parameter::Lb), of(Parameter::Theta))
            .and_then(|own| own.with_linear(of(Parameter::Zero), of(Parameter::Scale)))
            .and_then(|own| own.with_radius(self.ratio * tolerance.radius()))
            .ok()
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
             {} of {} combinations of parameters; by chance that happens {chance})",
            self.ratio, self.combinations, self.of
        )
    }

    /// What to write into the robot file.
    pub(crate) fn statement(&self, drive: Drive, tolerance: Option<&Tolerance<f64>>) -> String {
        let widened = tolerance.and_then(|tolerance| self.widened(tolerance));
        widened.map_or_else(
            || "state a larger [tolerance]".to_owned(),
            |tolerance| {
                let own = |value: f64| significant(value, 2);
                let length = own(tolerance.of(Parameter::Lb));
                let angle = own(tolerance.of(Parameter::Theta).to_degrees());
                match drive {
                    Drive::Rotary => format!(
                        "state a [tolerance] of length_mm = {length} and angle_deg = {angle}"
                    ),
                    Drive::Linear => format!(
                        "state a [tolerance] of length_mm = {length}, angle_deg = {angle}, zero_mm = {}{} and scale \
                         = {}",
                        own(tolerance.of(Parameter::Zero)),
                        match tolerance.radius() {
                            radius if radius > 0.0 => format!(", radius_mm = {}", own(radius)),
                            _ => String::new(),
                        },
                        own(tolerance.of(Parameter::Scale))
                    ),
                }
            },
        )
    }
}
