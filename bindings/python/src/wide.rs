//! As many numbers as the processor computes with in one instruction, and vectors of them.

// Coefficients are as published.
#![allow(clippy::excessive_precision)]

use pulp::Simd;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, PI};
use std::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

/// Numbers of several poses.
#[derive(Clone, Copy)]
pub(crate) struct Wide<S: Simd>(pub(crate) S, pub(crate) S::f64s);

/// What holds of which of them.
#[derive(Clone, Copy)]
pub(crate) struct Which<S: Simd>(S, S::m64s);

impl<S: Simd> BitAnd for Which<S> {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0, self.0.and_m64s(self.1, other.1))
    }
}

/// Operators between numbers of several poses, and with one number.
macro_rules! operators {
    ($($operator:ident $name:ident $of:ident),*) => {$(
        impl<S: Simd> $operator for Wide<S> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(self.0, self.0.$of(self.1, other.1))
            }
        }

        impl<S: Simd> $operator<f64> for Wide<S> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: f64) -> Self {
                Self(self.0, self.0.$of(self.1, self.0.splat_f64s(other)))
            }
        }
    )*};
}

operators!(Add add add_f64s, Sub sub sub_f64s, Mul mul mul_f64s, Div div div_f64s);

impl<S: Simd> Neg for Wide<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0, self.0.neg_f64s(self.1))
    }
}

impl<S: Simd> Wide<S> {
    /// The same number for all.
    #[inline(always)]
    pub(crate) fn all(simd: S, number: f64) -> Self {
        Self(simd, simd.splat_f64s(number))
    }

    /// `self` × by + plus, in one instruction where there is one.
    #[inline(always)]
    fn times(self, by: Self, plus: Self) -> Self {
        Self(self.0, self.0.mul_add_e_f64s(self.1, by.1, plus.1))
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        Self(self.0, self.0.abs_f64s(self.1))
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self(self.0, self.0.sqrt_f64s(self.1))
    }

    #[inline(always)]
    pub(crate) fn above(self, other: Self) -> Which<S> {
        Which(self.0, self.0.greater_than_f64s(self.1, other.1))
    }

    #[inline(always)]
    pub(crate) fn is_within(self, [low, high]: [f64; 2]) -> Which<S> {
        self.above(Self::all(self.0, low)) & Self::all(self.0, high).above(self)
    }

    /// `self` where it holds, `other` elsewhere.
    #[inline(always)]
    pub(crate) fn where_it(self, holds: Which<S>, other: Self) -> Self {
        Self(self.0, self.0.select_f64s(holds.1, self.1, other.1))
    }

    /// With the sign changed where that of the other is negative.
    #[inline(always)]
    pub(crate) fn signed_by(self, other: Self) -> Self {
        let Self(simd, own) = self;
        let sign = simd.and_f64s(other.1, simd.splat_f64s(-0.0));
        Self(simd, simd.xor_f64s(own, sign))
    }

    /// Sum of c x^k, the highest power first.
    #[inline(always)]
    fn polynomial<const N: usize>(self, coefficients: [f64; N]) -> Self {
        let mut sum = Self::all(self.0, coefficients[0]);
        for own in &coefficients[1..] {
            sum = sum.times(self, Self::all(self.0, *own));
        }
        sum
    }

    /// Sine and cosine of up to some turns, by the polynomials of Cephes (S. L. Moshier, sin.c).
    #[inline(always)]
    pub(crate) fn sine_cosine(self) -> (Self, Self) {
        /// Added to a small number, leaves the nearest whole number in the lowest bits.
        const WHOLE: f64 = 6_755_399_441_055_744.0;
        /// π/2 in parts whose small multiples are exact.
        const PARTS: [f64; 3] = [
            1.570_796_251_296_997_07,
            7.549_789_415_861_596_35e-8,
            5.390_302_858_158_119e-15,
        ];
        const SINE: [f64; 6] = [
            1.589_623_015_765_465_68e-10,
            -2.505_074_776_285_780_73e-8,
            2.755_731_362_138_572_45e-6,
            -1.984_126_982_958_953_86e-4,
            8.333_333_333_322_118_59e-3,
            -1.666_666_666_666_663_07e-1,
        ];
        const COSINE: [f64; 6] = [
            -1.135_853_652_138_768_17e-11,
            2.087_570_084_197_473_17e-9,
            -2.755_731_417_929_673_88e-7,
            2.480_158_728_885_170_45e-5,
            -1.388_888_888_887_305_64e-3,
            4.166_666_666_666_659_29e-2,
        ];
        let simd = self.0;
        let shifted = self * FRAC_2_PI + WHOLE;
        let whole = shifted - WHOLE;
        let rest = self - whole * PARTS[0] - whole * PARTS[1] - whole * PARTS[2];
        let square = rest * rest;
        let sine = (rest * square).times(square.polynomial(SINE), rest);
        let half = square.times(Self::all(simd, -0.5), Self::all(simd, 1.0));
        let cosine = (square * square).times(square.polynomial(COSINE), half);
        let one = simd.splat_u64s(1);
        let quarters = simd.transmute_u64s_f64s(shifted.1);
        let odd = Which(simd, simd.equal_u64s(simd.and_u64s(quarters, one), one));
        // Of a turn the second half for the sine, of one a quarter ahead for the cosine.
        let two = simd.splat_u64s(2);
        let half_turn = |own: S::u64s| {
            let bit = simd.and_u64s(own, two);
            Which(simd, simd.equal_u64s(bit, two))
        };
        let (first, second) = (cosine.where_it(odd, sine), sine.where_it(odd, cosine));
        (
            (-first).where_it(half_turn(quarters), first),
            (-second).where_it(half_turn(simd.add_u64s(quarters, one)), second),
        )
    }

