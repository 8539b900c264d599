use super::free_start::{Means, SPREAD_STARTS, free_start, spread_start};
use super::problem::{Extent, Gradient, Judged, Piece, Problem};
use super::refusal::Instrument;
use crate::Real;
use crate::robot::{Arm, OF_ARM};
use crate::samples::{ArmFactor, Displacement, ONE, Triangle, Unknowns, put_row};
use nalgebra::Vector3;

/// The triangular factor of an arm's linearised problem: eight columns ∂r/∂P and the residual r.
pub(crate) type Normal<T> = Triangle<T, 8>;

/// Columns of the features x and cos q in the factor.
const COORDINATES: usize = 0;
const COSINE: usize = 3;
const SINE: usize = 4;

/// √(⟨x²⟩ − ⟨x⟩²): the rms distance from the mean.
fn spread<T: Real>(mean_square: T, mean: &Vector3<T>) -> T {
    (mean_square - mean.dot(mean)).larger(T::ZERO).square_root()
}

impl<T: Real> ArmFactor<T> {
    /// Absorbs the weighted rows (∂f/∂P, f) at a correction into `normal`; returns Σ (f/σf)².
    pub(crate) fn linearized(&self, at: &Displacement<T>, normal: &mut Normal<T>) -> T {
        let (residual, sum) = self.residual(at);
        let mut block = [[T::ZERO; 12]; 9];
        for (index, row) in self.triangle().rows().take(12).enumerate() {
            let mut features = [T::ZERO; 12];
            for (feature, entry) in features.iter_mut().skip(index).zip(row) {
                *feature = *entry;
            }
            put_row(&mut block, index, 0, &at.gradient_of(&features));
        }
        let [.., last] = &mut block;
        *last = residual;
        normal.absorb(&mut block);
        sum
    }

    /// Weighted means over the samples. RᵀR holds the sums of products of features; products with the feature 1 are
    /// weighted sums.
    pub(crate) fn means(&self) -> Means<T> {
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
}

/// The samples of one arm alone.
impl<T: Real> Problem<T, 8> for ArmFactor<T> {
    type At = Displacement<T>;
    type Rows = ();
    const GRADIENT: Option<Gradient<T, 8, Self, Displacement<T>>> = None;

    fn displaced(&self, correction: &[T; 8]) -> Displacement<T> {
        Displacement::new(self.nominal(), correction)
    }

    fn sum_of_squares(&self, at: &Displacement<T>, _: usize) -> Piece<T> {
        Piece {
            sum_of_squares: self.residual(at).1,
            more: false,
        }
    }

    fn linearize(
        &self,
        at: &Displacement<T>,
        (): &mut (),
        normal: &mut Normal<T>,
        _: usize,
    ) -> Piece<T> {
        Piece {
            sum_of_squares: T::linearize_arm(self, at, normal),
            more: false,
        }
    }

    fn damp(&self, damped: &mut Normal<T>, diagonal: impl Fn(usize) -> T, _: usize) -> bool {
        // As many rows as in a linearisation, so that both share one reduction.
        let mut block = [[T::ZERO; 12]; 9];
        for (index, column) in block.iter_mut().take(OF_ARM).enumerate() {
            if let Some(entry) = column.get_mut(index) {
                *entry = diagonal(index);
            }
        }
        T::absorb_twelve(damped, &mut block);
        false
    }

    /// The residual at a correction is f(P₀) plus a difference that cancels it.
    fn terms_squared(&self) -> T {
        let mut sum = T::ZERO;
        for row in self.triangle().rows() {
            if let Some(entry) = row.last() {
                sum += entry.squared();
            }
        }
        sum
    }
}

impl<T: Real> Judged<T, 8> for ArmFactor<T> {
    const FREE_STARTS: u8 = 1 + SPREAD_STARTS;

    fn free_start(&self, index: u8) -> Option<[T; 8]> {
        match index.checked_sub(1) {
            None => free_start(self),
            Some(index) => spread_start(self.nominal(), &self.means(), index),
        }
    }

    fn extent(&self) -> Extent<T> {
        let nominal = self.nominal();
        Extent {
            samples: self.samples(),
            effective_samples: self.effective_samples(),
            residuals: self.effective_samples(),
            per_sample: 1,
            unit: nominal.noise().is_none().then(|| nominal.scale()),
            least_sum_of_squares: self.least_sum_of_squares(),
        }
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

    fn units(&self) -> [T; 8] {
        self.nominal().units()
    }

    fn arm(&self, _: usize) -> &Arm<T> {
        self.nominal().arm()
    }

    fn instrument_of(&self, _: usize) -> Option<Instrument> {
        None
    }
}

/// An entry of RᵀR; `left` must not exceed `right`.
#[inline(never)] // 1.7 kB of joint flash
pub(super) fn product_of_columns<T: Unknowns<N>, const N: usize>(
    triangle: &Triangle<T, N>,
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
