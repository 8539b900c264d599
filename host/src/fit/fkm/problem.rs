//! The residuals X − FK(P; q), weighted, and the prior.

use super::linearization::{Linearization, by_constraints};
use delta_cal::calibration::{self, JointNormal, Piece};
use delta_cal::robot::{Drive, ParameterKind};
use delta_cal::{ArmIndex, Noise, Parameter, Refusal, Robot, Sample};
use nalgebra::{Matrix3, Vector3};

/// Parameters of one arm, of all arms.
pub(super) const ARM: usize = 8;
pub(super) const ALL: usize = 24;
/// Samples that are reduced together.
const BLOCK: usize = 4;

/// Rounding of a computed position, in ε of the robot's size.
const ROUNDING: f64 = 4.0;

/// The samples of a robot, and what they are expressed against.
///
/// Corrections are in radians: angles as they are, lengths over the upper arm's.
#[derive(Debug)]
pub(super) struct Problem<'a> {
    reference: &'a Robot<f64>,
    samples: &'a [Sample<f64>],
    /// Lₖ⁻¹, or the identity without a stated noise.
    whitening: Vec<Matrix3<f64>>,
    /// What a correction of 1 is: 1 rad, or the upper arm's length.
    units: [f64; ALL],
    /// Whether the residuals are in σ.
    noise_stated: bool,
    /// The correction of the joint calibration, which needs no guess, and the sum of squares there.
    start: Option<([f64; ALL], f64)>,
    /// The squared size of the terms that a residual is summed up from: its rounding is ε times
    /// that.
    terms_squared: f64,
    /// What the samples are worth: as many as there are, or what a robust fit's weights leave.
    effective_samples: f64,
}

