//! Whether an end point is a calibration: it is good, or refused with the cause. The limits are the
//! core's.

use super::Outcome;
use super::normal::{ALL, ARM, Matrix24, Normal, Vector24};
use super::problem::{ImpossibleRobot, Problem, as_number};
use super::solver::Point;
use delta_cal::calibration::limits::{
    CONDITION_OF_A_VALLEY, LARGEST_SIGMA, LARGEST_TOLERANCES, LEAST_FREEDOM, NOISE_MARGIN,
    chi_square_quantile,
};
use delta_cal::calibration::{ArmOutcome, StartUsed, Termination};
use delta_cal::robot::ParameterKind;
use delta_cal::{ArmIndex, Parameter, Refusal, RobotOutcome, Settings};
use nalgebra::{SMatrix, SVector};

/// The covariance of all parameters and how well each is determined.
pub(super) struct Identifiability {
    /// (JᵀJ)⁻¹; `None` if that is singular.
    pub(super) covariance: Option<Matrix24>,
    /// Each variance over what it would be if the other parameters were known.
    inflation: Vector24,
}

impl Identifiability {
    pub(super) fn of(normal: &Normal) -> Self {
        let covariance = normal.covariance();
        let norms = normal.column_norms();
        let inflation = match &covariance {
            Some(covariance) => covariance
                .diagonal()
                .component_mul(&norms.component_mul(&norms)),
            None => Vector24::from_iterator(
                normal
                    .factor
                    .diagonal()
                    .iter()
                    .zip(&norms)
                    .map(|(pivot, norm)| (norm / pivot).powi(2))
                    .map(|value| {
                        if value.is_finite() {
                            value
                        } else {
                            f64::INFINITY
                        }
                    }),
            ),
        };
        Self {
            covariance,
            inflation,
        }
    }

    /// ‖A‖‖A⁻¹‖/24 in Frobenius norms, A = J with columns of unit length, is the rms of this over
    /// the arms.
    fn condition(&self, arm: ArmIndex) -> f64 {
        let own = self.inflation.fixed_rows::<ARM>(ARM * arm.index());
        (own.sum() / 8.0).sqrt()
    }

    fn largest_condition(&self) -> f64 {
        ArmIndex::ALL
            .map(|arm| self.condition(arm))
            .into_iter()
            .fold(0.0, f64::max)
    }

    /// γ: how many of an arm's parameters the samples determine and not the prior.
    fn determined_parameters(&self, prior: &Vector24, arm: ArmIndex) -> f64 {
        8.0 - self.prior_share(prior, arm).sum()
    }

    /// How many of all parameters.
    pub(super) fn determined(&self, prior: &Vector24) -> f64 {
        ArmIndex::ALL
            .map(|arm| self.determined_parameters(prior, arm))
            .into_iter()
            .sum()
    }

    fn prior_share(&self, prior: &Vector24, arm: ArmIndex) -> SVector<f64, ARM> {
        let first = ARM * arm.index();
        SVector::from_fn(|parameter, _| {
            let index = first + parameter;
            let variance = self
                .covariance
                .map_or(0.0, |covariance| covariance[(index, index)]);
            (prior[index].powi(2) * variance).clamp(0.0, 1.0)
        })
    }

    /// The refusal of poses that leave a combination of parameters free, or nearly so.
    fn undetermined(&self) -> Refusal {
        let index = self.inflation.imax();
        let arm = ArmIndex::ALL[index / ARM];
        Refusal::Undetermined {
            arm,
            parameter: Parameter::ALL[index % ARM],
            condition: to_single(self.condition(arm)),
        }
    }
}

/// An end point, and what it is judged by.
pub(super) struct Judgement<'a> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) settings: &'a Settings<f64>,
    pub(super) point: &'a Point,
    /// 1/tolerance as weighed against the residuals.
    pub(super) prior: Vector24,
    pub(super) iterations: u16,
}

