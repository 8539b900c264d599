//! The joint calibration's problem: 24 parameters, three residuals a sample.

use super::arm_problem::Means;
use super::arm_problem::product_of_columns;
use super::free_start::correction_of;
use super::outcome::{Estimate, JointOutcome};
use super::problem::{Piece, Problem};
use super::refusal::Refusal;
use super::robot_solver::check_side;
use crate::Real;
use crate::robot::{Arm, ArmIndex, Drive, Robot};
use crate::samples::{
    JOINT_COLUMNS, JointDisplacement, JointFactor, Triangle, corrected_arm, put_row,
};
use core::iter::once;

/// The triangular factor of the linearised problem: 24 columns ∂r/∂P and the residual r.
pub type JointNormal<T> = Triangle<T, 25, 325>;

const PARAMETERS: usize = 8;
const FEATURES: usize = 12;
/// Rows of R that are reduced in one piece.
const ROWS: usize = 4;
/// The place of an arm's feature 1.
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

    /// Four rows of R times ∂c/∂P. A row of R begins at its own column, so that the rows of the second
    /// arm's columns do not touch the first arm's parameters.
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
        // A pivot of the size of its column's rounding error carries no information.
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

impl<T: Real> JointOutcome<T> {
    /// The robot of an estimate from these samples.
    ///
    /// # Errors
    /// [`Refusal::ImpossibleGeometry`], [`Refusal::ImpossibleRobot`] or [`Refusal::WrongSide`].
    #[inline(never)]
    pub fn new(factor: &JointFactor<T>, estimate: &Estimate<T, 24>) -> Result<Self, Refusal> {
        let [one, two, three] = by_arms(&estimate.correction);
        let arm = |index: ArmIndex, correction: &[T; 8]| -> Result<Arm<T>, Refusal> {
            let [first, second, third] = factor.nominal_arms();
            let nominal = match index {
                ArmIndex::First => first,
                ArmIndex::Second => second,
                ArmIndex::Third => third,
            };
            corrected_arm(nominal, correction)
                .map_err(|error| Refusal::ImpossibleGeometry { arm: index, error })
        };
        let robot = Robot::new([
            arm(ArmIndex::First, &one)?,
            arm(ArmIndex::Second, &two)?,
            arm(ArmIndex::Third, &three)?,
        ])
        .map_err(Refusal::ImpossibleRobot)?;
        let [first, second, third] = factor.nominal_arms();
        check_side(&robot, [first, second, third], means(factor))?;
        Ok(Self {
            robot,
            estimate: *estimate,
        })
    }
}

/// The mean samples of the three arms.
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
mod tests;
