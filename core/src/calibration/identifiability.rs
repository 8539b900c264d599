//! What the triangular factor of the Jacobian says about the parameters.

use crate::Real;
use crate::samples::Triangle;
use core::hint::black_box;
use nalgebra::SMatrix;

/// Parameters of an arm.
const ARM: usize = 8;
/// Columns that are inverted together.
const COLUMNS: usize = 4;
/// How long the columns of a piece may be, squared and summed up; columns more are begun before.
const PIECE: usize = 350;

/// The inverse of the factor's N × N part, some columns at a time, and what it tells.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Identifiability<T: Real, const N: usize> {
    /// (JᵀJ)⁻¹ in internal units.
    pub(crate) covariance: SMatrix<T, N, N>,
    /// Each variance over what it would be if the other parameters were known.
    inflation: [T; N],
    /// Index of the parameter with the largest part in the weakest combination.
    pub(crate) weakest: usize,
    /// How many columns are inverted.
    inverted: usize,
}

impl<T: Real, const N: usize> Identifiability<T, N> {
    /// Before the first piece.
    pub(crate) fn unstarted() -> Self {
        Self {
            covariance: SMatrix::zeros(),
            inflation: [T::ZERO; N],
            weakest: 0,
            inverted: 0,
        }
    }

    /// As before the first piece, which clears what is left of an earlier one.
    pub(crate) const fn restart(&mut self) {
        self.inverted = 0;
    }

    /// Of a factor, in one go.
    #[cfg(test)]
    pub(crate) fn of<const M: usize, const E: usize>(normal: &Triangle<T, M, E>) -> Self {
        let mut whole = Self::unstarted();
        while whole.invert(normal) {}
        whole
    }

    /// Inverts a few columns; whether there are more to do. W = T⁻¹ by columns, and W Wᵀ as the sum of
    /// their products, whose upper half is that below the diagonal: symmetric to the bit.
    #[inline(never)]
    pub(crate) fn invert<const M: usize, const E: usize>(
        &mut self,
        normal: &Triangle<T, M, E>,
    ) -> bool {
        let mut cost = 0;
        if self.inverted == 0 {
            self.covariance.as_mut_slice().fill(T::ZERO);
        }
        while self.inverted < N && cost < PIECE {
            // The first may be fewer.
            self.inverted += (N - self.inverted - 1) % COLUMNS + 1;
            let mut columns = [[T::ZERO; COLUMNS]; N];
            let columns = columns.get_mut(..self.inverted).unwrap_or_default();
            normal.inverse_columns(columns);
            add_square(columns, self.covariance.as_mut_slice(), N);
            cost += self.inverted * self.inverted;
        }
        if self.inverted < N {
            return true;
        }
        self.covariance.fill_upper_triangle_with_lower_triangle();
        self.compare(normal);
        false
    }

    /// An exactly singular or not finite factor inflates infinitely.
    fn compare<const M: usize, const E: usize>(&mut self, normal: &Triangle<T, M, E>) {
        // The parameters' columns; the last is the residual, which may well be zero.
        let norms = normal.column_norms();
        let mut largest = T::ZERO;
        for (index, ((inflation, norm), variance)) in self
            .inflation
            .iter_mut()
            .zip(norms)
            .zip(self.covariance.as_slice().iter().step_by(N + 1))
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

    /// ‖A‖‖A⁻¹‖/8 in Frobenius norms, A = J with columns of unit length, if the problem is one arm's; of
    /// several arms that of each, whose mean square is that of all.
    pub(crate) fn condition(&self, arm: usize) -> T {
        let mut total = T::ZERO;
        for inflation in self.inflation.iter().skip(ARM * arm).take(ARM) {
            total += *inflation;
        }
        (total / T::from_f64(8.0)).square_root()
    }

    /// The condition of the arm, or of eight unknowns behind the arms, that has the largest.
    pub(crate) fn largest_condition(&self) -> T {
        let mut largest = T::ZERO;
        for arm in 0..N.div_ceil(ARM) {
            largest = largest.larger(self.condition(arm));
        }
        largest
    }

    /// The combination of parameters, of unit length in internal units, that the samples determine
    /// least: three steps of inverse iteration on JᵀJ.
    #[inline(never)]
    pub(crate) fn weakest_direction(&self) -> [T; N] {
        let mut direction = [T::ZERO; N];
        if let Some(entry) = direction.get_mut(self.weakest) {
            *entry = T::ONE;
        }
        // Hidden from the optimiser, which would write the step out three times.
        for _ in 0..black_box(3) {
            let mut product = [T::ZERO; N];
            for (column, part) in self.covariance.as_slice().chunks_exact(N).zip(direction) {
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

/// The parameter with the largest part, times its column's norm, in the combination that leaves the
/// residuals as they are: T y = 0 with y = 1 where T's first vanishing pivot is.
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
    // Hidden from the optimiser, which would write out the rows one after another.
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

/// Adds V Vᵀ to the lower half of a matrix of that many rows given by columns. V is given by rows, which may
/// be fewer, zeros behind them.
#[inline(never)]
fn add_square<T: Real, const K: usize>(mut v: &[[T; K]], matrix: &mut [T], rows: usize) {
    for (index, column) in matrix.chunks_exact_mut(rows).enumerate() {
        let Some((own, below)) = v.split_first() else {
            return;
        };
        let column = column.get_mut(index..).unwrap_or_default();
        for (sum, other) in column.iter_mut().zip(v) {
            for (a, b) in own.iter().zip(other) {
                *sum += *a * *b;
            }
        }
        v = below;
    }
}

/// Adds a multiple of one vector to another.
#[inline(never)]
fn add_multiple<T: Real>(vector: &[T], factor: T, to: &mut [T]) {
    for (sum, entry) in to.iter_mut().zip(vector) {
        *sum += *entry * factor;
    }
}

#[cfg(test)]
mod tests;
