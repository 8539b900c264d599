//! The residuals X − FK(P; q), weighted, and the prior.

use super::linearization::{Linearization, by_constraints};
use super::normal::{ARM, Normal, Staircase, Vector24};
use delta_cal::robot::{Arm, GeometryError, ParameterKind};
use delta_cal::{ArmIndex, Noise, Parameter, Robot, Sample, Tolerance};
use nalgebra::{Matrix3, SVector, Vector3};

/// Rounding of a computed position, in ε of the robot's size.
const ROUNDING: f64 = 4.0;

/// The samples of a robot, and what they are expressed against.
///
/// Corrections are in mm: lengths as they are, angles times the upper arm's length.
#[derive(Debug)]
pub(super) struct Problem<'a> {
    pub(super) reference: &'a Robot<f64>,
    pub(super) samples: &'a [Sample<f64>],
    /// Lₖ⁻¹, or the identity without a stated noise.
    whitening: Vec<Matrix3<f64>>,
    /// What a parameter is multiplied by: 1, or the upper arm's length.
    pub(super) units: Vector24,
    /// 1/tolerance per unit of correction; zero without a tolerance.
    pub(super) tolerance_weights: Vector24,
    /// The squared size of the terms that a residual is summed up from: its rounding is ε times
    /// that.
    pub(super) terms_squared: f64,
    /// What the samples are worth: as many as there are, or what a robust fit's weights leave.
    pub(super) effective_samples: f64,
}

impl<'a> Problem<'a> {
    /// `weights` is the robot at which the noise of the joints is carried over to the positions.
    pub(super) fn new(
        reference: &'a Robot<f64>,
        weights: &Robot<f64>,
        samples: &'a [Sample<f64>],
        noise: Option<&Noise<f64>>,
        tolerance: Option<&Tolerance<f64>>,
    ) -> Self {
        let mut units = Vector24::repeat(1.0);
        let mut tolerance_weights = Vector24::zeros();
        for (arm, geometry) in reference.arms().iter().enumerate() {
            for parameter in Parameter::ALL {
                let index = ARM * arm + parameter.index();
                if parameter.kind() == ParameterKind::Angle {
                    units[index] = geometry.upper_arm_length();
                }
                if let Some(tolerance) = tolerance {
                    tolerance_weights[index] = 1.0 / (tolerance.of(parameter) * units[index]);
                }
            }
        }
        let whitening: Vec<_> = samples
            .iter()
            .map(|sample| {
                noise.map_or_else(Matrix3::identity, |noise| whitening(weights, sample, noise))
            })
            .collect();
        let terms_squared = whitening
            .iter()
            .zip(samples)
            .map(|(whitening, sample)| whitening.norm_squared() * size_squared(reference, sample))
            .sum();
        Self {
            reference,
            samples,
            whitening,
            units,
            tolerance_weights,
            terms_squared,
            effective_samples: as_number(samples.len()),
        }
    }

    /// Lets every sample count with its factor in the sum of squares.
    pub(super) fn weighted(mut self, factors: &[f64], effective_samples: f64) -> Self {
        for (whitening, factor) in self.whitening.iter_mut().zip(factors) {
            *whitening *= factor.sqrt();
        }
        self.effective_samples = effective_samples;
        self
    }

    /// The reference moved by a correction.
    pub(super) fn robot(&self, correction: &Vector24) -> Result<Robot<f64>, ImpossibleRobot> {
        let parameters = correction.component_div(&self.units);
        let arm = |index: ArmIndex| {
            let reference = self.reference.arm(index);
            let mut values = reference.parameters();
            let own = parameters.fixed_rows::<ARM>(ARM * index.index());
            for (value, delta) in values.iter_mut().zip(own.iter()) {
                *value += delta;
            }
            let theta = &mut values[Parameter::Theta.index()];
            let turn = std::f64::consts::TAU;
            if theta.abs() > turn {
                *theta -= (*theta / turn).round() * turn;
            }
            Arm::new(values).map_err(|error| ImpossibleRobot::Arm(index, error))
        };
        Robot::new([
            arm(ArmIndex::First)?,
            arm(ArmIndex::Second)?,
            arm(ArmIndex::Third)?,
        ])
        .map_err(ImpossibleRobot::Robot)
    }

    /// The correction that leads to a robot.
    pub(super) fn correction_to(&self, robot: &Robot<f64>) -> Vector24 {
        let mut correction = Vector24::zeros();
        for (arm, (to, from)) in robot.arms().iter().zip(self.reference.arms()).enumerate() {
            let mut difference = SVector::from(to.parameters()) - SVector::from(from.parameters());
            // 359° and −1° are the same azimuth.
            let (theta, turn) = (Parameter::Theta.index(), std::f64::consts::TAU);
            difference[theta] -= (difference[theta] / turn).round() * turn;
            correction
                .fixed_rows_mut::<ARM>(ARM * arm)
                .copy_from(&difference);
        }
        correction.component_mul(&self.units)
    }

    /// Lₖ⁻¹ (X − FK) of every sample; `None` if the robot does not reach one.
    fn residuals(&self, robot: &Robot<f64>) -> Option<Vec<Vector3<f64>>> {
        self.samples
            .iter()
            .zip(&self.whitening)
            .map(|(sample, whitening)| residual(robot, sample, whitening))
            .collect()
    }

    /// Σ |Lₖ⁻¹ (X − FK)|²; infinite where the robot does not exist or does not reach a sample.
    pub(super) fn sum_of_squares(&self, correction: &Vector24) -> f64 {
        self.robot(correction)
            .ok()
            .and_then(|robot| self.residuals(&robot))
            .map_or(f64::INFINITY, |residuals| {
                residuals.iter().map(Vector3::norm_squared).sum()
            })
    }

