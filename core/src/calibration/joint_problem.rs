//! The problem of the joint calibration: 24 parameters, three residuals per sample.

use super::arm_problem::product_of_columns;
use super::free_start::Means;
use super::free_start::correction_of;
use super::problem::{Piece, Problem};
use super::refusal::Refusal;
use super::robot_solver::check_side;
use crate::Real;
use crate::robot::{ArmIndex, Drive, Robot};
use crate::samples::{
    JOINT_COLUMNS, JointDisplacement, JointFactor, NominalArm, Triangle, corrected_arm, put_row,
};
use core::iter::once;

/// The triangular factor of the linearised problem: 24 columns ∂r/∂P and the residual r.
pub(crate) type JointNormal<T> = Triangle<T, 25, 325>;

const PARAMETERS: usize = 8;
const FEATURES: usize = 12;
/// Rows of R reduced in one piece.
const ROWS: usize = 4;
/// Index of the feature 1 of an arm.
const ONE: usize = 11;

impl<T: Real> Problem<T, 24, 25, 325> for JointFactor<T> {
    type At = JointDisplacement<T>;
    const PIECEWISE: bool = true;
    const CHORDS: bool = true;
    const RESIDUALS: u8 = 3;
    const FREE_STARTS: u8 = 1;

    fn displaced(&self, correction: &[T; 24]) -> JointDisplacement<T> {
        self.displaced(&by_arms(correction))
    }

    fn sum_of_squares(&self, at: &JointDisplacement<T>, _: usize) -> Piece<T> {
        Piece {
            sum_of_squares: self.residual_sum(at),
            more: false,
        }
    }

    /// Four rows of R times ∂c/∂P. A row of R starts at its own column, so rows of the second arm's columns do not
    /// affect the first arm's parameters.
    #[inline(never)]
    fn linearize(
        &self,
        at: &JointDisplacement<T>,
        normal: &mut JointNormal<T>,
        piece: usize,
    ) -> Piece<T> {
        let first_row = ROWS * piece;
        let arm = first_row / FEATURES;
        let mut block = [[T::ZERO; ROWS]; 25];
        let columns = block.get_mut(PARAMETERS * arm..).unwrap_or_default();
        let mut sum = T::ZERO;
        for index in 0..ROWS {
            let row = first_row + index;
            let entries = self.triangle().row(row);
            let mut residual = entries.last().copied().unwrap_or(T::ZERO);
            let zeros = row % FEATURES;
            let (diagonal, others) = entries
                .split_at_checked(FEATURES - zeros)
                .unwrap_or_default();
            let mut own = [T::ZERO; FEATURES];
            for (feature, entry) in own.iter_mut().skip(zeros).zip(diagonal) {
                *feature = *entry;
            }
            let features = once(&own).chain(others.as_chunks().0);
            let mut start = 0;
            for (displacement, features) in at.arms.iter().skip(arm).zip(features) {
                for (feature, coefficient) in features.iter().zip(&displacement.coefficients) {
                    residual += *feature * *coefficient;
                }
                put_row(columns, index, start, &displacement.gradient_of(features));
                start += PARAMETERS;
            }
            sum += residual.squared();
            put_row(columns, index, start, &[residual]);
        }
        let pivots = columns.len();
        normal.eliminate(columns, pivots);
        let more = first_row + ROWS < JOINT_COLUMNS - 1;
        if !more {
            sum += self.least_sum_of_squares();
        }
        Piece {
            sum_of_squares: sum,
            more,
        }
    }

    fn gradient(&self, at: &JointDisplacement<T>) -> [T; 24] {
        self.gradient(at)
    }

