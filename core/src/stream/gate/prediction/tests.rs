use super::normal_equivalent;

/// Tables of Student's t: exceeded, on either side, as often as 1.960, 2.576 and 3.291 by a normal number.
#[test]
fn students_t_is_told_as_a_normal_number() {
    for (freedom, quantiles) in [
        (3.0_f64, [3.182, 5.841, 12.924]),
        (5.0, [2.571, 4.032, 6.869]),
        (10.0, [2.228, 3.169, 4.587]),
        (30.0, [2.042, 2.750, 3.646]),
        (120.0, [1.980, 2.617, 3.373]),
        (1e5, [1.960, 2.576, 3.291]),
    ] {
        for (t, normal) in quantiles.into_iter().zip([1.960, 2.576, 3.291]) {
            let found = libm::sqrt(normal_equivalent(t * t, freedom));
            // Wallace's error in the tails, 0.07 at most with ν = 3 up to here.
            let allowed = 0.24 / freedom + 0.003;
            assert!((found - normal).abs() < allowed, "{freedom} {t} {found}");
        }
    }
}
