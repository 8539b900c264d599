#![allow(clippy::unwrap_used)]

use super::Forgetting;

#[test]
fn after_so_many_samples_the_factor_is_its_power() {
    let forgetting = Forgetting::new(19.0_f64).unwrap();
    let mut expected = 1.0;
    for count in 0..70 {
        assert!(
            (forgetting.after(count) / expected - 1.0).abs() < 1e-13,
            "{count}"
        );
        expected *= 0.95;
    }
}
