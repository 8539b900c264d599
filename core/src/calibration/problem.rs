use super::refusal::Instrument;
use crate::Real;
use crate::robot::Drive;
use crate::samples::{Triangle, put_row};

/// A least-squares problem: weighted residuals r of N parameters, with M = N + 1 and E = M (M + 1)/2, the entries of the
/// triangle of a linearised problem. Corrections and residuals are in the problem's own units.
pub trait Problem<T: Real, const N: usize, const M: usize, const E: usize> {
    /// Values computed once per correction.
    type At: Clone;
    /// Whether a solver's step ends after each piece of a linearisation, to stay short.
    const PIECEWISE: bool;
    /// Whether a [`gradient`](Self::gradient) is cheap enough compared to a linearisation for chord steps to pay off.
    const CHORDS: bool = false;
    /// Residuals per sample.
    const RESIDUALS: u8;
    /// Number of free starts available.
    const FREE_STARTS: u8;

    /// The parameters at a correction of the nominal parameters.
    fn displaced(&self, correction: &[T; N]) -> Self::At;
    /// One piece of Σ r²; not finite if there is no such robot.
    fn sum_of_squares(&self, at: &Self::At, piece: usize) -> Piece<T>;
    /// Absorbs one piece of the rows (∂r/∂P, r) into `normal`, which piece 0 resets.
    fn linearize(&self, at: &Self::At, normal: &mut Triangle<T, M, E>, piece: usize) -> Piece<T>;
    /// ½ ∂Σr²/∂P, for chord steps.
    fn gradient(&self, _at: &Self::At) -> [T; N] {
        [T::ZERO; N]
    }

    /// Absorbs a piece of the rows of a diagonal matrix into a triangle; returns whether there are more.
    fn damp(&self, damped: &mut Triangle<T, M, E>, diagonal: &[T; N], piece: usize) -> bool {
        damp_rows(damped, diagonal, piece)
    }
    /// A correction from which to start without an initial guess, the best first; `None` if the samples do not
    /// determine it.
    fn free_start(&self, index: u8) -> Option<[T; N]>;
    /// A lower bound of the sum of squares over all parameters.
    fn least_sum_of_squares(&self) -> T;
    /// The squared size of the rows from which the residuals are summed.
    fn rows_squared(&self) -> T;
    /// The squared size of the terms from which a residual is summed: its rounding is ε times the size.
    fn terms_squared(&self) -> T;
    /// Number of samples added.
    fn samples(&self) -> u64;
    /// The effective number of samples after forgetting or weighting.
    fn effective_samples(&self) -> T;
    /// Whether the residuals are in σ of a stated noise.
    fn noise_stated(&self) -> bool;
    /// The length that corresponds to a residual of 1 if no noise is stated.
    fn unit(&self) -> T;
    /// A correction of 1 in the caller's units.
    fn unit_of(&self, parameter: usize) -> T;
    /// The length of the upper arm to which a parameter belongs.
    fn upper_arm(&self, parameter: usize) -> T;
    /// The drive, which defines the places of an arm's eight parameters.
    fn drive(&self) -> Drive;

    /// The instrument to which a parameter beyond the robot's belongs.
    fn instrument_of(&self, _parameter: usize) -> Option<Instrument> {
        None
    }

    /// The effective number of residuals.
    fn residuals(&self) -> T {
        self.effective_samples() * T::from_count(u64::from(Self::RESIDUALS))
    }
}

/// Σ r² over all pieces; not finite if there is no such robot.
pub(crate) fn sum_of_squares<T, P, const N: usize, const M: usize, const E: usize>(
    problem: &P,
    at: &P::At,
) -> T
where
    T: Real,
    P: Problem<T, N, M, E>,
{
    let mut sum = T::ZERO;
    for piece in 0.. {
        let done = problem.sum_of_squares(at, piece);
        sum += done.sum_of_squares;
        if !done.more {
            break;
        }
    }
    sum
}

/// Rows of a diagonal reduced in one piece.
const ROWS: usize = 4;