impl<'a> Problem<'a> {
    /// `weights` is the robot at which the noise of the joints is carried over to the positions.
    pub(super) fn new(
        reference: &'a Robot<f64>,
        weights: &Robot<f64>,
        samples: &'a [Sample<f64>],
        noise: Option<&Noise<f64>>,
    ) -> Self {
        let mut units = [1.0; ALL];
        for (arm, geometry) in reference.arms().iter().enumerate() {
            for (place, parameter) in geometry.drive().places().into_iter().enumerate() {
                units[ARM * arm + place] = match parameter.map(Parameter::kind) {
                    Some(ParameterKind::Length) => geometry.upper_arm_length(),
                    Some(ParameterKind::Angle | ParameterKind::Ratio) => 1.0,
                    None => 0.0,
                };
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
            noise_stated: noise.is_some(),
            start: None,
            terms_squared,
            effective_samples: as_number(samples.len()),
        }
    }

    /// The same with the solution of the joint calibration as a second start.
    pub(super) fn started_from(mut self, robot: &Robot<f64>) -> Self {
        let correction = self.correction_to(robot);
        let sum = self.sum_of_squares_at(&correction);
        self.start = Some((correction, sum));
        self
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
    pub(super) fn robot(&self, correction: &[f64; ALL]) -> Result<Robot<f64>, Refusal> {
        let arm = |index: ArmIndex| {
            let first = ARM * index.index();
            let mut values = self.reference.arm(index).parameters();
            for (parameter, value) in values.iter_mut().enumerate() {
                *value += correction[first + parameter] * self.units[first + parameter];
            }
            let theta = &mut values[Parameter::Theta.index()];
            let turn = std::f64::consts::TAU;
            if theta.abs() > turn {
                *theta -= (*theta / turn).round() * turn;
            }
            self.reference
                .arm(index)
                .with_parameters(values)
                .map_err(|error| Refusal::ImpossibleGeometry { arm: index, error })
        };
        Robot::new([
            arm(ArmIndex::First)?,
            arm(ArmIndex::Second)?,
            arm(ArmIndex::Third)?,
        ])
        .map_err(Refusal::ImpossibleRobot)
    }

    /// The correction that leads to a robot.
    fn correction_to(&self, robot: &Robot<f64>) -> [f64; ALL] {
        let mut correction = [0.0; ALL];
        for (arm, (to, from)) in robot.arms().iter().zip(self.reference.arms()).enumerate() {
            for (parameter, (to, from)) in to.parameters().iter().zip(from.parameters()).enumerate()
            {
                let mut difference = to - from;
                // 359° and −1° are the same azimuth.
                if parameter == Parameter::Theta.index() {
                    let turn = std::f64::consts::TAU;
                    difference -= (difference / turn).round() * turn;
                }
                let index = ARM * arm + parameter;
                if self.units[index] > 0.0 {
                    correction[index] = difference / self.units[index];
                }
            }
        }
        correction
    }

    fn sum_of_squares_at(&self, correction: &[f64; ALL]) -> f64 {
        let robot = self.robot(correction).ok();
        calibration::sum_of_squares(self, &robot)
    }

    /// Takes the rows of a few samples into a triangle; Σ r² of them. `None` if the robot does not reach
    /// one.
    fn absorb(
        &self,
        robot: &Robot<f64>,
        samples: &[(&Sample<f64>, &Matrix3<f64>)],
        normal: &mut JointNormal<f64>,
    ) -> Option<f64> {
        // Rows that begin at the first, the second and the third arm's columns.
        let mut blocks = [[[0.0; BLOCK]; ALL + 1]; 3];
        let mut sum = 0.0;
        for (place, (sample, whitening)) in samples.iter().enumerate() {
            let at = Linearization::new(robot, &sample.joints).ok()?;
            // Turned so that the first row depends on all arms, the second on two, the last on one.
            let reflection = (*whitening * -at.by_constraints).qr();
            let mut residual = *whitening * (sample.position - at.position);
            sum += residual.norm_squared();
            reflection.q_tr_mul(&mut residual);
            let coupling = reflection.r();
            for (first, block) in blocks.iter_mut().enumerate() {
                for arm in first..3 {
                    let gradient = &at.constraints_by_parameters[arm];
                    for parameter in 0..ARM {
                        let index = ARM * arm + parameter;
                        block[index][place] =
                            coupling[(first, arm)] * gradient[parameter] * self.units[index];
                    }
                }
                block[ALL][place] = residual[first];
            }
        }
        for (first, block) in blocks.iter_mut().enumerate() {
            let columns = &mut block[ARM * first..];
            let pivots = columns.len();
            normal.eliminate(columns, pivots);
        }
        Some(sum)
    }
}

impl calibration::Problem<f64, 24, 25, 325> for Problem<'_> {
    /// `None` where there is no such robot.
    type At = Option<Robot<f64>>;
    const PIECEWISE: bool = false;
    const RESIDUALS: u8 = 3;
    const FREE_STARTS: u8 = 1;

    fn displaced(&self, correction: &[f64; ALL]) -> Option<Robot<f64>> {
        self.robot(correction).ok()
    }

    /// Infinite where the robot does not reach a sample.
    fn sum_of_squares(&self, at: &Option<Robot<f64>>, _: usize) -> Piece<f64> {
        let residuals = at.iter().flat_map(|robot| {
            let samples = self.samples.iter().zip(&self.whitening);
            samples.map(|(sample, whitening)| {
                residual(robot, sample, whitening).map_or(f64::INFINITY, |own| own.norm_squared())
            })
        });
        Piece {
            sum_of_squares: at.map_or(f64::INFINITY, |_| residuals.sum()),
            more: false,
        }
    }

    fn linearize(
        &self,
        at: &Option<Robot<f64>>,
        normal: &mut JointNormal<f64>,
        _: usize,
    ) -> Piece<f64> {
        let samples: Vec<_> = self.samples.iter().zip(&self.whitening).collect();
        let sum = at.as_ref().and_then(|robot| {
            let blocks = samples.chunks(BLOCK);
            blocks.map(|block| self.absorb(robot, block, normal)).sum()
        });
        Piece {
            sum_of_squares: sum.unwrap_or(f64::INFINITY),
            more: false,
        }
    }

    fn free_start(&self, _: u8) -> Option<[f64; ALL]> {
        self.start.map(|(correction, _)| correction)
    }

    fn least_sum_of_squares(&self) -> f64 {
        self.start.map_or(0.0, |(_, sum)| sum)
    }

    fn rows_squared(&self) -> f64 {
        self.terms_squared
    }

    fn terms_squared(&self) -> f64 {
        self.terms_squared
    }

    fn samples(&self) -> u64 {
        self.samples.len() as u64
    }

    fn effective_samples(&self) -> f64 {
        self.effective_samples
    }

    fn noise_stated(&self) -> bool {
        self.noise_stated
    }

    fn unit(&self) -> f64 {
        1.0
    }

    fn unit_of(&self, parameter: usize) -> f64 {
        self.units[parameter]
    }

    fn upper_arm(&self, parameter: usize) -> f64 {
        self.reference.arms()[parameter / ARM].upper_arm_length()
    }

    fn drive(&self) -> Drive {
        self.reference.drive()
    }
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

/// How far a sample is off, in σ of the noise as it is where the robot stands, √(|L⁻¹ (X − FK)|²/3): 1 is expected, less
/// where few samples are left over. `None` if the robot does not reach the sample, or nothing holds it there.
pub(crate) fn residual_in_sigmas(
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
pub(crate) fn whitening(
    robot: &Robot<f64>,
    sample: &Sample<f64>,
    noise: &Noise<f64>,
) -> Matrix3<f64> {
    let rounding = (ROUNDING * f64::EPSILON).powi(2) * size_squared(robot, sample);
    let mut covariance = Matrix3::from_diagonal(
        &Vector3::from(noise.position_by_axis()).map(|sigma| sigma.powi(2) + rounding),
    );
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
