//! Array lengths that follow from a number of unknowns.

use crate::Real;
use core::fmt::Debug;

/// A scalar with the arrays of a least-squares problem in N unknowns: `Real` and, for N up to 72, always implemented.
///
/// Their lengths are those that Rust cannot compute from N in a type: N + 1 columns, one an unknown and the residuals',
/// and the (N + 1)(N + 2)/2 numbers of a triangle with as many rows.
pub trait Unknowns<const N: usize>: Real {
    /// An entry for each column.
    type Columns<C: Copy + Debug>: AsRef<[C]> + AsMut<[C]> + Clone + Debug;
    /// The numbers of a triangle.
    type Triangle: AsRef<[Self]> + AsMut<[Self]> + Clone + Debug + PartialEq;
    /// A triangle of zeros.
    const ZEROS: Self::Triangle;

    /// The same entry for each column.
    fn columns<C: Copy + Debug>(entry: C) -> Self::Columns<C>;
}

macro_rules! unknowns {
    ($($n:literal)+) => { $(
        impl<T: Real> Unknowns<$n> for T {
            type Columns<C: Copy + Debug> = [C; $n + 1];
            type Triangle = [T; ($n + 1) * ($n + 2) / 2];
            const ZEROS: Self::Triangle = [T::ZERO; ($n + 1) * ($n + 2) / 2];

            #[inline(always)]
            fn columns<C: Copy + Debug>(entry: C) -> [C; $n + 1] {
                [entry; $n + 1]
            }
        }
    )+ };
}

unknowns! {
    1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32
    33 34 35 36 37 38 39 40 41 42 43 44 45 46 47 48 49 50 51 52 53 54 55 56 57 58 59 60 61 62 63 64
    65 66 67 68 69 70 71 72
}
