//! Single-precision functions that use single-precision arithmetic only.
//!
//! `libm::sinf` and `cosf` compute internally in double precision: about 1,200 instructions on a core whose FPU lacks
//! it.

use micromath::F32Ext;

/// Above this the three-part reduction of the argument loses accuracy.
const LARGEST_ANGLE: f32 = 8192.0;

// π/2 in three parts. The first two have 8 and 11 significant bits, so that their products with
// the quadrant number (below 2¹³) are exact.
const HALF_PI_HIGH: f32 = f32::from_bits(0x3fc9_0000); // 1.5703125
const HALF_PI_MIDDLE: f32 = f32::from_bits(0x39fd_a000); // 4.837512969970703e-4
const HALF_PI_LOW: f32 = f32::from_bits(0x33a2_2169); // 7.549789954891882e-8
/// 1.5 · 2²³: adding and subtracting it rounds to the nearest integer.
const TO_INTEGER: f32 = 12_582_912.0;

/// (sin x, cos x) by Cody–Waite reduction to |r| ≤ π/4 and the minimax polynomials of Cephes'
/// `sinf`; NaN where |x| > 8192 or x is not finite.
// In firmware its copies would cost more flash than the calls take time.
#[cfg_attr(target_os = "none", inline(never))]
pub(super) fn sine_cosine(x: f32) -> (f32, f32) {
    if !(x.abs() <= LARGEST_ANGLE) {
        return (f32::NAN, f32::NAN);
    }
    let shifted = x * core::f32::consts::FRAC_2_PI + TO_INTEGER;
    let quadrant = shifted.to_bits();
    let turns = shifted - TO_INTEGER;
    let (high, middle) = (x - turns * HALF_PI_HIGH, turns * HALF_PI_MIDDLE);
    let coarse = high - middle;
    let coarse_tail = ((high - coarse) - middle) - turns * HALF_PI_LOW;
    // r + tail is the reduced angle; the tail holds the bits that do not fit in r.
    let r = coarse + coarse_tail;
    let tail = (coarse - r) + coarse_tail;

    let r2 = r * r;
    let sine = r + (tail + r * r2 * (-1.666_665_5e-1 + r2 * (8.332_161e-3 + r2 * -1.951_529_6e-4)));
    let half_square = 0.5 * r2;
    let rough = 1.0 - half_square;
    let cosine = rough
        + (((1.0 - rough) - half_square)
            + (r2 * r2 * (4.166_664_6e-2 + r2 * (-1.388_731_6e-3 + r2 * 2.443_315_7e-5))
                - r * tail));

    match quadrant & 3 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// √x, correctly rounded: in half the flash that `libm::sqrtf` takes with its table.
#[cfg_attr(target_os = "none", inline(never))]
pub(super) fn square_root(x: f32) -> f32 {
    let bits = x.to_bits();
    if bits.wrapping_sub(1) >= 0x7f7f_ffff {
        // Zero, infinity and NaN are their own roots.
        return if x < 0.0 { f32::NAN } else { x };
    }
    if bits < 0x0080_0000 {
        // Subnormal: 2²⁴ times as large it is not.
        return square_root(x * 16_777_216.0) * (1.0 / 4096.0);
    }
    // The significand times 2²³ or, if the exponent is odd, 2²⁴: its root is a number of 24 bits.
    let odd = !(bits >> 23) & 1;
    let fraction = bits & 0x007f_ffff;
    let rough = f32::from_bits(fraction | (173 + odd) << 23);
    #[allow(clippy::cast_possible_truncation)] // between 2²³ and 2²⁴
    let mut root = (rough * inverse_square_root(rough)) as i32;
    // It is off by two at most, so the lower half of the square tells what is left of it.
    let square = ((fraction | 0x0080_0000) << (23 + odd)).cast_signed();
    let mut left = square.wrapping_sub(root.wrapping_mul(root));
    while left > root {
        left -= 2 * root + 1;
        root += 1;
    }
    while left <= -root {
        root -= 1;
        left += 2 * root + 1;
    }
    let exponent = ((bits >> 23) + 127) >> 1;
    f32::from_bits(exponent << 23 | root.cast_unsigned() & 0x007f_ffff)
}

/// 1/√x from `micromath`'s bit-trick seed (relative error up to 3.5 %) and three Newton steps, each of
/// which squares the error: 1.8e-3, 4.9e-6, then rounding. No division, no square root: a third of
/// the instructions of `1.0 / square_root(x)` on a Cortex-M. Not finite where x is infinite or NaN.
pub(super) fn inverse_square_root(x: f32) -> f32 {
    // The seed's integer arithmetic would overflow with the sign bit set.
    if !(x >= 0.0) {
        return f32::NAN;
    }
    let half = 0.5 * x;
    let mut y = F32Ext::invsqrt(x);
    y = y * (1.5 - half * y * y);
    y = y * (1.5 - half * y * y);
    // Written as a correction, so that the last step rounds only one small term.
    y + y * (0.5 - half * y * y)
}

#[cfg(test)]
mod tests {
    use super::square_root;

    /// Every significand with an even and an odd exponent, the ends of the range, and what is no positive number.
    #[test]
    fn square_roots_are_correctly_rounded() {
        let one = 1.0_f32.to_bits();
        let every = one..one + (2 << 23);
        for bits in every.chain(0..70_000).chain(0x7f7f_0000..=0x7f80_0000) {
            let x = f32::from_bits(bits);
            assert_eq!(square_root(x).to_bits(), libm::sqrtf(x).to_bits(), "{x:e}");
        }
        assert!(square_root(-1.0).is_nan() && square_root(f32::NAN).is_nan());
        assert_eq!(square_root(-0.0).to_bits(), (-0.0_f32).to_bits());
    }
}
