use super::free_start::{SPREAD_STARTS, free_start, spread_start};
use super::means::{Means, spread};
use super::problem::{Piece, Problem};
use crate::Real;
use crate::robot::{ArmIndex, Drive};
use crate::samples::{ArmFactor, Displacement, NominalArm, Triangle, Waiting};
use nalgebra::Vector3;

/// The triangular factor of an arm's linearised problem: eight columns ∂r/∂P and the residual r.
pub(crate) type Normal<T> = Triangle<T, 9, 45>;

/// The samples of one arm, held either way: what a solver works on. Sealed: implemented by
/// [`ArmFactor`] and by the forms of this crate that store every sample.
pub trait ArmProblem<T: Real>: Linearize<T> + Problem<T, 8, 9, 45, At = Displacement<T>> {
    /// What the samples are expressed against.
    fn nominal(&self) -> &NominalArm<T>;
}

/// The half of [`ArmProblem`] that speaks of the solver's internals.
#[allow(unreachable_pub)] // the seal: nameable by no other crate
pub trait Linearize<T: Real> {
    /// Takes the weighted rows (∂f/∂P, f) at a correction into `normal`; returns Σ (f/σf)².
    #[doc(hidden)]
    fn linearize(&self, at: &Displacement<T>, normal: &mut Normal<T>) -> T;
    /// How many samples were taken in.
    #[doc(hidden)]
    fn taken_in(&self) -> u64;
    /// The effective number of samples after forgetting.
    #[doc(hidden)]
    fn effective(&self) -> T;
    /// Takes in the block of samples that waits for this arm.
    #[doc(hidden)]
    fn absorb_waiting(&mut self, waiting: &Waiting<T>, arm: ArmIndex);
    /// Σ (f/σf)² at a correction.
    #[doc(hidden)]
    fn sum_of_squares(&self, at: &Displacement<T>) -> T;
    /// Weighted means over the samples: X and its spread in internal units, sin q and cos q.
    #[doc(hidden)]
    fn means(&self) -> Means<T>;
    /// The correction that the linear fit gives without a guess.
    #[doc(hidden)]
    fn free_start(&self) -> Option<[T; 8]>;
    /// The least Σ (f/σf)² that any coefficients whatever could leave.
    #[doc(hidden)]
    fn least_sum_of_squares(&self) -> T;
    /// Σ (1 + f(P₀)²)/σf², the squared size of what residuals are summed up from.
    #[doc(hidden)]
    fn rows_squared(&self) -> T;
    /// The squared size of the terms that a residual is summed up from: its rounding is ε times
    /// that.
    #[doc(hidden)]
    fn terms_squared(&self) -> T;
}

/// One arm's samples as a [`Problem`]. A macro, since a blanket implementation would leave no room for those of
/// other problems.
macro_rules! problem_of_an_arm {
    ($samples:ty $(, $size:ident)?) => {
        impl<T: Real $(, const $size: usize)?> Problem<T, 8, 9, 45> for $samples {
            type At = Displacement<T>;
            const PIECEWISE: bool = false;
            const RESIDUALS: u8 = 1;
            const FREE_STARTS: u8 = 1 + SPREAD_STARTS;

            fn displaced(&self, correction: &[T; 8]) -> Displacement<T> {
                Displacement::new(ArmProblem::nominal(self), correction)
            }

            fn sum_of_squares(&self, at: &Displacement<T>, _: usize) -> Piece<T> {
                Piece {
                    sum_of_squares: Linearize::sum_of_squares(self, at),
                    more: false,
                }
            }

            fn linearize(&self, at: &Displacement<T>, normal: &mut Normal<T>, _: usize) -> Piece<T> {
                Piece {
                    sum_of_squares: Linearize::linearize(self, at, normal),
                    more: false,
                }
            }

            fn damp(&self, damped: &mut Normal<T>, diagonal: &[T; 8], _: usize) -> bool {
                // As many rows as a linearisation has, so that both share one reduction.
                let mut block = [[T::ZERO; 12]; 9];
                for (index, (column, value)) in block.iter_mut().zip(diagonal).enumerate() {
                    if let Some(entry) = column.get_mut(index) {
                        *entry = *value;
                    }
                }
                damped.absorb(&mut block);
                false
            }

            fn free_start(&self, index: u8) -> Option<[T; 8]> {
                match index.checked_sub(1) {
                    None => Linearize::free_start(self),
                    Some(index) => spread_start(ArmProblem::nominal(self), &self.means(), index),
                }
            }

            fn least_sum_of_squares(&self) -> T {
                Linearize::least_sum_of_squares(self)
            }

            fn rows_squared(&self) -> T {
                Linearize::rows_squared(self)
            }

            fn terms_squared(&self) -> T {
                Linearize::terms_squared(self)
            }

            fn samples(&self) -> u64 {
                Linearize::taken_in(self)
            }

            fn effective_samples(&self) -> T {
                Linearize::effective(self)
            }

            fn noise_stated(&self) -> bool {
                ArmProblem::nominal(self).noise().is_some()
            }

            fn unit(&self) -> T {
                ArmProblem::nominal(self).scale()
            }

            fn unit_of(&self, parameter: usize) -> T {
                let units = ArmProblem::nominal(self).units();
                units.get(parameter).copied().unwrap_or(T::ONE)
            }

            fn upper_arm(&self, _: usize) -> T {
                ArmProblem::nominal(self).arm().upper_arm_length()
            }

            fn drive(&self) -> Drive {
                ArmProblem::nominal(self).arm().drive()
            }
        }
    };
}
#[cfg(any(feature = "classical", test))]
pub(crate) use problem_of_an_arm;

