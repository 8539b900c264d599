use super::refusal::Instrument;
use crate::Real;
use crate::robot::Drive;
use crate::samples::{Triangle, put_row};

/// What a [`Minimizer`](super::Minimizer) works on: weighted residuals r of N parameters, M = N + 1, and
/// E = M (M + 1)/2 the numbers of the triangle of a linearised problem. Corrections and residuals are in
/// the problem's own units.
///
/// Implemented for the three arms' samples each by itself ([`ArmFactor`](crate::samples::ArmFactor)), for the
/// samples of all arms together, and by whoever has other
/// residuals of the 24 parameters.
pub trait Problem<T: Real, const N: usize, const M: usize, const E: usize> {
    /// What is computed once for each correction.
    type At: Clone;
    /// Whether a solver's step ends after each piece of a linearisation, so that it stays short.
    const PIECEWISE: bool;
    /// Whether a [`gradient`](Self::gradient) costs so little beside a linearisation that chord steps pay.
    const CHORDS: bool = false;
    /// Residuals of a sample.
    const RESIDUALS: u8;
    /// How many starts without a guess there are.
    const FREE_STARTS: u8;

    /// The parameters at a correction of the nominal ones.
    fn displaced(&self, correction: &[T; N]) -> Self::At;
    /// A piece of Σ r²; not finite where there is no such robot.
    fn sum_of_squares(&self, at: &Self::At, piece: usize) -> Piece<T>;
    /// Takes a piece of the rows (∂r/∂P, r) into `normal`, the first of piece 0.
    fn linearize(&self, at: &Self::At, normal: &mut Triangle<T, M, E>, piece: usize) -> Piece<T>;
    /// ½ ∂Σr²/∂P, for chord steps.
    fn gradient(&self, _at: &Self::At) -> [T; N] {
        [T::ZERO; N]
    }

    /// Takes a piece of the rows of a diagonal matrix into a triangle; whether there are more.
    fn damp(&self, damped: &mut Triangle<T, M, E>, diagonal: &[T; N], piece: usize) -> bool {
        damp_rows(damped, diagonal, piece)
    }
    /// A correction from which to start without a guess, the best first; `None` if the samples do not give
    /// that one.
    fn free_start(&self, index: u8) -> Option<[T; N]>;
    /// A sum of squares that no parameters undercut.
    fn least_sum_of_squares(&self) -> T;
    /// The squared size of the rows that the residuals are summed up from.
    fn rows_squared(&self) -> T;
    /// The squared size of the terms that a residual is summed up from: its rounding is ε times that.
    fn terms_squared(&self) -> T;
    /// How many samples were taken in.
    fn samples(&self) -> u64;
    /// The effective number of samples after forgetting or weighting.
    fn effective_samples(&self) -> T;
    /// Whether the residuals are in σ of a stated noise.
    fn noise_stated(&self) -> bool;
    /// The length of a residual of 1 if no noise is stated.
    fn unit(&self) -> T;
    /// What a correction of 1 is in the caller's units.
    fn unit_of(&self, parameter: usize) -> T;
    /// The length of the upper arm that a parameter belongs to.
    fn upper_arm(&self, parameter: usize) -> T;
    /// What stands at the places of an arm's eight parameters.
    fn drive(&self) -> Drive;

    /// Whose place a parameter belongs to that is none of the robot's.
    fn instrument_of(&self, _parameter: usize) -> Option<Instrument> {
        None
    }

    /// The effective number of residuals.
    fn residuals(&self) -> T {
        self.effective_samples() * T::from_count(u64::from(Self::RESIDUALS))
    }
}

/// Σ r², all pieces together; not finite where there is no such robot.
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

/// Rows of a diagonal that are reduced in one piece.
const ROWS: usize = 4;

/// A piece of the rows of a diagonal matrix, four rows of N; whether there are more.
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
    /// Whether there are more.
    pub more: bool,
}

/// What is known of the parameters beside the samples: a cost |r(δ)|² of the correction δ, which is weighted by the
/// variance of the residuals. Where r = U δ the cost is quadratic; U = ∂r/∂δ in any case.
pub trait Prior<T: Real, const N: usize, const M: usize, const E: usize>: Clone {
    /// Puts the rows (σ U, σ r) at a correction in place of a triangle.
    fn put_rows(&self, sigma: T, correction: &[T; N], rows: &mut Triangle<T, M, E>);
    /// The same by itself.
    fn rows(&self, sigma: T, correction: &[T; N]) -> Triangle<T, M, E> {
        let mut rows = Triangle::zero();
        self.put_rows(sigma, correction, &mut rows);
        rows
    }
    /// |r|².
    fn cost(&self, correction: &[T; N]) -> T;
    /// Uᵀr.
    fn gradient(&self, correction: &[T; N]) -> [T; N];
    /// The correction after a step, which may lead along a curve that r follows.
    fn advanced(&self, correction: &[T; N], step: &[T; N]) -> [T; N] {
        let mut advanced = *correction;
        for (value, delta) in advanced.iter_mut().zip(step) {
            *value += *delta;
        }
        advanced
    }
    /// How many combinations of parameters it says nothing of.
    fn unheld(&self) -> usize;
    /// Each parameter's distance from nominal, in tolerances.
    fn distances(&self, correction: &[T; N]) -> [T; N];
    /// (UᵀU C)ⱼⱼ: the part of each parameter that the prior decides at a correction, C the covariance of all, by columns.
    fn shares(&self, correction: &[T; N], covariance: &[T]) -> [T; N];
}

/// 1/tolerance of each parameter in the problem's units; zero without a tolerance.
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
