//! As many numbers as the processor computes with in one instruction, and vectors of them.

// Coefficients are as computed.
#![allow(clippy::excessive_precision)]

use pulp::Simd;
use pulp::bytemuck::{Pod, cast_slice, cast_slice_mut};
use std::ops::{Add, BitAnd, Div, Mul, Neg, Range, Sub};

/// A type of numbers that processors compute several of at once.
pub(crate) trait Lane: Pod + Default + Mul<Output = Self> + Send + Sync {
    /// Numbers of several poses.
    type Many<S: Simd>: Pod;
    /// What holds of which of them.
    type Mask<S: Simd>: Copy;

    /// Sum of c x^k, the highest power first: (sin x − x) / x³ and (cos x − 1 + x²/2) / x⁴ over x² for x up to π/2, and
    /// (asin x − x) / x³ for x up to sin(π/8), with the smallest greatest error (Remez). Of four million numbers each, sines
    /// and cosines are within 1.2 units in the last place of 1 of libm's, angles up to π within 2.5, in both types.
    const SINE: &'static [f64];
    const COSINE: &'static [f64];
    const ARCSINE: &'static [f64];
    /// Added to a small number, leaves the nearest whole number in the lowest bits.
    const WHOLE: f64;
    /// π, and what this type leaves of it.
    const PI: [f64; 2];
    /// A pose is this far from every singularity, as a sine.
    const CLEAR: f64;

    /// The nearest number.
    fn of(number: f64) -> Self;
    fn all<S: Simd>(simd: S, number: Self) -> Self::Many<S>;
    fn add<S: Simd>(simd: S, one: Self::Many<S>, other: Self::Many<S>) -> Self::Many<S>;
    fn sub<S: Simd>(simd: S, one: Self::Many<S>, other: Self::Many<S>) -> Self::Many<S>;
    fn mul<S: Simd>(simd: S, one: Self::Many<S>, other: Self::Many<S>) -> Self::Many<S>;
    fn div<S: Simd>(simd: S, one: Self::Many<S>, other: Self::Many<S>) -> Self::Many<S>;
    fn xor<S: Simd>(simd: S, one: Self::Many<S>, other: Self::Many<S>) -> Self::Many<S>;
    fn and<S: Simd>(simd: S, one: Self::Many<S>, other: Self::Many<S>) -> Self::Many<S>;
    fn min<S: Simd>(simd: S, one: Self::Many<S>, other: Self::Many<S>) -> Self::Many<S>;
    fn max<S: Simd>(simd: S, one: Self::Many<S>, other: Self::Many<S>) -> Self::Many<S>;
    fn neg<S: Simd>(simd: S, one: Self::Many<S>) -> Self::Many<S>;
    fn abs<S: Simd>(simd: S, one: Self::Many<S>) -> Self::Many<S>;
    fn sqrt<S: Simd>(simd: S, one: Self::Many<S>) -> Self::Many<S>;
    fn sum<S: Simd>(simd: S, all: Self::Many<S>) -> Self;
    fn times<S: Simd>(
        simd: S,
        one: Self::Many<S>,
        by: Self::Many<S>,
        plus: Self::Many<S>,
    ) -> Self::Many<S>;
    fn above<S: Simd>(simd: S, one: Self::Many<S>, other: Self::Many<S>) -> Self::Mask<S>;
    fn both<S: Simd>(simd: S, one: Self::Mask<S>, other: Self::Mask<S>) -> Self::Mask<S>;
    fn choose<S: Simd>(
        simd: S,
        mask: Self::Mask<S>,
        yes: Self::Many<S>,
        no: Self::Many<S>,
    ) -> Self::Many<S>;
    fn is_nan(self) -> bool;
}