    /// atan2(`self`, x) of numbers of which not both are 0, by the rational function of Cephes (atan.c).
    #[inline(always)]
    pub(crate) fn angle_over(self, x: Self) -> Self {
        const ABOVE: [f64; 5] = [
            -8.750_608_600_031_904_12e-1,
            -1.615_753_718_733_365_08e1,
            -7.500_855_792_314_704_67e1,
            -1.228_866_684_490_136_17e2,
            -6.485_021_904_942_025_37e1,
        ];
        const BELOW: [f64; 6] = [
            1.0,
            2.485_846_490_142_306_3e1,
            1.650_270_098_316_988_54e2,
            4.328_810_604_912_902_67e2,
            4.853_903_996_359_136_96e2,
            1.945_506_571_482_613_96e2,
        ];
        let zero = Self::all(self.0, 0.0);
        let (height, width) = (self.abs(), x.abs());
        let steep = height.above(width);
        let (small, large) = (width.where_it(steep, height), height.where_it(steep, width));
        // Around 45° from there.
        let near = small.above(large * 0.66);
        let above = (small - large).where_it(near, small);
        let ratio = above / (small + large).where_it(near, large);
        let square = ratio * ratio;
        let curve = square.polynomial(ABOVE) / square.polynomial(BELOW);
        let angle = (ratio * square).times(curve, ratio);
        let angle = (angle + FRAC_PI_4).where_it(near, angle);
        let angle = (-angle + FRAC_PI_2).where_it(steep, angle);
        (-angle + PI).where_it(zero.above(x), angle).signed_by(self)
    }
}

/// Vectors of several poses.
#[derive(Clone, Copy)]
pub(crate) struct Vectors<S: Simd>(pub(crate) [Wide<S>; 3]);

impl<S: Simd> Vectors<S> {
    /// start + first × one + second × other.
    #[inline(always)]
    pub(crate) fn sum(
        start: [f64; 3],
        (first, one): ([f64; 3], Wide<S>),
        (second, other): ([f64; 3], Wide<S>),
    ) -> Self {
        let mut all = [one; 3];
        for axis in 0..3 {
            let own = Wide::all(one.0, second[axis]).times(other, Wide::all(one.0, start[axis]));
            all[axis] = Wide::all(one.0, first[axis]).times(one, own);
        }
        Self(all)
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> Wide<S> {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        a.times(x, b.times(y, c * z))
    }

    /// With the same vector for all.
    #[inline(always)]
    pub(crate) fn along(self, [x, y, z]: [f64; 3]) -> Wide<S> {
        let all = |own| Wide::all(self.0[0].0, own);
        self.dot(Self([all(x), all(y), all(z)]))
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
    pub(crate) fn times(self, by: Wide<S>, plus: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, plus.0);
        Self([a.times(by, x), b.times(by, y), c.times(by, z)])
    }
}

impl<S: Simd> Sub for Vectors<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([a - x, b - y, c - z])
    }
}

impl<S: Simd> Sub<[f64; 3]> for Vectors<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, [x, y, z]: [f64; 3]) -> Self {
        let [a, b, c] = self.0;
        Self([a - x, b - y, c - z])
    }
}

impl<S: Simd> Mul<Wide<S>> for Vectors<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, by: Wide<S>) -> Self {
        let [a, b, c] = self.0;
        Self([a * by, b * by, c * by])
    }
}
