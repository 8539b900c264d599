use super::Random;

/// Marsaglia's own example: of the seed 2463534242 the first number is 723471715.
#[test]
fn the_generator_is_marsaglias() {
    let mut random = Random(2_463_534_242);
    assert_eq!(random.below(1 << 32), 723_471_715);
    assert_eq!(random.0, 723_471_715);
}

#[test]
fn every_number_below_the_bound_is_as_likely() {
    for bound in [1, 2, 7, 60] {
        let mut random = Random(0x9e37_79b9);
        let mut counts = [0_u32; 60];
        let draws = 60_000;
        for _ in 0..draws {
            counts[random.below(bound)] += 1;
        }
        let expected = f64::from(draws) / bound as f64;
        let (inside, outside) = counts.split_at(bound);
        assert!(outside.iter().all(|count| *count == 0));
        // Five σ of a binomial number.
        let allowed = 5.0 * libm::sqrt(expected);
        for count in inside {
            assert!((f64::from(*count) - expected).abs() <= allowed);
        }
    }
    assert_eq!(Random(1).below(0), 0);
}