macro_rules! lane {
    ($number:ident $many:ident $mask:ident { $($constant:item)* } $splat:ident
     $($binary:ident $of_two:ident),*; $($unary:ident $of_one:ident),*;
     $sum:ident $times:ident $above:ident $both:ident $choose:ident) => {
        impl Lane for $number {
            type Many<S: Simd> = S::$many;
            type Mask<S: Simd> = S::$mask;
            $($constant)*

            #[inline(always)]
            #[allow(clippy::cast_possible_truncation, clippy::cast_lossless, reason = "results are as exact as arguments")]
            fn of(number: f64) -> Self {
                number as $number
            }
            #[inline(always)]
            fn all<S: Simd>(simd: S, number: Self) -> S::$many {
                simd.$splat(number)
            }
            $(#[inline(always)]
            fn $binary<S: Simd>(simd: S, one: S::$many, other: S::$many) -> S::$many {
                simd.$of_two(one, other)
            })*
            $(#[inline(always)]
            fn $unary<S: Simd>(simd: S, one: S::$many) -> S::$many {
                simd.$of_one(one)
            })*
            #[inline(always)]
            fn sum<S: Simd>(simd: S, all: S::$many) -> Self {
                simd.$sum(all)
            }
            #[inline(always)]
            fn times<S: Simd>(simd: S, one: S::$many, by: S::$many, plus: S::$many) -> S::$many {
                simd.$times(one, by, plus)
            }
            #[inline(always)]
            fn above<S: Simd>(simd: S, one: S::$many, other: S::$many) -> S::$mask {
                simd.$above(one, other)
            }
            #[inline(always)]
            fn both<S: Simd>(simd: S, one: S::$mask, other: S::$mask) -> S::$mask {
                simd.$both(one, other)
            }
            #[inline(always)]
            fn choose<S: Simd>(simd: S, mask: S::$mask, yes: S::$many, no: S::$many) -> S::$many {
                simd.$choose(mask, yes, no)
            }
            #[inline(always)]
            fn is_nan(self) -> bool {
                self.is_nan()
            }
        }
    };
}

lane! { f64 f64s m64s {
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
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    const PI: [f64; 2] = [std::f64::consts::PI, 1.224_646_799_147_353_2e-16];
    const CLEAR: f64 = 0.002;
} splat_f64s add add_f64s, sub sub_f64s, mul mul_f64s, div div_f64s, xor xor_f64s, and and_f64s, min min_f64s, max max_f64s;
  neg neg_f64s, abs abs_f64s, sqrt sqrt_f64s;
  reduce_sum_f64s mul_add_e_f64s greater_than_f64s and_m64s select_f64s }

lane! { f32 f32s m32s {
    const SINE: &'static [f64] = &[2.600_039_5e-6, -1.980_660_8e-4, 8.333_017e-3, -1.666_665_7e-1];
    const COSINE: &'static [f64] = &[-2.619_368e-7, 2.476_93e-5, -1.388_856_9e-3, 4.166_665_6e-2];
    const ARCSINE: &'static [f64] = &[4.086_22e-2, 4.314_309e-2, 7.508_478e-2, 1.666_651e-1];
    const WHOLE: f64 = 12_582_912.0;
    const PI: [f64; 2] = [3.141_592_741_012_573_2, -8.742_278_000_372_48e-8];
    const CLEAR: f64 = 0.01;
} splat_f32s add add_f32s, sub sub_f32s, mul mul_f32s, div div_f32s, xor xor_f32s, and and_f32s, min min_f32s, max max_f32s;
  neg neg_f32s, abs abs_f32s, sqrt sqrt_f32s;
  reduce_sum_f32s mul_add_e_f32s greater_than_f32s and_m32s select_f32s }

/// Numbers of several poses.
#[derive(Clone, Copy)]
pub(crate) struct Wide<S: Simd, N: Lane>(pub(crate) S, pub(crate) N::Many<S>);

/// What holds of which of them.
#[derive(Clone, Copy)]
pub(crate) struct Which<S: Simd, N: Lane>(S, N::Mask<S>);

