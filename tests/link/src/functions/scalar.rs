//! The scalar by itself.

use core::mem::MaybeUninit;
use delta_cal::Real;

macro_rules! of_scalar {
    ($module:ident, $prefix:literal, $t:ident) => {
        mod $module {
            use super::*;

            symbols! { $prefix;
                fn from_f64(value: f64) -> $t { <$t as Real>::from_f64(value) }
                fn to_f64(value: $t) -> f64 { value.to_f64() }
                fn from_count(count: u64) -> $t { <$t as Real>::from_count(count) }
                fn finite(value: $t) -> bool { value.finite() }
                fn magnitude(value: $t) -> $t { value.magnitude() }
                fn square_root(value: $t) -> $t { value.square_root() }
                fn inverse_square_root(value: $t) -> $t { value.inverse_square_root() }
                fn sine_cosine(value: $t) -> ($t, $t) { value.sine_cosine() }
                fn angle_over(value: $t, x: $t) -> $t { value.angle_over(x) }
                fn natural_logarithm(value: $t) -> $t { value.natural_logarithm() }
                fn nearest_integer(value: $t) -> $t { value.nearest_integer() }
                fn power_of_two_below(value: $t) -> $t { value.power_of_two_below() }
                fn larger(value: $t, other: $t) -> $t { value.larger(other) }
                fn squared(value: $t) -> $t { value.squared() }
            }
        }
    };
}

of_scalar!(single, "f32_", f32);
of_scalar!(double, "f64_", f64);
