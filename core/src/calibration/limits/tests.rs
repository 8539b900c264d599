use super::{LARGEST_DEVIATION, chi_square_quantile};

/// P(χ² > x) with an even number of degrees of freedom: e^(−x/2) Σ (x/2)ᵏ/k!, k below half of it.
fn beyond(x: f64, freedom: u32) -> f64 {
    let half = x / 2.0;
    let (mut term, mut sum) = (libm::exp(-half), 0.0);
    for k in 1..=freedom / 2 {
        sum += term;
        term *= half / f64::from(k);
    }
    sum
}

#[test]
fn the_quantile_is_where_a_normal_number_exceeds_five() {
    let five_sigma = 0.5 * libm::erfc(LARGEST_DEVIATION / core::f64::consts::SQRT_2);
    for freedom in [8, 12, 20, 52, 100, 300] {
        let quantile = chi_square_quantile(f64::from(freedom));
        let probability = beyond(quantile, freedom);
        // Wilson and Hilferty's approximation is a little too large this far out: by 3.3 % of the
        // quantile for 8 degrees of freedom, by less for more.
        assert!(
            (0.5..1.0).contains(&(probability / five_sigma)),
            "{freedom}: {probability:e}"
        );
    }
    // The next better approximation: ν + z √(2ν) + 2/3 (z² − 1), of large ν.
    let large = 1e6_f64;
    let expected = large + 5.0 * libm::sqrt(2.0 * large) + 16.0;
    assert!((chi_square_quantile(large) - expected).abs() < 0.1);
}