impl<S: Simd, N: Lane> BitAnd for Which<S, N> {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0, N::both(self.0, self.1, other.1))
    }
}

/// Operators between numbers of several poses, and with one number.
macro_rules! operators {
    ($($operator:ident $name:ident),*) => {$(
        impl<S: Simd, N: Lane> $operator for Wide<S, N> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(self.0, <N as Lane>::$name(self.0, self.1, other.1))
            }
        }

        impl<S: Simd, N: Lane> $operator<f64> for Wide<S, N> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: f64) -> Self {
                Self(self.0, <N as Lane>::$name(self.0, self.1, N::all(self.0, N::of(other))))
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);

impl<S: Simd, N: Lane> Neg for Wide<S, N> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0, N::neg(self.0, self.1))
    }
}

impl<S: Simd, N: Lane> Wide<S, N> {
    /// The same number for all.
    #[inline(always)]
    pub(crate) fn all(simd: S, number: f64) -> Self {
        Self::one(simd, N::of(number))
    }

    #[inline(always)]
    pub(crate) fn one(simd: S, number: N) -> Self {
        Self(simd, N::all(simd, number))
    }

    /// Some rows of columns.
    #[inline(always)]
    pub(crate) fn load<const COUNT: usize, const ROWS: usize>(
        simd: S,
        columns: &[[N; ROWS]; COUNT],
        rows: Range<usize>,
    ) -> [Self; COUNT] {
        let mut found = [Self::all(simd, 0.0); COUNT];
        for place in 0..COUNT {
            found[place].1 = cast_slice(&columns[place][rows.clone()])[0];
        }
        found
    }

    #[inline(always)]
    pub(crate) fn store(self, into: &mut [N]) {
        cast_slice_mut(into)[0] = self.1;
    }

    /// `self` × by + plus, in one instruction where there is one.
    #[inline(always)]
    pub(crate) fn times(self, by: Self, plus: Self) -> Self {
        Self(self.0, N::times(self.0, self.1, by.1, plus.1))
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        Self(self.0, N::abs(self.0, self.1))
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self(self.0, N::sqrt(self.0, self.1))
    }

    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        Self(self.0, N::min(self.0, self.1, other.1))
    }

    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        Self(self.0, N::max(self.0, self.1, other.1))
    }

    #[inline(always)]
    pub(crate) fn above(self, other: Self) -> Which<S, N> {
        Which(self.0, N::above(self.0, self.1, other.1))
    }

    /// `self` where it holds, `other` elsewhere.
    #[inline(always)]
    pub(crate) fn where_it(self, holds: Which<S, N>, other: Self) -> Self {
        Self(self.0, N::choose(self.0, holds.1, self.1, other.1))
    }

    /// With the sign changed where that of the other is negative.
    #[inline(always)]
    pub(crate) fn signed_by(self, other: Self) -> Self {
        let Self(simd, own) = self;
        let sign = N::and(simd, other.1, Self::all(simd, -0.0).1);
        Self(simd, N::xor(simd, own, sign))
    }

    #[inline(always)]
    fn polynomial(self, coefficients: &[f64]) -> Self {
        // Odd and even powers are two chains, which the processor computes side by side.
        let square = self * self;
        let mut sums = [self; 2];
        for (place, own) in coefficients.iter().enumerate() {
            let own = Self::all(self.0, *own);
            sums[place % 2] = match place {
                0 | 1 => own,
                _ => sums[place % 2].times(square, own),
            };
        }
        let even = (coefficients.len() + 1) % 2;
        sums[1 - even].times(self, sums[even])
    }

    /// Sine and cosine of up to some turns: of what is left of half turns.
    #[inline(always)]
    pub(crate) fn sine_cosine(self) -> [Self; 2] {
        let all = |number| Self::all(self.0, number);
        let [pi, rest] = N::PI;
        let halves = self.times(all(1.0 / pi), all(N::WHOLE)) - N::WHOLE;
        let rest = halves.times(all(-rest), halves.times(all(-pi), self));
        // Of an odd number of half turns −1.
        let turns = halves.times(all(0.5), all(N::WHOLE)) - N::WHOLE;
        let odd = turns.times(all(-2.0), halves).abs();
        let sign = odd.times(all(-2.0), all(1.0));
        let square = rest * rest;
        let sine = (rest * square).times(square.polynomial(N::SINE), rest);
        let half = square.times(all(-0.5), all(1.0));
        let cosine = (square * square).times(square.polynomial(N::COSINE), half);
        [sine * sign, cosine * sign]
    }

    /// The angle of which these are sine and cosine.
    #[inline(always)]
    pub(crate) fn angle_of(self, cosine: Self) -> Self {
        use std::f64::consts::{FRAC_PI_2, FRAC_PI_8, PI};
        let all = |number| Self::all(self.0, number);
        let (height, width) = (self.abs(), cosine.abs());
        let (small, large) = (height.min(width), height.max(width));
        // Of angles up to 45° from half of that.
        let (sine_8, cosine_8) = FRAC_PI_8.sin_cos();
        let y = small.times(all(cosine_8), large * -sine_8);
        let square = y * y;
        let angle = (y * square).times(square.polynomial(N::ARCSINE), y) + FRAC_PI_8;
        let angle = (all(FRAC_PI_2) - angle).where_it(height.above(width), angle);
        let angle = (all(PI) - angle).where_it(all(0.0).above(cosine), angle);
        angle.signed_by(self)
    }
}

