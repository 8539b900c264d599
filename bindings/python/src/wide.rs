//! Numbers and vectors of the formulas that compilers turn into vector instructions: no branch, no call.

// Coefficients are as computed.
#![allow(clippy::excessive_precision)]

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Numbers of which processors compute several at once. Every function that uses them is inlined into the one that is
/// compiled for the processor's vectors, or it would be compiled without these.
pub(crate) trait Lane:
    Copy
    + Default
    + PartialOrd
    + Send
    + Sync
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Into<f64>
{
    /// Sum of c x^k, the highest power first: (sin x − x) / x³ and (cos x − 1 + x²/2) / x⁴ over x² for x up to π/2, and
    /// (asin x − x) / x³ for x up to sin(π/8), with the smallest greatest error (Remez). Of four million numbers each, sines
    /// and cosines are within 1.2 units in the last place of 1 of libm's, angles up to π/2 within 2.5, in both types.
    const SINE: &'static [f64];
    const COSINE: &'static [f64];
    const ARCSINE: &'static [f64];
    /// A pose is this far from every singularity, as a sine.
    const CLEAR: f64;

    /// The nearest number.
    fn of(number: f64) -> Self;
    /// `self` × by + plus, in one instruction.
    fn times(self, by: Self, plus: Self) -> Self;
    fn root(self) -> Self;
    fn size(self) -> Self;
    /// With the sign changed where that of the other is negative.
    fn signed_by(self, other: Self) -> Self;

    #[inline(always)]
    fn nan() -> Self {
        Self::of(f64::NAN)
    }

    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn polynomial(self, coefficients: &[f64]) -> Self {
        // Odd and even powers are two chains, which the processor computes side by side.
        let square = self * self;
        let mut sums = [self; 2];
        for (place, own) in coefficients.iter().enumerate() {
            sums[place % 2] = match place {
                0 | 1 => Self::of(*own),
                _ => sums[place % 2].times(square, Self::of(*own)),
            };
        }
        let even = (coefficients.len() + 1) % 2;
        sums[1 - even].times(self, sums[even])
    }

    /// Sine and cosine of up to a right angle.
    #[inline(always)]
    fn sine_cosine(self) -> [Self; 2] {
        let square = self * self;
        let sine = (self * square).times(square.polynomial(Self::SINE), self);
        let first = square.times(Self::of(-0.5), Self::of(1.0));
        let cosine = (square * square).times(square.polynomial(Self::COSINE), first);
        [sine, cosine]
    }

    /// The angle of which these are sine and cosine: up to a right one, and some obtuse one for each obtuse one.
    #[inline(always)]
    fn angle_of(self, cosine: Self) -> Self {
        use std::f64::consts::{FRAC_PI_2, FRAC_PI_8};
        let height = self.size();
        let (small, large) = (height.smaller(cosine), height.larger(cosine));
        // Of angles up to 45° from half of that.
        let (sine_8, cosine_8) = FRAC_PI_8.sin_cos();
        let y = small.times(Self::of(cosine_8), large * Self::of(-sine_8));
        let square = y * y;
        let angle = (y * square).times(square.polynomial(Self::ARCSINE), y) + Self::of(FRAC_PI_8);
        let steep = Self::of(FRAC_PI_2) - angle;
        let angle = if height > cosine { steep } else { angle };
        angle.signed_by(self)
    }
}

macro_rules! lane {
    ($number:ident { $($constant:item)* }) => {
        impl Lane for $number {
            $($constant)*

            #[inline(always)]
            #[allow(clippy::cast_possible_truncation, clippy::cast_lossless, reason = "results are as exact as arguments")]
            fn of(number: f64) -> Self {
                number as $number
            }
            #[inline(always)]
            fn times(self, by: Self, plus: Self) -> Self {
                self.mul_add(by, plus)
            }
            #[inline(always)]
            fn root(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn size(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn signed_by(self, other: Self) -> Self {
                Self::from_bits(self.to_bits() ^ (other.to_bits() & Self::to_bits(-0.0)))
            }
        }
    };
}

lane! { f64 {
    const SINE: &'static [f64] = &[
        2.718_487_184_001_830e-15, -7.642_712_044_228_535e-13, 1.605_892_780_187_234_7e-10, -2.505_210_660_593_047_6e-8,
        2.755_731_920_777_890_1e-6, -1.984_126_984_118_591_1e-4, 8.333_333_333_333_114e-3, -1.666_666_666_666_666_5e-1,
    ];
    const COSINE: &'static [f64] = &[
        4.616_118_986_219_565e-14, -1.146_363_403_087_387_5e-11, 2.087_659_254_356_693e-9, -2.755_731_706_765_338e-7,
        2.480_158_728_577_603e-5, -1.388_888_888_883_001_4e-3, 4.166_666_666_666_583e-2,
    ];
    const ARCSINE: &'static [f64] = &[
        1.947_136_149_972_843_8e-2, 7.986_638_276_742_337e-3, 1.464_947_297_668_765_8e-2, 1.727_466_749_024_957_4e-2,
        2.237_765_592_503_623_2e-2, 3.038_170_789_244_929_5e-2, 4.464_286_304_065_701e-2, 7.499_999_992_484_701e-2,
        1.666_666_666_670_226_3e-1,
    ];
    const CLEAR: f64 = 0.002;
} }

lane! { f32 {
    const SINE: &'static [f64] = &[2.600_039_5e-6, -1.980_660_8e-4, 8.333_017e-3, -1.666_665_7e-1];
    const COSINE: &'static [f64] = &[-2.619_368e-7, 2.476_93e-5, -1.388_856_9e-3, 4.166_665_6e-2];
    const ARCSINE: &'static [f64] = &[4.086_22e-2, 4.314_309e-2, 7.508_478e-2, 1.666_651e-1];
    const CLEAR: f64 = 0.01;
} }

/// A vector of three.
pub(crate) type Vector<N> = [N; 3];

/// first × one + second × other + start.
#[inline(always)]
pub(crate) fn sum<N: Lane>(
    start: Vector<N>,
    first: (Vector<N>, N),
    second: (Vector<N>, N),
) -> Vector<N> {
    times(first.0, first.1, times(second.0, second.1, start))
}

/// a × by + plus.
#[inline(always)]
pub(crate) fn times<N: Lane>([a, b, c]: Vector<N>, by: N, [x, y, z]: Vector<N>) -> Vector<N> {
    [a.times(by, x), b.times(by, y), c.times(by, z)]
}

#[inline(always)]
pub(crate) fn less<N: Lane>([a, b, c]: Vector<N>, [x, y, z]: Vector<N>) -> Vector<N> {
    [a - x, b - y, c - z]
}

#[inline(always)]
pub(crate) fn dot<N: Lane>([a, b, c]: Vector<N>, [x, y, z]: Vector<N>) -> N {
    a.times(x, b.times(y, c * z))
}

#[inline(always)]
pub(crate) fn cross<N: Lane>([a, b, c]: Vector<N>, [x, y, z]: Vector<N>) -> Vector<N> {
    [
        b.times(z, -(c * y)),
        c.times(x, -(a * z)),
        a.times(y, -(b * x)),
    ]
}
