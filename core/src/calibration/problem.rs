use super::refusal::Instrument;
use crate::Real;
use crate::robot::Arm;
use crate::samples::{Triangle, put_row};

/// A least-squares problem: weighted residuals r of N parameters, with M = N + 1 and E = M (M + 1)/2, the entries of the
/// triangle of a linearised problem. Corrections and residuals are in the problem's own units.
pub trait Problem<T: Real, const N: usize, const M: usize, const E: usize> {
    /// Values computed once per correction.
    type At: Clone;
    /// Rows of a linearisation that are kept between two of its pieces.
    type Rows: Clone;
    /// Before they are written.
    const NO_ROWS: Self::Rows;
    /// Whether a solver's step ends after each piece of a linearisation, to stay short. Otherwise the residuals have one
    /// piece.
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
    fn linearize(
        &self,
        at: &Self::At,
        rows: &mut Self::Rows,
        normal: &mut Triangle<T, M, E>,
        piece: usize,
    ) -> Piece<T>;
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
    /// How many samples there are, and the unit of their residuals.
    fn extent(&self) -> Extent<T>;
    /// A correction of 1 in the caller's units.
    fn unit_of(&self, parameter: usize) -> T;
    /// The arm to which a parameter belongs, or the first.
    fn arm(&self, parameter: usize) -> &Arm<T>;

    /// The instrument to which a parameter beyond the robot's belongs.
    fn instrument_of(&self, _parameter: usize) -> Option<Instrument> {
        None
    }
}

/// How many samples a problem has, and the unit of their residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent<T> {
    /// Number of samples added.
    pub samples: u64,
    /// The effective number of samples after forgetting or weighting.
    pub effective_samples: T,
    /// The effective number of residuals.
    pub residuals: T,
    /// The length that corresponds to a residual of 1; `None` if the residuals are in σ of a stated noise.
    pub unit: Option<T>,
}

/// Σ r² over all pieces; not finite if there is no such robot.
#[cfg(test)]
pub(crate) fn sum_of_squares<T: Real, A, const N: usize, const M: usize, const E: usize>(
    problem: &impl Problem<T, N, M, E, At = A>,
    at: &A,
) -> T {
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
    damped.absorb_four(columns);
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
