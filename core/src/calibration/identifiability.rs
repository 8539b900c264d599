//! Identifiability of the parameters from the triangular factor of the Jacobian.

use crate::Real;
use crate::robot::OF_ARM;
use crate::samples::{Triangle, Unknowns, squares};
use nalgebra::SMatrix;

/// Columns inverted together.
const COLUMNS: usize = 4;
/// Budget of a piece, as a sum of squared column lengths: further columns are started while below it.
const PIECE: usize = 350;
/// The products of longer columns are added in two pieces, each of which inverts them.
const LONGEST: usize = 28;

/// Inverts the factor's N × N part piecewise into the covariance (JᵀJ)⁻¹, in internal units, and analyses it.
#[derive(Debug, Clone)]
pub(crate) struct Identifiability<T: Real, const N: usize> {
    /// Each variance divided by the variance with all other parameters known.
    inflation: [T; N],
    /// Index of the parameter with the largest share in the weakest combination.
    pub(crate) weakest: usize,
    /// How far it is: 0 before the covariance is cleared, then 1 and two for each column inverted, and one if the first
    /// half of the next products is added, or after the last column the comparison made.
    done: usize,
}

impl<T: Unknowns<N>, const N: usize> Identifiability<T, N> {
    /// Before the first piece.
    #[inline(always)]
    pub(crate) const fn unstarted() -> Self {
        Self {
            inflation: [T::ZERO; N],
            weakest: 0,
            done: 0,
        }
    }

    /// Back to the state before the first piece, which clears what is left of an earlier one.
    pub(crate) const fn restart(&mut self) {
        self.done = 0;
    }

    /// Analyses a factor in one call, and returns its covariance.
    #[cfg(test)]
    pub(crate) fn of(normal: &Triangle<T, N>) -> (Self, SMatrix<T, N, N>) {
        let (mut whole, mut covariance) = (Self::unstarted(), SMatrix::zeros());
        while whole.invert(normal, &mut covariance) {}
        (whole, covariance)
    }

    /// Inverts a few columns, or compares once all are inverted; returns whether there is more to do. W = T⁻¹ by
    /// columns, and W Wᵀ as the sum of their products, whose upper half mirrors the lower: symmetric to the bit.
    pub(crate) fn invert(
        &mut self,
        normal: &Triangle<T, N>,
        covariance: &mut SMatrix<T, N, N>,
    ) -> bool {
        let Some(done) = self.done.checked_sub(1) else {
            covariance.as_mut_slice().fill(T::ZERO);
            self.done = 1;
            return true;
        };
        let (mut inverted, mut half) = (done / 2, done % 2 == 1);
        if inverted == N && half {
            return false;
        }
        if inverted == N {
            covariance.fill_upper_triangle_with_lower_triangle();
            self.compare(normal, covariance);
            // What comes next has a step of its own.
            self.done += 1;
            return true;
        }
        let mut cost = 0;
        while inverted < N && cost < PIECE {
            // The first piece may have fewer.
            let length = inverted + (N - inverted - 1) % COLUMNS + 1;
            let mut columns = [[T::ZERO; COLUMNS]; N];
            let columns = columns.get_mut(..length).unwrap_or_default();
            let rows = match (length > LONGEST, half) {
                (false, _) => 0..length,
                (true, false) => 0..length / 3,
                (true, true) => length / 3..length,
            };
            half = rows.end < length;
            cost += length * length;
            if !half {
                inverted = length;
            }
            normal.invert(columns, covariance.as_mut_slice(), rows);
        }
        self.done = 1 + 2 * inverted + usize::from(half);
        true
    }