impl Judgement<'_> {
    pub(super) fn outcome(
        &self,
        termination: Termination,
        start: StartUsed,
    ) -> Result<Outcome, Refusal> {
        let identifiability = Identifiability::of(&self.point.normal);
        let Some(covariance) = identifiability.determined_covariance() else {
            return Err(identifiability.undetermined());
        };
        let stated = self.settings.noise.is_some();
        if stated {
            self.check_residual()?;
        }
        self.check_tolerances()?;

        let residuals = 3.0 * self.problem.effective_samples;
        let sum = self.point.sum_of_squares;
        let freedom = (residuals - identifiability.determined(&self.prior)).max(0.0);
        let variance = if stated {
            Some(1.0)
        } else {
            let spare = freedom - LEAST_FREEDOM;
            (spare > 1e-2).then(|| sum / spare)
        };
        let covariance = variance.map(|variance| self.to_units(&covariance, variance));
        if let Some(covariance) = &covariance {
            self.check_sigmas(covariance)?;
        }
        let robot = self
            .problem
            .robot(&self.point.correction)
            .map_err(refusal)?;
        let arm = |index: ArmIndex| {
            let first = ARM * index.index();
            let samples = self.problem.effective_samples;
            ArmOutcome {
                arm: *robot.arm(index),
                covariance: covariance.map(|all: Matrix24| -> SMatrix<f64, 8, 8> {
                    all.fixed_view::<ARM, ARM>(first, first).into_owned()
                }),
                residual_rms: (sum / residuals).sqrt(),
                estimated_noise: (!stated && freedom >= 0.5).then(|| (sum / freedom).sqrt()),
                degrees_of_freedom: (samples
                    - identifiability.determined_parameters(&self.prior, index))
                .max(0.0),
                samples: self.problem.samples.len() as u64,
                iterations: self.iterations,
                termination,
                start,
                condition: identifiability.condition(index),
                prior_share: identifiability.prior_share(&self.prior, index),
            }
        };
        Ok(Outcome {
            fit: RobotOutcome {
                robot,
                arms: ArmIndex::ALL.map(arm),
            },
            covariance,
        })
    }

    /// Why an iteration did not settle: along a flat valley it is the poses, or the stated noise,
    /// that leave it no firm minimum.
    pub(super) fn not_converged(&self) -> Refusal {
        let identifiability = Identifiability::of(&self.point.normal);
        if !(identifiability.largest_condition() < CONDITION_OF_A_VALLEY) {
            return identifiability.undetermined();
        }
        if self.settings.noise.is_some()
            && let Some(covariance) = &identifiability.covariance
            && let Err(uncertain) = self.check_sigmas(&self.to_units(covariance, 1.0))
        {
            return uncertain;
        }
        Refusal::NotConverged {
            arm: self.problem.worst_arm(&self.point.correction),
            iterations: self.iterations,
        }
    }

    /// χ² test of the whole cost: with a prior it has as many degrees of freedom as there are
    /// residuals, without one 24 fewer.
    fn check_residual(&self) -> Result<(), Refusal> {
        let residuals = 3.0 * self.problem.effective_samples;
        let freedom = if self.settings.tolerance.is_some() {
            residuals
        } else {
            residuals - as_number(ALL)
        }
        .max(1.0);
        let Point {
            cost,
            sum_of_squares,
            ..
        } = *self.point;
        if cost <= chi_square_quantile(freedom) * NOISE_MARGIN {
            return Ok(());
        }
        Err(if cost - sum_of_squares > sum_of_squares {
            self.far_from_nominal()
        } else {
            Refusal::ResidualContradictsNoise {
                arm: self.problem.worst_arm(&self.point.correction),
                ratio: to_single((sum_of_squares / freedom).sqrt()),
            }
        })
    }

    /// All corrections in tolerances; zeros without one.
    fn tolerances(&self) -> Vector24 {
        self.problem
            .tolerance_weights
            .component_mul(&self.point.correction)
            .abs()
    }

    fn check_tolerances(&self) -> Result<(), Refusal> {
        if self.tolerances().max() <= LARGEST_TOLERANCES {
            Ok(())
        } else {
            Err(self.far_from_nominal())
        }
    }

    fn far_from_nominal(&self) -> Refusal {
        let tolerances = self.tolerances();
        let index = tolerances.imax();
        Refusal::FarFromNominal {
            arm: ArmIndex::ALL[index / ARM],
            parameter: Parameter::ALL[index % ARM],
            tolerances: to_single(tolerances[index]),
        }
    }

    fn check_sigmas(&self, covariance: &Matrix24) -> Result<(), Refusal> {
        for arm in ArmIndex::ALL {
            let upper_arm = self.problem.reference.arm(arm).upper_arm_length();
            for parameter in Parameter::ALL {
                let unit = match parameter.kind() {
                    ParameterKind::Length => upper_arm,
                    ParameterKind::Angle => 1.0,
                };
                let index = ARM * arm.index() + parameter.index();
                let sigma = covariance[(index, index)].sqrt();
                if !(sigma <= LARGEST_SIGMA * unit) {
                    return Err(Refusal::Uncertain {
                        arm,
                        parameter,
                        sigma: to_single(sigma),
                    });
                }
            }
        }
        Ok(())
    }

    /// From corrections to parameters, times a variance.
    fn to_units(&self, covariance: &Matrix24, variance: f64) -> Matrix24 {
        let units = &self.problem.units;
        Matrix24::from_fn(|i, j| covariance[(i, j)] * (variance / (units[i] * units[j])))
    }
}

impl Identifiability {
    /// `None` beyond the condition at which no digit of the weakest combination survives the
    /// arithmetic.
    fn determined_covariance(&self) -> Option<Matrix24> {
        let determined = self.largest_condition() < 1.0 / (64.0 * f64::EPSILON);
        self.covariance.filter(|_| determined)
    }
}

fn refusal(error: ImpossibleRobot) -> Refusal {
    match error {
        ImpossibleRobot::Arm(arm, error) => Refusal::ImpossibleGeometry { arm, error },
        ImpossibleRobot::Robot(error) => Refusal::ImpossibleRobot(error),
    }
}

/// A figure for a message.
#[allow(clippy::cast_possible_truncation)] // rounding is the meaning
fn to_single(value: f64) -> f32 {
    value as f32
}
