//! Identifiability of the parameters from the triangular factor of the Jacobian.

use crate::Real;
use crate::samples::Triangle;
use core::hint::black_box;
use nalgebra::SMatrix;

/// Parameters of an arm.
const ARM: usize = 8;
/// Columns inverted together.
const COLUMNS: usize = 4;
/// Budget of a piece, as a sum of squared column lengths: further columns are started while below it.
const PIECE: usize = 350;

/// Inverts the factor's N × N part piecewise into the covariance (JᵀJ)⁻¹, in internal units, and analyses it.
#[derive(Debug, Clone)]
pub(crate) struct Identifiability<T: Real, const N: usize> {
    /// Each variance divided by the variance with all other parameters known.
    inflation: [T; N],
    /// Index of the parameter with the largest share in the weakest combination.
    pub(crate) weakest: usize,
    /// Number of columns inverted so far.
    inverted: usize,
}

impl<T: Real, const N: usize> Identifiability<T, N> {
    /// Before the first piece.
    #[allow(clippy::inline_always)] // in its place at every optimisation level: it is large
    #[inline(always)]
    pub(crate) const fn unstarted() -> Self {
        Self {
            inflation: [T::ZERO; N],
            weakest: 0,
            inverted: 0,
        }
    }

    /// Back to the state before the first piece, which clears what is left of an earlier one.
    pub(crate) const fn restart(&mut self) {
        self.inverted = 0;
    }

    /// Analyses a factor in one call, and returns its covariance.
    #[cfg(test)]
    pub(crate) fn of<const M: usize, const E: usize>(
        normal: &Triangle<T, M, E>,
    ) -> (Self, SMatrix<T, N, N>) {
        let (mut whole, mut covariance) = (Self::unstarted(), SMatrix::zeros());
        while whole.invert(normal, &mut covariance) {}
        (whole, covariance)
    }

    /// Inverts a few columns, or compares once all are inverted; returns whether there is more to do. W = T⁻¹ by
    /// columns, and W Wᵀ as the sum of their products, whose upper half mirrors the lower: symmetric to the bit.
    #[inline(never)]
    pub(crate) fn invert<const M: usize, const E: usize>(
        &mut self,
        normal: &Triangle<T, M, E>,
        covariance: &mut SMatrix<T, N, N>,
    ) -> bool {
        if self.inverted == N {
            covariance.fill_upper_triangle_with_lower_triangle();
            self.compare(normal, covariance);
            return false;
        }
        let mut cost = 0;
        if self.inverted == 0 {
            covariance.as_mut_slice().fill(T::ZERO);
        }
        while self.inverted < N && cost < PIECE {
            // The first piece may have fewer.
            self.inverted += (N - self.inverted - 1) % COLUMNS + 1;
            let mut columns = [[T::ZERO; COLUMNS]; N];
            let columns = columns.get_mut(..self.inverted).unwrap_or_default();
            normal.invert(columns, covariance.as_mut_slice());
            cost += self.inverted * self.inverted;
        }
        true
    }

    /// An exactly singular or non-finite factor has infinite inflation.
    fn compare<const M: usize, const E: usize>(
        &mut self,
        normal: &Triangle<T, M, E>,
        covariance: &SMatrix<T, N, N>,
    ) {
        // The columns of the parameters; the last is the residual, which may be zero.
        let norms = normal.column_norms();
        let mut largest = T::ZERO;
        for (index, ((inflation, norm), variance)) in self
            .inflation
            .iter_mut()
            .zip(norms)
            .zip(covariance.as_slice().iter().step_by(N + 1))
            .enumerate()
        {
            let scaled = *variance * norm.squared();
            *inflation = if scaled.finite() && norm > T::ZERO {
                scaled
            } else {
                T::INFINITY
            };
            if *inflation > largest {
                largest = *inflation;
                self.weakest = index;
            }
        }
        if !largest.finite() {
            self.weakest = weakest_of_singular::<T, N, M, E>(normal, &norms);
        }
    }

    /// ‖A‖‖A⁻¹‖/8 in Frobenius norms, A = J with columns of unit length, for a problem of one arm; for several arms one
    /// figure per arm, whose mean square is that of all.
    pub(crate) fn condition(&self, arm: usize) -> T {
        let mut total = T::ZERO;
        for inflation in self.inflation.iter().skip(ARM * arm).take(ARM) {
            total += *inflation;
        }
        (total / T::from_f64(8.0)).square_root()
    }