    /// An exactly singular or non-finite factor has infinite inflation.
    fn compare(&mut self, normal: &Triangle<T, N>, covariance: &SMatrix<T, N, N>) {
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
            self.weakest = weakest_of_singular(normal, &norms);
        }
    }

    /// ‖A‖‖A⁻¹‖/8 in Frobenius norms, A = J with columns of unit length, for a problem of one arm; for several arms one
    /// figure per arm, whose mean square is that of all.
    pub(crate) fn condition(&self, arm: usize) -> T {
        let mut total = T::ZERO;
        for inflation in self.inflation.iter().skip(OF_ARM * arm).take(OF_ARM) {
            total += *inflation;
        }
        (total / T::from_count(OF_ARM as u64)).square_root()
    }

    /// The largest condition number of any arm, or of eight unknowns after the arms.
    pub(crate) fn largest_condition(&self) -> T {
        let mut largest = T::ZERO;
        for arm in 0..N.div_ceil(OF_ARM) {
            largest = largest.larger(self.condition(arm));
        }
        largest
    }

    /// The combination of parameters, of unit length in internal units, that the samples determine least: three steps
    /// of inverse iteration on JᵀJ.
    pub(crate) fn weakest_direction(&self, covariance: &SMatrix<T, N, N>) -> [T; N] {
        let mut direction = [T::ZERO; N];
        if let Some(entry) = direction.get_mut(self.weakest) {
            *entry = T::ONE;
        }
        for _ in 0..3 {
            let mut product = [T::ZERO; N];
            for (column, part) in covariance
                .as_slice()
                .as_chunks::<N>()
                .0
                .iter()
                .zip(direction)
            {
                T::add_multiple(&mut product, part, column);
            }
            let length = squares(&product).square_root();
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
fn weakest_of_singular<T: Unknowns<N>, const N: usize>(
    normal: &Triangle<T, N>,
    norms: &[T; N],
) -> usize {
    let vanishes = |index: usize| {
        let pivot = normal.row(index).first().copied().unwrap_or(T::ZERO);
        !(T::ONE / pivot.squared()).finite()
    };
    let Some(first) = (0..N).find(|index| vanishes(*index)) else {
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

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_precision_loss, clippy::float_cmp, clippy::unwrap_used)]

    use crate::calibration::arm_problem::Normal;
    use crate::calibration::joint_problem::JointNormal;
    use crate::fixtures::linearized;
    use nalgebra::{SMatrix, SVector};

    type Identifiability = super::Identifiability<f64, 8>;
    /// Row, column, value.
    type Entry = (usize, usize, f64);

    #[test]
    fn covariance_and_condition_are_those_of_the_inverse() {
        for seed in 0..100 {
            let (matrix, _, normal) = linearized(seed);
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
            let (matrix, _, normal) = linearized(seed);
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

    /// The identity, with an entry (row, column) of another value where one is listed.
    fn changed(entries: &[Entry]) -> (Identifiability, SMatrix<f64, 8, 8>) {
        let mut normal = Normal::<f64>::zero();
        for row in 0..8 {
            let mut block = [[0.0]; 9];
            block[row] = [1.0];
            for (_, column, value) in entries.iter().filter(|(own, ..)| *own == row) {
                block[*column] = [*value];
            }
            normal.absorb(&mut block);
        }
        Identifiability::of(&normal)
    }

    /// Of dependent columns, the parameter with the largest share times the length of its column is named.
    #[test]
    fn of_a_singular_problem_the_longest_part_of_the_open_combination_is_named() {
        // Orthogonal columns of any length.
        let (orthogonal, _) = changed(&[(3, 3, 0.5)]);
        assert!((orthogonal.condition(0) - 1.0).abs() < 1e-15);
        let cases: [(&[Entry], usize); 6] = [
            (&[(3, 3, 0.0)], 3),
            // A pivot whose inverse overflows when squared counts as zero.
            (&[(5, 5, 1e-160)], 5),
            // Equal columns: the second depends on the first, although the last is the shortest.
            (&[(0, 1, 1.0), (1, 1, 0.0), (7, 7, 1e-3)], 1),
            // c₄ = c₂ + 3 c₃: the shares times the lengths are 1, 3 and √10.
            (&[(2, 4, 1.0), (3, 4, 3.0), (4, 4, 0.0)], 4),
            // c₅ = c₆ − c₁ with c₁ and c₆ nearly equal: lengths 0.1, 1.005 and 1.
            (&[(1, 6, 1.0), (5, 5, 0.0), (6, 6, 0.1), (6, 5, 0.1)], 6),
            // c₃ = c₂ − c₁: c₃'s pivot vanishes; 1, 1.008 and 0.125.
            (&[(1, 2, 1.0), (2, 2, 0.125), (2, 3, 0.125), (3, 3, 0.0)], 2),
        ];
        for (entries, weakest) in cases {
            let (found, _) = changed(entries);
            // Infinite, but for rounding.
            assert!(found.condition(0) > 1e12);
            assert_eq!(found.weakest, weakest);
        }
        let (singular, inverse) = changed(&[(3, 3, 0.0)]);
        let direction = singular.weakest_direction(&inverse);
        assert!(direction.iter().all(|part| part.abs() < 1e-30));
        // Two dependent columns, wherever they are.
        for first in 0..8 {
            for second in first + 1..8 {
                let (found, _) = changed(&[(first, second, 0.5), (second, second, 0.0)]);
                assert!(found.condition(0).is_infinite());
                assert!([first, second].contains(&found.weakest));
            }
        }
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