    #[inline(never)]
    fn free_start(&self, _: u8) -> Option<[T; 24]> {
        // A pivot of the size of its column's rounding carries no information.
        let rounding = T::from_f64(16.0) * T::EPSILON;
        let smallest = self.triangle().column_norms().map(|norm| rounding * norm);
        let coefficients: [T; JOINT_COLUMNS - 1] = self.triangle().minimiser(&smallest)?;
        let mut correction = [T::ZERO; 24];
        for ((own, delta), nominal) in correction
            .chunks_exact_mut(PARAMETERS)
            .zip(coefficients.as_chunks::<FEATURES>().0)
            .zip(self.nominal_arms())
        {
            own.copy_from_slice(&correction_of(nominal, delta)?);
        }
        Some(correction)
    }

    fn least_sum_of_squares(&self) -> T {
        self.least_sum_of_squares()
    }

    fn rows_squared(&self) -> T {
        let [first, second, third, right] = [ONE, FEATURES + ONE, 2 * FEATURES + ONE, 36]
            .map(|column| product_of_columns(self.triangle(), column, column));
        first + second + third + right
    }

    fn terms_squared(&self) -> T {
        product_of_columns(self.triangle(), JOINT_COLUMNS - 1, JOINT_COLUMNS - 1)
    }

    fn samples(&self) -> u64 {
        self.samples()
    }

    fn effective_samples(&self) -> T {
        self.effective_samples()
    }

    fn noise_stated(&self) -> bool {
        self.noise().is_some()
    }

    fn unit(&self) -> T {
        self.unit()
    }

    fn unit_of(&self, parameter: usize) -> T {
        let arm = self.nominal_arms().get(parameter / PARAMETERS);
        let unit = arm.and_then(|arm| arm.units().get(parameter % PARAMETERS).copied());
        unit.unwrap_or(T::ONE)
    }

    fn upper_arm(&self, parameter: usize) -> T {
        let arm = self.nominal_arms().get(parameter / PARAMETERS);
        arm.map_or(T::ONE, |arm| arm.arm().upper_arm_length())
    }

    fn drive(&self) -> Drive {
        let [first, ..] = self.nominal_arms();
        first.arm().drive()
    }
}

/// The robot at a correction fitted to these samples.
///
/// # Errors
/// [`Refusal::ImpossibleGeometry`], [`Refusal::ImpossibleRobot`] or [`Refusal::WrongSide`].
#[inline(never)]
pub(super) fn corrected_robot<T: Real>(
    factor: &JointFactor<T>,
    correction: &[T; 24],
) -> Result<Robot<T>, Refusal> {
    let [one, two, three] = by_arms(correction);
    let [first, second, third] = factor.nominal_arms();
    let arm = |arm: ArmIndex, nominal: &NominalArm<T>, correction: &[T; 8]| {
        corrected_arm(nominal, correction)
            .map_err(|error| Refusal::ImpossibleGeometry { arm, error })
    };
    let robot = Robot::new([
        arm(ArmIndex::First, first, &one)?,
        arm(ArmIndex::Second, second, &two)?,
        arm(ArmIndex::Third, third, &three)?,
    ])
    .map_err(Refusal::ImpossibleRobot)?;
    check_side(&robot, [first, second, third], means(factor))?;
    Ok(robot)
}

/// The mean sample of each arm.
fn means<T: Real>(factor: &JointFactor<T>) -> [Means<T>; 3] {
    let mean = factor.mean();
    let [first, second, third] = mean.cosines;
    let [one, two, three] = mean.sines;
    [(first, one), (second, two), (third, three)].map(|(cosine, sine)| Means {
        x: mean.position,
        spread: T::ZERO,
        sine,
        cosine,
    })
}