/// Whether any of these is NaN.
#[inline(always)]
pub(crate) fn any_nan<S: Simd, N: Lane>(all: Wide<S, N>) -> bool {
    N::sum(all.0, all.1).is_nan()
}

/// Vectors of several poses.
#[derive(Clone, Copy)]
pub(crate) struct Vectors<S: Simd, N: Lane>(pub(crate) [Wide<S, N>; 3]);

impl<S: Simd, N: Lane> Vectors<S, N> {
    /// The same vector for all.
    #[inline(always)]
    pub(crate) fn all(simd: S, [x, y, z]: [N; 3]) -> Self {
        Self([Wide::one(simd, x), Wide::one(simd, y), Wide::one(simd, z)])
    }

    /// start + first × one + second × other.
    #[inline(always)]
    pub(crate) fn sum(
        start: [N; 3],
        (first, one): ([N; 3], Wide<S, N>),
        (second, other): ([N; 3], Wide<S, N>),
    ) -> Self {
        let all = |number| Wide::one(one.0, number);
        let mut sum = [one; 3];
        for axis in 0..3 {
            let own = all(second[axis]).times(other, all(start[axis]));
            sum[axis] = all(first[axis]).times(one, own);
        }
        Self(sum)
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> Wide<S, N> {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        a.times(x, b.times(y, c * z))
    }

    /// With the same vector for all.
    #[inline(always)]
    pub(crate) fn along(self, same: [N; 3]) -> Wide<S, N> {
        self.dot(Self::all(self.0[0].0, same))
    }

    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([
            b.times(z, -(c * y)),
            c.times(x, -(a * z)),
            a.times(y, -(b * x)),
        ])
    }

    /// `self` × by + plus.
    #[inline(always)]
    pub(crate) fn times(self, by: Wide<S, N>, plus: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, plus.0);
        Self([a.times(by, x), b.times(by, y), c.times(by, z)])
    }
}

impl<S: Simd, N: Lane> Add for Vectors<S, N> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([a + x, b + y, c + z])
    }
}

impl<S: Simd, N: Lane> Sub for Vectors<S, N> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([a - x, b - y, c - z])
    }
}

impl<S: Simd, N: Lane> Mul<Wide<S, N>> for Vectors<S, N> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, by: Wide<S, N>) -> Self {
        let [a, b, c] = self.0;
        Self([a * by, b * by, c * by])
    }
}