    /// The largest condition number of any arm, or of eight unknowns after the arms.
    pub(crate) fn largest_condition(&self) -> T {
        let mut largest = T::ZERO;
        for arm in 0..N.div_ceil(ARM) {
            largest = largest.larger(self.condition(arm));
        }
        largest
    }

    /// The combination of parameters, of unit length in internal units, that the samples determine least: three steps
    /// of inverse iteration on JᵀJ.
    #[inline(never)]
    pub(crate) fn weakest_direction(&self, covariance: &SMatrix<T, N, N>) -> [T; N] {
        let mut direction = [T::ZERO; N];
        if let Some(entry) = direction.get_mut(self.weakest) {
            *entry = T::ONE;
        }
        // Hidden from the optimiser, which would unroll the loop: these four places would cost 2 KB of firmware.
        for _ in 0..black_box(3) {
            let mut product = [T::ZERO; N];
            for (column, part) in covariance.as_slice().chunks_exact(N).zip(direction) {
                add_multiple(column, part, &mut product);
            }
            let squared = product
                .iter()
                .fold(T::ZERO, |sum, part| sum + part.squared());
            let length = squared.square_root();
            if !(length > T::ZERO && length.finite()) {
                return [T::ZERO; N];
            }
            direction = product.map(|part| part / length);
        }
        direction
    }
}

/// The parameter with the largest share, times its column's norm, in the combination that leaves the residuals
/// unchanged: T y = 0 with y = 1 at T's first vanishing pivot.
#[cold]
#[inline(never)]
fn weakest_of_singular<T: Real, const N: usize, const M: usize, const E: usize>(
    normal: &Triangle<T, M, E>,
    norms: &[T; M],
) -> usize {
    let vanishes = |index: usize| {
        let pivot = normal.row(index).first().copied().unwrap_or(T::ZERO);
        !(T::ONE / pivot.squared()).finite()
    };
    let Some(first) = (0..black_box(N)).find(|index| vanishes(*index)) else {
        return 0;
    };
    let mut combination = [T::ZERO; N];
    if let Some(part) = combination.get_mut(first) {
        *part = T::ONE;
    }
    normal.complete_column(combination.get_mut(..=first).unwrap_or_default());
    let mut weakest = (first, norms.get(first).copied().unwrap_or(T::ZERO));
    for (index, (part, norm)) in combination.iter().zip(norms).enumerate() {
        let scaled = part.magnitude() * *norm;
        if scaled > weakest.1 {
            weakest = (index, scaled);
        }
    }
    weakest.0
}

