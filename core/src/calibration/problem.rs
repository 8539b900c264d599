use super::refusal::Instrument;
use crate::robot::{Arm, OF_ROBOT};
use crate::samples::{Triangle, Unknowns, put_row};

/// Computes the gradient of a problem's sum of squares.
pub(crate) type Gradient<T, const N: usize, P, A> = fn(&P, &A) -> [T; N];

/// A least-squares problem: weighted residuals r of N parameters, in pieces that each fit into a short step.
/// Corrections and residuals are in the problem's own units.
pub(crate) trait Problem<T: Unknowns<N>, const N: usize> {
    /// Values computed once per correction.
    type At: Clone;
    /// Rows of a linearisation that are kept between two of its pieces.
    type Rows: Clone + Default;
    /// ½ ∂Σr²/∂P, for chord steps; `None` if it would cost about as much as a linearisation.
    const GRADIENT: Option<Gradient<T, N, Self, Self::At>>;

    /// The parameters at a correction of the nominal parameters.
    fn displaced(&self, correction: &[T; N]) -> Self::At;
    /// One piece of Σ r²; not finite if there is no such robot.
    fn sum_of_squares(&self, at: &Self::At, piece: usize) -> Piece<T>;
    /// Absorbs one piece of the rows (∂r/∂P, r) into `normal`.
    fn linearize(
        &self,
        at: &Self::At,
        rows: &mut Self::Rows,
        normal: &mut Triangle<T, N>,
        piece: usize,
    ) -> Piece<T>;
    /// The squared size of the terms from which a residual is summed: its rounding is ε times the size.
    fn terms_squared(&self) -> T;

    /// Absorbs a piece of the rows of a diagonal matrix into a triangle; returns whether there are more.
    fn damp(
        &self,
        damped: &mut Triangle<T, N>,
        diagonal: impl Fn(usize) -> T,
        piece: usize,
    ) -> bool {
        // Of more unknowns than a robot has, four rows take longer than a short step.
        if N > OF_ROBOT {
            damp_rows(damped, diagonal, piece, T::absorb_two)
        } else {
            damp_rows(damped, diagonal, piece, T::absorb_four)
        }
    }
}

/// A problem whose starts are found and whose solution is judged.
pub(crate) trait Judged<T: Unknowns<N>, const N: usize>: Problem<T, N> {
    /// Number of free starts available.
    const FREE_STARTS: u8;

    /// A correction from which to start without an initial guess, the best first; `None` if the samples do not
    /// determine it.
    fn free_start(&self, index: u8) -> Option<[T; N]>;
    /// What the samples amount to.
    fn extent(&self) -> Extent<T>;
    /// The squared size of the rows from which the residuals are summed.
    fn rows_squared(&self) -> T;
    /// A sum of squares below this is rounding: (32ε)² times the rows that the residuals come from.
    fn rounding_of_cost(&self) -> T {
        self.rows_squared() * (T::from_f64(32.0) * T::EPSILON).squared()
    }
    /// A correction of 1 of each parameter in the caller's units.
    fn units(&self) -> [T; N];
    /// The arm to which a parameter belongs, or the first.
    fn arm(&self, parameter: usize) -> &Arm<T>;
    /// The instrument to which a parameter beyond the robot's belongs.
    fn instrument_of(&self, parameter: usize) -> Option<Instrument>;
}

/// How many samples a problem has, and the size and unit of their residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent<T> {
    /// Number of samples added.
    pub(crate) samples: u64,
    /// The effective number of samples after forgetting or weighting.
    pub(crate) effective_samples: T,
    /// The effective number of residuals.
    pub(crate) residuals: T,
    /// Residuals per sample.
    pub(crate) per_sample: u8,
    /// The length that corresponds to a residual of 1; `None` if the residuals are in σ of a stated noise.
    pub(crate) unit: Option<T>,
    /// A lower bound of the sum of squares over all parameters.
    pub(crate) least_sum_of_squares: T,
}

/// Σ r² over all pieces; not finite if there is no such robot.
#[cfg(test)]
pub(crate) fn sum_of_squares<T: Unknowns<N>, A, const N: usize>(
    problem: &impl Problem<T, N, At = A>,
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

/// Absorbs a piece of a diagonal matrix, K rows of N; returns whether there are more.
fn damp_rows<T: Unknowns<N>, const N: usize, const K: usize>(
    damped: &mut Triangle<T, N>,
    diagonal: impl Fn(usize) -> T,
    piece: usize,
    absorb: fn(&mut [T], &mut [[T; K]], usize),
) -> bool {
    let first = K * piece;
    let mut block = T::columns([T::ZERO; K]);
    let columns = block.as_mut().get_mut(first..).unwrap_or_default();
    for index in 0..K.min(N.saturating_sub(first)) {
        put_row(columns, index, index, &[diagonal(first + index)]);
    }
    let pivots = columns.len();
    absorb(damped.entries_from(pivots), columns, pivots);
    first + K < N
}

/// A piece of a linearisation, or of a sum of squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece<T> {
    /// Σ r² of its rows.
    pub(crate) sum_of_squares: T,
    /// Whether more pieces follow.
    pub(crate) more: bool,
}
