//! The single-precision functions against double precision, in ULP.

use delta_cal::Real;

/// The distance of `value` from `exact` in units of the last place of a single-precision number of
/// that size, never finer than that of 2⁻²⁴: near the zeros of sine and cosine the error is absolute.
fn ulps(value: f32, exact: f64, finest: f64) -> f64 {
    let size = exact.abs().max(finest);
    let ulp = 2f64.powi(size.log2().floor() as i32 - 23);
    (f64::from(value) - exact).abs() / ulp
}

#[test]
fn sine_and_cosine_are_within_one_ulp() {
    let mut worst = (0f64, 0f32);
    let mut worst_far = (0f64, 0f32);
    let check = |x: f32, worst: &mut (f64, f32), finest: f64| {
        let (sine, cosine) = x.sine_cosine();
        let exact = f64::from(x);
        // Double precision is exact to 2⁻²⁹ of a single-precision ULP.
        for error in [
            ulps(sine, exact.sin(), finest),
            ulps(cosine, exact.cos(), finest),
        ] {
            if error > worst.0 {
                *worst = (error, x);
            }
        }
    };
    // Every 17th single-precision number from 2⁻²⁴ to 4π, both signs: the angles of joints and
    // parameters.
    let mut bits = 2f32.powi(-24).to_bits();
    let end = (4.0 * std::f32::consts::PI).to_bits();
    let mut tried = 0u64;
    while bits <= end {
        let x = f32::from_bits(bits);
        check(x, &mut worst, 2f64.powi(-12));
        check(-x, &mut worst, 2f64.powi(-12));
        bits += 17;
        tried += 2;
    }
    // And every 1009th up to the end of the range.
    let end = 8192f32.to_bits();
    while bits <= end {
        check(f32::from_bits(bits), &mut worst_far, 2f64.powi(-12));
        bits += 1009;
        tried += 1;
    }
    println!(
        "sine and cosine: {tried} angles, at most {:.3} ULP up to 4π (at {}), {:.3} ULP up to 8192 (at {})",
        worst.0, worst.1, worst_far.0, worst_far.1
    );
    assert!(worst.0 < 1.0, "{worst:?}");
    assert!(worst_far.0 < 1.0, "{worst_far:?}");
}

#[test]
fn sine_and_cosine_refuse_what_they_cannot_reduce() {
    for x in [8193f32, -8193.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
        let (sine, cosine) = x.sine_cosine();
        assert!(sine.is_nan() && cosine.is_nan());
    }
    assert_eq!(0f32.sine_cosine(), (0.0, 1.0));
}

/// The bound that `Real` documents.
#[test]
fn inverse_square_root_is_within_two_and_a_half_ulp() {
    let mut worst = (0f64, 0f32);
    let mut bits = f32::MIN_POSITIVE.to_bits();
    let end = f32::MAX.to_bits();
    while bits <= end {
        let x = f32::from_bits(bits);
        let exact = 1.0 / f64::from(x).sqrt();
        let error = ulps(x.inverse_square_root(), exact, 0.0);
        if error > worst.0 {
            worst = (error, x);
        }
        bits += 97;
    }
    println!(
        "inverse square root: at most {:.3} ULP (at {:e})",
        worst.0, worst.1
    );
    assert!(worst.0 <= 2.5, "{worst:?}");
}

#[test]
fn inverse_square_root_of_no_square_is_no_number() {
    let not_a_number = f32::from_bits(0xffc0_0000);
    for x in [
        -1.0,
        -f32::MIN_POSITIVE,
        f32::NEG_INFINITY,
        f32::NAN,
        not_a_number,
    ] {
        assert!(x.inverse_square_root().is_nan(), "{x}");
    }
}

#[test]
#[allow(clippy::float_cmp)]
fn powers_of_two_below_are_exact() {
    for (x, expected) in [
        (480.0, 256.0),
        (1.0, 1.0),
        (0.75, 0.5),
        (-3.0, 2.0),
        (0.001, 2f64.powi(-10)),
    ] {
        assert_eq!(x.power_of_two_below(), expected);
        assert_eq!(f64::from((x as f32).power_of_two_below()), expected);
    }
}