/// Absorbs a piece of a diagonal matrix, four rows of N; returns whether there are more.
#[inline(never)]
fn damp_rows<T: Real, const N: usize, const M: usize, const E: usize>(
    damped: &mut Triangle<T, M, E>,
    diagonal: &[T; N],
    piece: usize,
) -> bool {
    let first = ROWS * piece;
    let mut block = [[T::ZERO; ROWS]; M];
    let columns = block.get_mut(first..).unwrap_or_default();
    for (index, value) in diagonal.iter().skip(first).take(ROWS).enumerate() {
        put_row(columns, index, index, &[*value]);
    }
    let pivots = columns.len();
    damped.eliminate(columns, pivots);
    first + ROWS < diagonal.len()
}

/// A piece of a linearisation, or of a sum of squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece<T> {
    /// Σ r² of its rows.
    pub sum_of_squares: T,
    /// Whether more pieces follow.
    pub more: bool,
}

/// Prior knowledge of the parameters: a cost |r(δ)|² of the correction δ, weighted by the variance of the residuals. If
/// r = U δ the cost is quadratic; in any case U = ∂r/∂δ.
pub trait Prior<T: Real, const N: usize, const M: usize, const E: usize>: Clone {
    /// Overwrites a triangle with the rows (σ U, σ r) at a correction.
    fn put_rows(&self, sigma: T, correction: &[T; N], rows: &mut Triangle<T, M, E>);
    /// The same, as a new triangle.
    fn rows(&self, sigma: T, correction: &[T; N]) -> Triangle<T, M, E> {
        let mut rows = Triangle::zero();
        self.put_rows(sigma, correction, &mut rows);
        rows
    }
    /// |r|².
    fn cost(&self, correction: &[T; N]) -> T;
    /// Uᵀr.
    fn gradient(&self, correction: &[T; N]) -> [T; N];
    /// The correction after a step, which may follow a curve if r is not linear.
    fn advanced(&self, correction: &[T; N], step: &[T; N]) -> [T; N] {
        let mut advanced = *correction;
        for (value, delta) in advanced.iter_mut().zip(step) {
            *value += *delta;
        }
        advanced
    }
    /// Number of parameter combinations it does not constrain.
    fn unheld(&self) -> usize;
    /// Each parameter's distance from nominal, in tolerances.
    fn distances(&self, correction: &[T; N]) -> [T; N];
    /// (UᵀU C)ⱼⱼ: the share of each parameter decided by the prior at a correction. `covariance`: C, by columns.
    fn shares(&self, correction: &[T; N], covariance: &[T]) -> [T; N];
}

/// 1/tolerance of each parameter in the problem's units; 0 without a tolerance.
impl<T: Real, const N: usize, const M: usize, const E: usize> Prior<T, N, M, E> for [T; N] {
    fn put_rows(&self, sigma: T, correction: &[T; N], rows: &mut Triangle<T, M, E>) {
        let weights = self.map(|weight| weight * sigma);
        let mut rights = [T::ZERO; N];
        for ((right, weight), delta) in rights.iter_mut().zip(&weights).zip(correction) {
            *right = *weight * *delta;
        }
        rows.set_diagonal(&weights, &rights);
    }

    #[inline(never)]
    fn cost(&self, correction: &[T; N]) -> T {
        let mut sum = T::ZERO;
        for (weight, delta) in self.iter().zip(correction) {
            sum += (*weight * *delta).squared();
        }
        sum
    }

    fn gradient(&self, correction: &[T; N]) -> [T; N] {
        let mut gradient = *self;
        for (weight, delta) in gradient.iter_mut().zip(correction) {
            *weight = *weight * *weight * *delta;
        }
        gradient
    }

    fn unheld(&self) -> usize {
        self.iter().filter(|weight| **weight == T::ZERO).count()
    }

    fn distances(&self, correction: &[T; N]) -> [T; N] {
        let mut distances = *self;
        for (weight, delta) in distances.iter_mut().zip(correction) {
            *weight = (*weight * *delta).magnitude();
        }
        distances
    }

    fn shares(&self, _: &[T; N], covariance: &[T]) -> [T; N] {
        let mut shares = *self;
        for (weight, variance) in shares.iter_mut().zip(covariance.iter().step_by(N + 1)) {
            *weight = weight.squared() * *variance;
        }
        shares
    }
}