/// Adds a multiple of one vector to another.
#[inline(never)]
fn add_multiple<T: Real>(vector: &[T], factor: T, to: &mut [T]) {
    for (sum, entry) in to.iter_mut().zip(vector) {
        *sum += *entry * factor;
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_precision_loss, clippy::float_cmp, clippy::unwrap_used)]

    use crate::calibration::arm_problem::Normal;
    use crate::calibration::joint_problem::JointNormal;
    use crate::calibration::minimizer::determined_parameters;
    use nalgebra::{SMatrix, SVector};
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg32;

    type Identifiability = super::Identifiability<f64, 8>;

    /// A Jacobian of twenty rows whose columns differ in length, and its triangle.
    fn jacobian(seed: u64) -> (SMatrix<f64, 20, 8>, Normal<f64>) {
        let mut rng = Pcg32::seed_from_u64(seed);
        let mut uniform = || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
        let mut matrix = SMatrix::<f64, 20, 8>::zeros();
        for (column, length) in [1.0, 3.0, 0.1, 2.0, 0.5, 7.0, 1.5, 0.2]
            .into_iter()
            .enumerate()
        {
            for entry in &mut matrix.column_mut(column) {
                *entry = uniform() * length;
            }
        }
        let mut normal = Normal::zero();
        for row in matrix.row_iter() {
            let mut block = [[0.0]; 9];
            for (column, value) in block.iter_mut().zip(row.iter()) {
                *column = [*value];
            }
            block[8] = [uniform()];
            normal.absorb(&mut block);
        }
        (matrix, normal)
    }

    #[test]
    fn covariance_and_condition_are_those_of_the_inverse() {
        for seed in 0..100 {
            let (matrix, normal) = jacobian(seed);
            let (found, inverse) = Identifiability::of(&normal);
            let information = matrix.transpose() * matrix;
            let covariance = information.try_inverse().unwrap();
            // Rounding of the normal equations, with a condition number of about 1e4.
            assert!((inverse - covariance).amax() < 1e-10 * covariance.amax());
            assert_eq!(inverse, inverse.transpose());

            let mut unit = matrix;
            for mut column in unit.column_iter_mut() {
                column.normalize_mut();
            }
            let scaled = unit.transpose() * unit;
            let inverse = scaled.try_inverse().unwrap();
            // ‖A‖² = tr AᵀA = 8, ‖A⁻¹‖² = tr (AᵀA)⁻¹.
            let condition = (scaled.trace() * inverse.trace()).sqrt() / 8.0;
            assert!((found.condition(0) / condition - 1.0).abs() < 1e-10);
            assert_eq!(found.weakest, inverse.diagonal().imax());
        }
    }

    #[test]
    fn the_weakest_direction_is_that_of_the_least_singular_value() {
        let mut decided = 0;
        for seed in 0..100 {
            let (matrix, normal) = jacobian(seed);
            let information = matrix.transpose() * matrix;
            let eigen = information.symmetric_eigen();
            let least = eigen.eigenvalues.imin();
            let (found, inverse) = Identifiability::of(&normal);
            let direction = SVector::from(found.weakest_direction(&inverse));
            assert!((direction.norm() - 1.0).abs() < 1e-14);
            let mut others = eigen.eigenvalues;
            others[least] = f64::INFINITY;
            // Three steps of inverse iteration reduce the other components by (λ/λ′)³.
            let left = (eigen.eigenvalues[least] / others.min()).powi(3);
            let along = eigen.eigenvectors.column(least).dot(&direction).abs();
            let across = (1.0 - along * along).max(0.0).sqrt();
            let started = eigen.eigenvectors.column(least)[found.weakest].abs();
            assert!(across <= left / started + 1e-7, "{across} {left}");
            decided += u32::from(left < 0.05);
        }
        assert!(decided > 30, "{decided}");
    }

    #[test]
    fn a_prior_takes_its_share_of_the_parameters() {
        for seed in 0..20 {
            let (matrix, mut normal) = jacobian(seed);
            let prior = [0.3, 1.0, 0.5, 2.0, 0.0, 4.0, 0.1, 0.7];
            let mut block = [[0.0; 8]; 9];
            for (index, weight) in prior.into_iter().enumerate() {
                block[index][index] = weight;
            }
            normal.absorb(&mut block);
            let (_, inverse) = Identifiability::of(&normal);
            let covariance = inverse.as_slice();
            let found = determined_parameters::<_, _, 8, 9, 45>(&prior, &[0.0; 8], 1.0, covariance);
            // The trace of the map from true to estimated parameters.
            let information = matrix.transpose() * matrix;
            let mut with_prior = information;
            for (index, weight) in prior.into_iter().enumerate() {
                with_prior[(index, index)] += weight * weight;
            }
            let expected = (with_prior.try_inverse().unwrap() * information).trace();
            assert!((found - expected).abs() < 1e-11, "{found} {expected}");
        }
    }

    #[test]
    fn a_parameter_without_any_influence_makes_the_condition_infinite() {
        let diagonal = |entry: f64| {
            let mut values = [2.0; 8];
            values[3] = entry;
            Identifiability::of(&Normal::from_diagonal(&values, &[1.0; 8]))
        };
        // Orthogonal columns of any length.
        let (orthogonal, _) = diagonal(0.5);
        assert!((orthogonal.condition(0) - 1.0).abs() < 1e-15);
        let (singular, inverse) = diagonal(0.0);
        assert!(singular.condition(0).is_infinite());
        assert_eq!(singular.weakest, 3);
        let direction = singular.weakest_direction(&inverse);
        assert!(direction.iter().all(|part| part.abs() < 1e-30));
    }

    /// The second column equals the first: exactly singular, although no column is zero. The second depends on the
    /// first and is named, although the last column is the shortest.
    #[test]
    fn equal_columns_make_the_condition_infinite() {
        let mut normal = Normal::<f64>::zero();
        for row in 0..8 {
            let mut block = [[0.0]; 9];
            block[row] = [if row == 7 { 1e-3 } else { 1.0 }];
            if row == 0 {
                block[1] = [1.0];
            }
            if row != 1 {
                normal.absorb(&mut block);
            }
        }
        let (found, _) = Identifiability::of(&normal);
        assert!(found.condition(0).is_infinite());
        assert_eq!(found.weakest, 1);
    }

    /// Two columns are dependent, a ∂/∂p = b ∂/∂q with unit columns otherwise: (p, −q) changes no residual, and one of
    /// these two parameters must be named, wherever they are.
    #[test]
    fn of_a_singular_problem_a_parameter_of_the_open_combination_is_the_weakest() {
        for first in 0..8 {
            for second in first + 1..8 {
                let mut normal = Normal::<f64>::zero();
                for row in (0..8).filter(|row| *row != second) {
                    let mut block = [[0.0]; 9];
                    block[row] = [1.0];
                    if row == first {
                        block[second] = [0.5];
                    }
                    normal.absorb(&mut block);
                }
                let (found, _) = Identifiability::of(&normal);
                assert!(found.condition(0).is_infinite());
                let weakest = found.weakest;
                assert!(
                    [first, second].contains(&weakest),
                    "{first} {second} {weakest}"
                );
            }
        }
        // (1, 1, −3) with unit columns: the third has the largest share.
        let mut normal = Normal::<f64>::zero();
        for row in (0..8).filter(|row| *row != 4) {
            let mut block = [[0.0]; 9];
            block[row] = [1.0];
            block[4] = [match row {
                2 => 1.0,
                3 => 3.0,
                _ => 0.0,
            }];
            normal.absorb(&mut block);
        }
        // Column 4 is c₂ + 3 c₃, of length √10; the shares times the lengths are 1, 3 and √10.
        assert_eq!(Identifiability::of(&normal).0.weakest, 4);
        let mut normal = Normal::<f64>::zero();
        for row in (0..8).filter(|row| *row != 5) {
            let mut block = [[0.0]; 9];
            block[row] = [1.0];
            if row == 1 {
                // Columns 1 and 6 are nearly equal; 5 is their difference and small.
                block[6] = [1.0];
            }
            if row == 6 {
                block[6] = [0.1];
                block[5] = [0.1];
            }
            normal.absorb(&mut block);
        }
        // c₅ = c₆ − c₁: shares 1, 1 and −1, lengths 0.1, 1.005 and 1.
        assert_eq!(Identifiability::of(&normal).0.weakest, 6);
    }

    /// c₃ = c₂ − c₁ with c₁ and c₂ nearly equal: c₃'s pivot vanishes, but the shares times the lengths of the columns
    /// are 1, 1.008 and 0.125, and the largest is that of c₂.
    #[test]
    fn of_a_singular_problem_the_longest_part_is_named_and_not_the_column_that_vanishes() {
        let mut normal = Normal::<f64>::zero();
        for row in (0..8).filter(|row| *row != 3) {
            let mut block = [[0.0]; 9];
            block[row] = [if row == 2 { 0.125 } else { 1.0 }];
            if row == 1 {
                block[2] = [1.0];
            }
            if row == 2 {
                block[3] = [0.125];
            }
            normal.absorb(&mut block);
        }
        let (found, _) = Identifiability::of(&normal);
        assert!(found.condition(0).is_infinite());
        assert_eq!(found.weakest, 2);
        // A pivot whose inverse overflows when squared counts as zero.
        let mut values = [2.0; 8];
        values[5] = 1e-160;
        let vanishing = Normal::from_diagonal(&values, &[1.0; 8]);
        assert_eq!(Identifiability::of(&vanishing).0.weakest, 5);
    }

    /// If one of 24 parameters depends on another of its own arm, that parameter is the weakest, and its arm's
    /// condition number is infinite.
    #[test]
    fn of_three_arms_the_one_with_a_dependent_column_is_found() {
        for (dependent, on) in [(5, 2), (14, 9), (23, 16)] {
            let mut normal = JointNormal::<f64>::zero();
            for row in (0..24).filter(|row| *row != dependent) {
                let mut block = [[0.0]; 25];
                block[row] = [1.0 + row as f64];
                if row == on {
                    block[dependent] = [0.5];
                }
                normal.eliminate(&mut block, 25);
            }
            let (found, _) = super::Identifiability::<f64, 24>::of(&normal);
            assert_eq!(found.weakest, dependent);
            assert!(found.condition(dependent / 8).is_infinite());
            assert!(found.largest_condition().is_infinite());
        }
    }
}