problem_of_an_arm!(ArmFactor<T>);

/// Columns of the features x, cos q and 1 in the factor.
const COORDINATES: usize = 0;
const COSINE: usize = 3;
const SINE: usize = 4;
const ONE: usize = 11;

impl<T: Real> ArmProblem<T> for ArmFactor<T> {
    fn nominal(&self) -> &NominalArm<T> {
        self.nominal()
    }
}

impl<T: Real> Linearize<T> for ArmFactor<T> {
    fn linearize(&self, at: &Displacement<T>, normal: &mut Normal<T>) -> T {
        let (residual, sum) = self.residual(at);
        let jacobian = at.coefficient_jacobian();
        let mut block = [[T::ZERO; 12]; 9];
        for (index, row) in self.triangle().rows().take(12).enumerate() {
            let mut product = [T::ZERO; 8];
            let below = jacobian.get(index..).unwrap_or_default();
            for (factor, derivatives) in row.iter().zip(below) {
                for (entry, derivative) in product.iter_mut().zip(derivatives) {
                    *entry += *factor * *derivative;
                }
            }
            for (column, value) in block.iter_mut().zip(product) {
                if let Some(entry) = column.get_mut(index) {
                    *entry = value;
                }
            }
        }
        let [.., last] = &mut block;
        *last = residual;
        normal.absorb(&mut block);
        sum
    }

    fn sum_of_squares(&self, at: &Displacement<T>) -> T {
        self.residual(at).1
    }

    fn free_start(&self) -> Option<[T; 8]> {
        free_start(self)
    }

    fn least_sum_of_squares(&self) -> T {
        self.least_sum_of_squares()
    }

    fn taken_in(&self) -> u64 {
        self.samples()
    }

    fn effective(&self) -> T {
        self.effective_samples()
    }

    fn absorb_waiting(&mut self, waiting: &Waiting<T>, arm: ArmIndex) {
        self.absorb_checked(waiting.block(arm));
    }

    /// RᵀR holds the sums of products of features: those with the feature 1 are weighted sums.
    fn means(&self) -> Means<T> {
        let sum = |column: usize| product_of_columns(self.triangle(), column, ONE);
        let weight = sum(ONE);
        let x = Vector3::new(sum(COORDINATES), sum(COORDINATES + 1), sum(COORDINATES + 2)) / weight;
        let squares = (COORDINATES..COSINE).fold(T::ZERO, |squares, coordinate| {
            squares + product_of_columns(self.triangle(), coordinate, coordinate)
        });
        Means {
            x,
            spread: spread(squares / weight, &x),
            sine: sum(SINE) / weight,
            cosine: sum(COSINE) / weight,
        }
    }

    /// The residual at a correction is f(P₀) and a difference that cancels it.
    fn terms_squared(&self) -> T {
        let mut sum = T::ZERO;
        for row in self.triangle().rows() {
            if let Some(entry) = row.last() {
                sum += entry.squared();
            }
        }
        sum
    }

    fn rows_squared(&self) -> T {
        // The last two columns: the feature 1 and f(P₀).
        let mut sum = T::ZERO;
        for row in self.triangle().rows() {
            for entry in row.iter().rev().take(2) {
                sum += entry.squared();
            }
        }
        sum
    }
}

/// An entry of RᵀR; `left` is not after `right`.
#[inline(never)]
pub(super) fn product_of_columns<T: Real, const M: usize, const E: usize>(
    triangle: &Triangle<T, M, E>,
    left: usize,
    right: usize,
) -> T {
    let mut sum = T::ZERO;
    for (index, row) in triangle.rows().take(left + 1).enumerate() {
        if let (Some(left), Some(right)) = (row.get(left - index), row.get(right - index)) {
            sum += *left * *right;
        }
    }
    sum
}