    /// The triangle of all rows, prior included, at a correction that
    /// [`sum_of_squares`](Self::sum_of_squares) is finite at. `None` with fewer rows than
    /// parameters.
    pub(super) fn linearize(&self, correction: &Vector24, prior: &Vector24) -> Option<Normal> {
        let robot = self.robot(correction).ok()?;
        let with_prior = prior.iter().any(|weight| *weight > 0.0);
        let measured = self.samples.len();
        let mut rows = Staircase::zeros(measured + if with_prior { ARM } else { 0 });
        for (row, (sample, whitening)) in self.samples.iter().zip(&self.whitening).enumerate() {
            let at = Linearization::new(&robot, &sample.joints).ok()?;
            // Turned so that the first row depends on all arms, the second on two, the last on one.
            let reflection = (whitening * -at.by_constraints).qr();
            let mut residual = whitening * (sample.position - at.position);
            reflection.q_tr_mul(&mut residual);
            let coupling = reflection.r();
            for first in 0..3 {
                let own = rows.rows_of(first);
                for arm in first..3 {
                    let gradient = &at.constraints_by_parameters[arm];
                    let factor = coupling[(first, arm)];
                    for parameter in 0..ARM {
                        own[(row, ARM * (arm - first) + parameter)] =
                            factor * gradient[parameter] / self.units[ARM * arm + parameter];
                    }
                }
                own[(row, ARM * (3 - first))] = residual[first];
            }
        }
        if with_prior {
            for arm in 0..3 {
                let own = rows.rows_of(arm);
                for parameter in 0..ARM {
                    let index = ARM * arm + parameter;
                    own[(measured + parameter, parameter)] = prior[index];
                    own[(measured + parameter, ARM * (3 - arm))] = prior[index] * correction[index];
                }
            }
        }
        rows.reduce()
    }

    /// The arm along whose forearm the residuals are largest; the first if there are none.
    pub(super) fn worst_arm(&self, correction: &Vector24) -> ArmIndex {
        let Ok(robot) = self.robot(correction) else {
            return ArmIndex::First;
        };
        let along = |index: ArmIndex| -> f64 {
            let arm = robot.arm(index);
            self.samples
                .iter()
                .filter_map(|sample| {
                    let position = robot.forward(&sample.joints).ok()?;
                    let forearm = position - arm.elbow(sample.joints[index.index()]);
                    Some(((sample.position - position).dot(&forearm) / arm.lb()).powi(2))
                })
                .sum()
        };
        ArmIndex::ALL
            .into_iter()
            .max_by(|a, b| along(*a).total_cmp(&along(*b)))
            .unwrap_or(ArmIndex::First)
    }
}

/// Why a correction leads to no robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ImpossibleRobot {
    Arm(ArmIndex, GeometryError),
    Robot(GeometryError),
}

/// L⁻¹ (X − FK) of a sample; `None` if the robot does not reach it.
fn residual(
    robot: &Robot<f64>,
    sample: &Sample<f64>,
    whitening: &Matrix3<f64>,
) -> Option<Vector3<f64>> {
    let position = robot.forward(&sample.joints).ok()?;
    Some(whitening * (sample.position - position))
}

/// |L⁻¹ (X − FK)|, in mm without a noise; `None` if the robot does not reach the sample.
pub(super) fn residual_length(
    robot: &Robot<f64>,
    sample: &Sample<f64>,
    noise: Option<&Noise<f64>>,
) -> Option<f64> {
    let whitening = noise.map_or_else(Matrix3::identity, |noise| whitening(robot, sample, noise));
    Some(residual(robot, sample, &whitening)?.norm())
}

/// √(|L⁻¹ (X − FK)|²/3); `None` if the robot does not reach the sample, or nothing holds it there.
pub(super) fn residual_in_sigmas(
    robot: &Robot<f64>,
    sample: &Sample<f64>,
    noise: &Noise<f64>,
) -> Option<f64> {
    let whitening = whitening(robot, sample, noise);
    let residual = residual(robot, sample, &whitening)?;
    (whitening.norm_squared() > 0.0).then(|| (residual.norm_squared() / 3.0).sqrt())
}

fn size_squared(robot: &Robot<f64>, sample: &Sample<f64>) -> f64 {
    let [arm, ..] = robot.arms();
    sample.position.norm_squared() + arm.lb().powi(2)
}

/// L⁻¹ with L Lᵀ = σx² I + σq² J_q J_qᵀ, J_q = ∂X/∂q at the measured pose. Rounding is a noise too,
/// and is added: no stated noise claims more than the arithmetic can hold.
pub(super) fn whitening(
    robot: &Robot<f64>,
    sample: &Sample<f64>,
    noise: &Noise<f64>,
) -> Matrix3<f64> {
    let rounding = (ROUNDING * f64::EPSILON).powi(2) * size_squared(robot, sample);
    let mut covariance = Matrix3::identity() * (noise.position().powi(2) + rounding);
    if noise.joint() > 0.0 {
        let Some(mut by_joints) = by_constraints(robot, sample) else {
            // The joints do not hold the platform here: the sample says nothing.
            return Matrix3::zeros();
        };
        for ((mut column, arm), q) in by_joints
            .column_iter_mut()
            .zip(robot.arms())
            .zip(sample.joints)
        {
            column *= arm.constraint_by_joint(&sample.position, q) * noise.joint();
        }
        covariance += by_joints * by_joints.transpose();
    }
    covariance
        .cholesky()
        .and_then(|factor| factor.l().try_inverse())
        .unwrap_or_else(Matrix3::zeros)
}

#[allow(clippy::cast_precision_loss)] // a count
pub(super) fn as_number(count: usize) -> f64 {
    count as f64
}
