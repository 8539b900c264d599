//! The problem of the joint calibration: 24 parameters, three residuals per sample.

use super::arm_problem::product_of_columns;
use super::free_start::Means;
use super::problem::{Extent, Gradient, Judged, Piece, Problem};
use super::refusal::{Instrument, Refusal};
use super::robot_solver::check_side;
use crate::Real;
use crate::robot::{Arm, ArmIndex, OF_ARM, Robot};
use crate::samples::{
    FEATURES, JOINT_COLUMNS, JointDisplacement, JointFactor, NominalArm, ONE, Triangle,
    corrected_arm, part, put_row,
};
use core::iter::once;

/// The triangular factor of the linearised problem: 24 columns ∂r/∂P and the residual r.
pub(crate) type JointNormal<T> = Triangle<T, 24>;

/// Rows of R reduced in one piece: as many as a short step allows, since every piece turns all columns.
const ROWS: usize = 6;

impl<T: Real> JointFactor<T> {
    /// Absorbs a piece of the rows (∂r/∂P, r) into `normal`; returns their Σ r². Six rows of R times ∂c/∂P. A row of R
    /// starts at its own column, so rows of the second arm's columns do not affect the first arm's parameters.
    pub(crate) fn linearized(
        &self,
        at: &JointDisplacement<T>,
        normal: &mut JointNormal<T>,
        piece: usize,
    ) -> T {
        let first_row = ROWS * piece;
        let arm = first_row / FEATURES;
        let mut block = [[T::ZERO; ROWS]; 25];
        let columns = block.get_mut(OF_ARM * arm..).unwrap_or_default();
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
                start += OF_ARM;
            }
            sum += residual.squared();
            put_row(columns, index, start, &[residual]);
        }
        let pivots = columns.len();
        normal.eliminate(columns, pivots);
        sum
    }
}

impl<T: Real> Problem<T, 24> for JointFactor<T> {
    type At = JointDisplacement<T>;
    type Rows = ();
    const GRADIENT: Option<Gradient<T, 24, Self, JointDisplacement<T>>> = Some(Self::gradient);

    fn displaced(&self, correction: &[T; 24]) -> JointDisplacement<T> {
        self.displaced(&by_arms(correction))
    }

    fn sum_of_squares(&self, at: &JointDisplacement<T>, _: usize) -> Piece<T> {
        Piece {
            sum_of_squares: self.residual_sum(at),
            more: false,
        }
    }

    fn linearize(
        &self,
        at: &JointDisplacement<T>,
        (): &mut (),
        normal: &mut JointNormal<T>,
        piece: usize,
    ) -> Piece<T> {
        let sum = T::linearize_joint(self, at, normal, piece);
        let more = ROWS * (piece + 1) < JOINT_COLUMNS - 1;
        let rest = if more {
            T::ZERO
        } else {
            self.least_sum_of_squares()
        };
        Piece {
            sum_of_squares: sum + rest,
            more,
        }
    }

    fn terms_squared(&self) -> T {
        product_of_columns(self.triangle(), JOINT_COLUMNS - 1, JOINT_COLUMNS - 1)
    }
}

impl<T: Real> Judged<T, 24> for JointFactor<T> {
    const FREE_STARTS: u8 = 1;

    #[inline(never)] // see `Iteration::linearize`
    fn free_start(&self, _: u8) -> Option<[T; 24]> {
        // A pivot of the size of its column's rounding carries no information.
        let rounding = T::from_f64(16.0) * T::EPSILON;
        let smallest = self.triangle().column_norms().map(|norm| rounding * norm);
        let coefficients = self.triangle().minimiser(&smallest)?;
        let mut correction = [T::ZERO; 24];
        let (of_arms, _) = correction.as_chunks_mut();
        for ((own, delta), nominal) in of_arms
            .iter_mut()
            .zip(coefficients.as_chunks::<FEATURES>().0)
            .zip(self.nominal_arms())
        {
            *own = T::correction(nominal, delta)?;
        }
        Some(correction)
    }

    fn extent(&self) -> Extent<T> {
        Extent {
            samples: self.samples(),
            effective_samples: self.effective_samples(),
            residuals: self.effective_samples() * T::from_f64(3.0),
            per_sample: 3,
            unit: self.noise().is_none().then(|| self.unit()),
            least_sum_of_squares: self.least_sum_of_squares(),
        }
    }

    fn rows_squared(&self) -> T {
        let [first, second, third, right] =
            [ONE, FEATURES + ONE, 2 * FEATURES + ONE, JOINT_COLUMNS - 1]
                .map(|column| product_of_columns(self.triangle(), column, column));
        first + second + third + right
    }

    fn units(&self) -> [T; 24] {
        let mut units = [T::ZERO; 24];
        let (of_arms, _) = units.as_chunks_mut();
        for (own, nominal) in of_arms.iter_mut().zip(self.nominal_arms()) {
            *own = nominal.units();
        }
        units
    }

    fn arm(&self, parameter: usize) -> &Arm<T> {
        let arms = self.nominal_arms();
        let [first, ..] = arms;
        arms.get(parameter / OF_ARM).unwrap_or(first).arm()
    }

    fn instrument_of(&self, _: usize) -> Option<Instrument> {
        None
    }
}

/// The robot at a correction fitted to these samples.
///
/// # Errors
/// [`Refusal::ImpossibleGeometry`], [`Refusal::ImpossibleRobot`] or [`Refusal::WrongSide`].
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
    check_side(&robot, [first, second, third], &means(factor))?;
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
    [0, OF_ARM, 2 * OF_ARM].map(|first| part(correction, first))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_precision_loss)]

    use super::JointNormal;
    use crate::calibration::problem::Problem;
    use crate::fixtures::{assert_close, changed, filled, gram, noises, samples};
    use nalgebra::SMatrix;

    #[test]
    fn damping_adds_the_squares_of_its_diagonal() {
        let measured = samples::<20>(&changed(11), 14);
        let factor = filled(noises()[2], &measured);
        let mut normal = JointNormal::zero();
        let at = Problem::displaced(&factor, &[0.0; 24]);
        for piece in 0..6 {
            factor.linearize(&at, &mut (), &mut normal, piece);
        }
        let mut expected: SMatrix<f64, 25, 25> = gram(&normal);
        let mut diagonal = normal.column_norms();
        for (index, entry) in diagonal.iter_mut().enumerate() {
            *entry *= 0.1 * (index as f64 + 1.0);
            expected[(index, index)] += *entry * *entry;
        }
        let mut pieces = 1;
        while factor.damp(&mut normal, |index| diagonal[index], pieces - 1) {
            pieces += 1;
        }
        assert_eq!(pieces, 6);
        assert_close(&gram(&normal), &expected, 1e-12);
    }
}
