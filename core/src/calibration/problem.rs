use super::free_start::free_start;
use crate::Real;
use crate::robot::ArmIndex;
use crate::samples::{ArmFactor, Displacement, NominalArm, Triangle, Waiting};
use nalgebra::Vector3;

/// The triangular factor of an arm's linearised problem: eight columns ∂r/∂P and the residual r.
pub(crate) type Normal<T> = Triangle<T, 9, 45>;

/// The samples of one arm, held either way: what a solver works on. Sealed: implemented by
/// [`ArmFactor`] and by the forms of this crate that store every sample.
pub trait ArmProblem<T: Real>: Linearize<T> {
    /// What the samples are expressed against.
    fn nominal(&self) -> &NominalArm<T>;
    /// How many samples were taken in.
    fn samples(&self) -> u64;
    /// The effective number of samples after forgetting.
    fn effective_samples(&self) -> T;
}

/// The half of [`ArmProblem`] that speaks of the solver's internals.
#[allow(unreachable_pub)] // the seal: nameable by no other crate
pub trait Linearize<T: Real> {
    /// Takes the weighted rows (∂f/∂P, f) at a correction into `normal`; returns Σ (f/σf)².
    #[doc(hidden)]
    fn linearize(&self, at: &Displacement<T>, normal: &mut Normal<T>) -> T;
    /// Takes in the block of samples that waits for this arm.
    #[doc(hidden)]
    fn absorb_waiting(&mut self, waiting: &Waiting<T>, arm: ArmIndex);
    /// Σ (f/σf)² at a correction.
    #[doc(hidden)]
    fn sum_of_squares(&self, at: &Displacement<T>) -> T;
    /// Weighted means over the samples: X in internal units, sin q and cos q.
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

/// The mean sample of an arm.
#[allow(unreachable_pub)] // part of the seal
#[derive(Debug, Clone, Copy)]
pub struct Means<T: Real> {
    pub(crate) x: Vector3<T>,
    pub(crate) sine: T,
    pub(crate) cosine: T,
}

/// Columns of the features x, cos q and 1 in the factor.
const COORDINATES: usize = 0;
const COSINE: usize = 3;
const SINE: usize = 4;
const ONE: usize = 11;

impl<T: Real> ArmProblem<T> for ArmFactor<T> {
    fn nominal(&self) -> &NominalArm<T> {
        self.nominal()
    }
    fn samples(&self) -> u64 {
        self.samples()
    }
    fn effective_samples(&self) -> T {
        self.effective_samples()
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

    fn absorb_waiting(&mut self, waiting: &Waiting<T>, arm: ArmIndex) {
        self.absorb_checked(waiting.block(arm));
    }

    /// RᵀR holds the sums of products of features: those with the feature 1 are weighted sums.
    fn means(&self) -> Means<T> {
        let sum = |column: usize| product_of_columns(self.triangle(), column, ONE);
        let weight = sum(ONE);
        Means {
            x: Vector3::new(sum(COORDINATES), sum(COORDINATES + 1), sum(COORDINATES + 2)) / weight,
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
fn product_of_columns<T: Real>(triangle: &Triangle<T, 13, 91>, left: usize, right: usize) -> T {
    let mut sum = T::ZERO;
    for index in 0..=left {
        let row = triangle.row(index);
        if let (Some(left), Some(right)) = (row.get(left - index), row.get(right - index)) {
            sum += *left * *right;
        }
    }
    sum
}
