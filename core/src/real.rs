//! The scalar type of every computation: `f32` or `f64`.
//!
//! [`Real`] names each transcendental function once, so that host and target run the same code and produce the same
//! bits. Nothing else in this crate computes a sine or a square root.

mod single;

use crate::kernels::Kernels;
use core::fmt::{Debug, Display};
use nalgebra::{Field, Scalar};

/// A floating-point scalar, implemented only for `f32` and `f64`.
///
/// Addition, multiplication, division and square root are correctly rounded on every platform; the other functions come
/// from `libm` (or, for single-precision sine and cosine, from this crate), never from the platform's mathematics
/// library. Every result of this crate is therefore bit-identical on an x86-64 host and on a Cortex-M.
///
/// ```
/// use delta_cal::Real;
/// let (sine, cosine) = 0.5_f32.sine_cosine();
/// assert!((sine * sine + cosine * cosine - 1.0).abs() < 2.0 * f32::EPSILON);
/// ```
pub trait Real:
    Kernels + Field + Scalar + Copy + PartialOrd + Debug + Display + Default + Send + Sync
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// 2.
    const TWO: Self;
    /// ½.
    const HALF: Self;
    /// π.
    const PI: Self;
    /// Distance from 1 to the next larger number.
    const EPSILON: Self;
    /// Positive infinity.
    const INFINITY: Self;
    /// Smallest square whose inverse is finite and whose root is accurate: the smallest normal number divided by ε.
    const SMALLEST_SQUARE: Self;
    /// Range of a σ: its square, and sums of squares divided by it, neither overflow nor vanish.
    const SIGMAS: [Self; 2];
    /// Bytes of a number: 4 or 8.
    const BYTES: usize;

    /// The bits of the number; single precision uses the lower half.
    fn bit_pattern(self) -> u64;
    /// The number with these bits.
    fn from_bit_pattern(bits: u64) -> Self;
    /// The nearest representable number.
    fn from_f64(value: f64) -> Self;
    /// The same number in double precision (exact).
    fn to_f64(self) -> f64;
    /// The nearest representable number; a sample count above 2²⁴ rounds in single precision.
    fn from_count(count: u64) -> Self;
    /// Whether the number is neither infinite nor NaN.
    fn finite(self) -> bool;
    /// |x|.
    fn magnitude(self) -> Self;
    /// √x; NaN for a negative number.
    fn square_root(self) -> Self;
    /// 1/√x for normal positive x, within 2.5 ULP. Not finite in single precision if x is infinite or NaN.
    fn inverse_square_root(self) -> Self;
    /// (sin x, cos x), x in radians, within 1 ULP (near a zero of either, within 2⁻³⁵). In single precision, NaN if |x|
    /// exceeds 8192.
    fn sine_cosine(self) -> (Self, Self);
    /// The angle of the point (x, y) from the x axis, in (−π, π]: `y.angle_over(x)` = atan2(y, x).
    fn angle_over(self, x: Self) -> Self;
    /// Natural logarithm.
    fn natural_logarithm(self) -> Self;
    /// The nearest integer, halves away from zero.
    fn nearest_integer(self) -> Self;
    /// The largest power of two not above |x| (for a normal number): multiplying by it, or
    /// dividing by it, rounds nothing.
    fn power_of_two_below(self) -> Self;

    /// The larger number; `self` if `other` is NaN.
    fn larger(self, other: Self) -> Self {
        if other > self { other } else { self }
    }

    /// x².
    fn squared(self) -> Self {
        self * self
    }
}

fn inverse_square_root(x: f64) -> f64 {
    1.0 / square_root(x)
}

#[cfg(not(target_arch = "wasm32"))]
fn square_root(x: f64) -> f64 {
    libm::sqrt(x)
}

/// An instruction with the same bits, in place of libm's hundred.
#[cfg(target_arch = "wasm32")]
#[target_feature(enable = "simd128")]
fn square_root(x: f64) -> f64 {
    use core::arch::wasm32::{f64x2_extract_lane, f64x2_splat, f64x2_sqrt};
    f64x2_extract_lane::<0>(f64x2_sqrt(f64x2_splat(x)))
}

/// Implements the scalar by its bits, those of its exponent, the range of a σ, and its functions.
macro_rules! real {
    (
        $scalar:ident, $bits:ident, $exponent:literal, $sigmas:expr,
        $root:path, $inverse_root:path, $sine_cosine:path,
        $magnitude:path, $angle:path, $logarithm:path, $round:path
    ) => {
        // Counts and numbers round, as documented; the upper half of a single number's bits is empty.
        #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation)]
        impl Real for $scalar {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const TWO: Self = 2.0;
            const HALF: Self = 0.5;
            const PI: Self = core::$scalar::consts::PI;
            const EPSILON: Self = Self::EPSILON;
            const INFINITY: Self = Self::INFINITY;
            const SMALLEST_SQUARE: Self = Self::MIN_POSITIVE / <Self as Real>::EPSILON;
            const SIGMAS: [Self; 2] = $sigmas;
            const BYTES: usize = size_of::<Self>();

            fn bit_pattern(self) -> u64 {
                u64::from(self.to_bits())
            }
            fn from_bit_pattern(bits: u64) -> Self {
                Self::from_bits(bits as $bits)
            }
            fn from_f64(value: f64) -> Self {
                value as Self
            }
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            fn from_count(count: u64) -> Self {
                count as Self
            }
            fn finite(self) -> bool {
                self.is_finite()
            }
            fn magnitude(self) -> Self {
                $magnitude(self)
            }
            fn square_root(self) -> Self {
                $root(self)
            }
            fn inverse_square_root(self) -> Self {
                $inverse_root(self)
            }
            #[inline]
            fn sine_cosine(self) -> (Self, Self) {
                $sine_cosine(self)
            }
            fn angle_over(self, x: Self) -> Self {
                $angle(self, x)
            }
            fn natural_logarithm(self) -> Self {
                $logarithm(self)
            }
            fn nearest_integer(self) -> Self {
                $round(self)
            }
            fn power_of_two_below(self) -> Self {
                Self::from_bits(self.to_bits() & $exponent)
            }
        }
    };
}

real!(
    f64,
    u64,
    0x7ff0_0000_0000_0000,
    [1e-140, 1e140],
    square_root,
    inverse_square_root,
    libm::sincos,
    libm::fabs,
    libm::atan2,
    libm::log,
    libm::round
);
real!(
    f32,
    u32,
    0x7f80_0000,
    [1e-15, 1e12],
    single::square_root,
    single::inverse_square_root,
    single::sine_cosine,
    libm::fabsf,
    libm::atan2f,
    libm::logf,
    libm::roundf
);
