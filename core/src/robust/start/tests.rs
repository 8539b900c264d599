use super::{Random, choose_nearest};
use crate::robust::WeighedSample;

/// Marsaglia's own example: of the seed 2463534242 the first number is 723471715.
#[test]
fn the_generator_is_marsaglias() {
    let mut random = Random(2_463_534_242);
    assert_eq!(random.below(1 << 32), 723_471_715);
    assert_eq!(random.0, 723_471_715);
}

#[test]
fn every_number_below_the_bound_is_as_likely() {
    for (bound, share) in [(1, 1.0), (2, 2.0), (7, 7.0), (60, 60.0)] {
        let mut random = Random(0x9e37_79b9);
        let mut counts = [0_u32; 60];
        let draws = 60_000;
        for _ in 0..draws {
            counts[random.below(bound)] += 1;
        }
        let expected = f64::from(draws) / share;
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

#[test]
fn the_nearest_are_chosen_and_summed_up() {
    let distances = [5.0, 0.5, 9.0, 2.0, 1.0, 0.1, 4.0];
    let mut samples = [WeighedSample::<f64>::vacant(); 7];
    for (sample, distance) in samples.iter_mut().zip(distances) {
        sample.distance = distance;
    }
    // One that the start does not look at.
    samples[5].starting = false;
    let sum = choose_nearest(&mut samples, 4);
    assert!(sum.is_some_and(|sum| (sum - 21.25).abs() < 1e-14));
    let chosen = samples.map(|sample| sample.factor > 0.0);
    assert_eq!(chosen, [false, true, false, true, true, false, true]);
    samples[1].distance = f64::INFINITY;
    assert_eq!(choose_nearest(&mut samples, 6), None);
}