fn by_arms<T: Real>(correction: &[T; 24]) -> [[T; 8]; 3] {
    let mut arms = [[T::ZERO; 8]; 3];
    for (arm, own) in arms.iter_mut().zip(correction.chunks_exact(8)) {
        arm.copy_from_slice(own);
    }
    arms
}

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_precision_loss, clippy::float_cmp, clippy::unwrap_used)]

    use super::{JointNormal, by_arms};
    use crate::calibration::problem::Problem;
    use crate::robot::Drive;
    use crate::samples::joint_factor_tests::{changed, empty, noises, robot, samples};
    use crate::samples::{JointFactor, Sample};
    use nalgebra::{SMatrix, SVector};

    fn filled(index: usize, samples: &[Sample<f64>]) -> JointFactor<f64> {
        let mut factor = empty(noises()[index]);
        for sample in samples {
            factor.add(sample).unwrap();
        }
        factor
    }

    /// TᵀT.
    fn gram(normal: &JointNormal<f64>) -> SMatrix<f64, 25, 25> {
        let mut gram = SMatrix::<f64, 25, 25>::zeros();
        for (index, row) in normal.rows().enumerate() {
            for (i, a) in row.iter().enumerate() {
                for (j, b) in row.iter().enumerate() {
                    gram[(index + i, index + j)] += a * b;
                }
            }
        }
        gram
    }

    fn assert_same(found: &SMatrix<f64, 25, 25>, expected: &SMatrix<f64, 25, 25>, close: f64) {
        for row in 0..25 {
            for column in 0..25 {
                let unit = libm::sqrt(expected[(row, row)] * expected[(column, column)]);
                let off = (found[(row, column)] - expected[(row, column)]).abs();
                assert!(off < close * unit, "{row} {column}: {off:e} of {unit:e}");
            }
        }
    }

    fn correction(to: u64, factor: &JointFactor<f64>) -> [f64; 24] {
        let mut correction = [0.0; 24];
        for ((own, nominal), arm) in correction
            .chunks_exact_mut(8)
            .zip(factor.nominal_arms())
            .zip(changed(to).arms())
        {
            own.copy_from_slice(&nominal.correction_to(arm));
        }
        correction
    }

    /// Nine pieces against the Jacobian of every sample's three residuals, row by row.
    #[test]
    fn the_pieces_are_the_jacobian_row_by_row() {
        for noise in 0..4 {
            let measured = samples::<30>(&changed(11), 12);
            let factor = filled(noise, &measured);
            for at in [[0.0; 24], correction(11, &factor), correction(13, &factor)] {
                let displaced = Problem::displaced(&factor, &at);
                let mut normal = JointNormal::zero();
                let (mut sum, mut piece) = (0.0, 0);
                loop {
                    let done = factor.linearize(&displaced, &mut normal, piece);
                    sum += done.sum_of_squares;
                    piece += 1;
                    if !done.more {
                        break;
                    }
                }
                assert_eq!(piece, 9);
                let mut expected = SMatrix::<f64, 25, 25>::zeros();
                for sample in &measured {
                    for row in factor.prepare(sample).linearized(&displaced) {
                        let row = SVector::from(row);
                        expected += row * row.transpose();
                    }
                }
                let gradient = SVector::from(Problem::gradient(&factor, &displaced));
                let scale = (sum * expected.trace()).sqrt();
                assert!((gradient - expected.fixed_view::<24, 1>(0, 24)).norm() < 1e-10 * scale);
                // The part that no coefficients explain is in the sum, but not in the rows.
                let unexplained = factor.least_sum_of_squares();
                assert!((sum / expected[(24, 24)] - 1.0).abs() < 1e-8);
                assert!((sum / factor.residual_sum(&displaced) - 1.0).abs() < 1e-8);
                expected[(24, 24)] -= unexplained;
                let found = gram(&normal);
                let explained = found[(24, 24)] + unexplained;
                assert!((explained / sum - 1.0).abs() < 1e-8);
                expected[(24, 24)] = found[(24, 24)];
                assert_same(&found, &expected, 1e-8);
            }
        }
    }

    #[test]
    fn damping_adds_the_squares_of_its_diagonal() {
        let measured = samples::<20>(&changed(11), 14);
        let factor = filled(2, &measured);
        let mut normal = JointNormal::zero();
        let at = Problem::displaced(&factor, &[0.0; 24]);
        for piece in 0..9 {
            factor.linearize(&at, &mut normal, piece);
        }
        let mut expected = gram(&normal);
        let mut diagonal = normal.column_norms();
        for (index, entry) in diagonal.iter_mut().enumerate().take(24) {
            *entry *= 0.1 * (index as f64 + 1.0);
            expected[(index, index)] += *entry * *entry;
        }
        let mut of_parameters = [0.0; 24];
        of_parameters.copy_from_slice(&diagonal[..24]);
        let mut pieces = 1;
        while factor.damp(&mut normal, &of_parameters, pieces - 1) {
            pieces += 1;
        }
        assert_eq!(pieces, 6);
        assert_same(&gram(&normal), &expected, 1e-12);
    }

    /// Σ |W f(P₀)|², and Σ |W|².
    #[test]
    fn the_sizes_of_rows_and_terms_are_sums_over_the_samples() {
        let measured = samples::<20>(&changed(11), 15);
        let factor = filled(2, &measured);
        let at = Problem::displaced(&factor, &[0.0; 24]);
        let (mut terms, mut weights) = (0.0, 0.0);
        for sample in &measured {
            let prepared = factor.prepare(sample);
            terms += prepared.residuals(&at).iter().map(|r| r * r).sum::<f64>();
            weights += prepared
                .rows()
                .iter()
                .flatten()
                .map(|entry| entry * entry)
                .sum::<f64>();
        }
        assert!((factor.terms_squared() / terms - 1.0).abs() < 1e-9);
        assert!((factor.rows_squared() / (terms + weights) - 1.0).abs() < 1e-9);
    }

    /// From twelve exact samples, for any initial robot.
    #[test]
    fn the_start_without_a_guess_is_the_robot() {
        let truth = changed(16);
        let measured = samples::<14>(&truth, 17).map(|sample| Sample {
            position: truth.forward(&sample.joints).unwrap(),
            ..sample
        });
        for noise in 0..4 {
            let found = filled(noise, &measured).free_start(0).unwrap();
            let expected = correction(16, &filled(noise, &[]));
            for (found, expected) in found.iter().zip(expected) {
                // ε times the condition number of 36 coefficients from 14 samples, about 1e5.
                assert!((found - expected).abs() < 1e-8, "{found} {expected}");
            }
            assert_eq!(filled(noise, &measured[..11]).free_start(0), None);
        }
    }

    #[test]
    fn corrections_are_given_to_the_arms_in_turn() {
        let mut all = [0.0; 24];
        for (index, value) in all.iter_mut().enumerate() {
            *value = index as f64;
        }
        let [one, two, three] = by_arms(&all);
        assert_eq!(
            [one[0], one[7], two[0], two[7], three[0], three[7]],
            [0.0, 7.0, 8.0, 15.0, 16.0, 23.0]
        );
        // Relative to itself, a robot needs no correction.
        let factor = empty(None);
        for (nominal, arm) in factor.nominal_arms().iter().zip(robot().arms()) {
            assert_eq!(nominal.correction_to(arm), [0.0; 8]);
        }
    }

    /// Each arm's own lengths, and the drive.
    #[test]
    fn a_parameter_belongs_to_its_own_arm() {
        let factor = filled(0, &[]);
        for (number, arm) in robot().arms().iter().enumerate() {
            for place in 0..8 {
                let index = 8 * number + place;
                assert_eq!(Problem::upper_arm(&factor, index), arm.upper_arm_length());
            }
        }
        assert_eq!(Problem::drive(&factor), Drive::Rotary);
        #[cfg(feature = "linear")]
        {
            let towers = crate::robot::SymmetricLinearRobot {
                tower_radius: 140.0,
                forearm: 330.0,
            };
            let towers = towers.robot().unwrap();
            let factor = JointFactor::new(&towers, &nalgebra::Vector3::zeros(), None);
            assert_eq!(Problem::drive(&factor), Drive::Linear);
        }
    }
}
