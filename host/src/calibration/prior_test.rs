//! Whether a robot is as far from nominal as its stated tolerance allows: χ² of all parameters at once.
//!
//! In tolerances the robot's difference δ from nominal has the covariance I, and the estimate m of it the covariance C.
//! Along the eigenvectors of C, with eigenvalues c, the samples alone say d = m/(1 − c) with the variance Λ⁻¹ = c/(1 − c), so
//! that d has the variance 1 + 1/Λ. The sum of squares over this variance, over all eigenvectors, is the smallest cost that
//! samples and tolerance have together, less that of the samples alone. Here it is summed over those combinations only
//! that the samples determine clearly better than the tolerance does: the others say nothing of the tolerance.

use crate::accuracy::chi_square::quantile;
use crate::accuracy::information::{is_empty, prior_covariance};
use crate::fit::Solution;
use crate::fit::covariance::PARAMETERS;
use crate::text::numbers::significant;
use delta_cal::robot::Drive;
use delta_cal::{Parameter, Robot, Tolerance};
use nalgebra::{DMatrix, DVector, SMatrix};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A stated tolerance is contradicted below this probability: 3 σ of a normal distribution.
const IMPROBABLE: f64 = 0.0027;
/// Λ from which on a combination counts: the samples' σ is half of the tolerance.
const DETERMINED: f64 = 4.0;
/// Combinations that move the robot as a whole.
const MOTIONS: u32 = 6;
/// An estimated noise may be larger than it seems: with this probability it is not.
const SURE: f64 = 0.025;
/// Less is rounding.
const LEAST: f64 = 1e-12;

/// What a calibrated robot says of its stated tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PriorTest {
    /// How many tolerances the parameters are off, rms over the combinations that the samples
    /// determine: √(χ²/ν). 1 is expected.
    pub ratio: f64,
    /// ν: combinations that the samples determine at least twice as well as the tolerance does.
    pub combinations: u32,
    /// How many there are: the parameters, less those that move the robot as a whole if no reading tells its place.
    pub of: u32,
    /// The probability of a ratio as large if the tolerance is as stated.
    pub probability: f64,
}

impl PriorTest {
    /// `None` if the samples determine nothing better than the tolerance.
    pub(crate) fn of(
        nominal: &Robot<f64>,
        tolerance: &Tolerance<f64>,
        solution: &Solution,
    ) -> Option<Self> {
        let drive = nominal.drive();
        let used: Vec<usize> = (0..PARAMETERS)
            .filter(|place| !is_empty(nominal, *place))
            .collect();
        let all = prior_covariance(nominal, tolerance);
        let pick = |matrix: &SMatrix<f64, PARAMETERS, PARAMETERS>| {
            DMatrix::from_fn(used.len(), used.len(), |row, column| {
                matrix[(used[row], used[column])]
            })
        };
        let root = pick(&all).cholesky()?.l();
        let inverse = root.clone().try_inverse()?;
        let scaled = &inverse * pick(&solution.of_parameters()) * inverse.transpose();
        let moved = DVector::from_fn(used.len(), |row, _| solution.moved[used[row]]);
        let eigen = scaled.symmetric_eigen();
        let along = eigen.eigenvectors.tr_mul(&(&inverse * moved));
        let mut of = drive.parameters().iter().fold(0, |count, _| count + 3);
        if !solution.is_absolute() {
            of -= MOTIONS;
        }
        // Of an estimated noise the upper limit.
        let larger = match solution.estimated_freedom() {
            Some(freedom) => freedom / quantile(freedom, SURE)?,
            None => 1.0,
        };
        let (mut chi_square, mut combinations) = (0.0, 0);
        let mut pairs: Vec<_> = eigen.eigenvalues.iter().zip(&along).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(b.0));
        for (part, along) in pairs.into_iter().take(usize::try_from(of).unwrap_or(0)) {
            // c = 1/(1 + Λ): what the samples leave of the prior's variance, and d = m/(1 − c) what they say.
            let part = part.max(LEAST);
            if 1.0 / part - 1.0 <= DETERMINED {
                break;
            }
            let said = along / (1.0 - part);
            let scatter = part / (1.0 - part);
            chi_square += said * said / (1.0 + larger * scatter);
            combinations += 1;
        }
        if combinations == 0 {
            return None;
        }
        let freedom = f64::from(combinations);
        Some(Self {
            ratio: (chi_square / freedom).sqrt(),
            combinations,
            of,
            probability: ChiSquared::new(freedom).ok()?.sf(chi_square),
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
            .and_then(|own| own.with_forearm(self.ratio * tolerance.forearm()))
            .ok()
    }

    /// What to write into the robot file.
    pub(crate) fn statement(&self, drive: Drive, tolerance: Option<&Tolerance<f64>>) -> String {
        let widened = tolerance.and_then(|tolerance| self.widened(tolerance));
        widened.map_or_else(
            || "a larger [tolerance]".to_owned(),
            |tolerance| {
                let own = |value: f64| significant(value, 2);
                let length = own(tolerance.of(Parameter::Lb));
                let angle = own(tolerance.of(Parameter::Theta).to_degrees());
                match drive {
                    Drive::Rotary => format!("length_mm = {length} and angle_deg = {angle}"),
                    Drive::Linear => format!(
                        "length_mm = {length}, angle_deg = {angle}, zero_mm = {}{} and scale = {}",
                        own(tolerance.of(Parameter::Zero)),
                        [
                            ("radius", tolerance.radius()),
                            ("forearm", tolerance.forearm())
                        ]
                        .into_iter()
                        .filter(|(_, sigma)| *sigma > 0.0)
                        .map(|(key, sigma)| format!(", {key}_mm = {}", own(sigma)))
                        .collect::<String>(),
                        own(tolerance.of(Parameter::Scale))
                    ),
                }
            },
        )
    }
}
