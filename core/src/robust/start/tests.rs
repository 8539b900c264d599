#![allow(clippy::cast_precision_loss, clippy::float_cmp, clippy::unwrap_used)]

use super::{Random, Search, choose_nearest, least_trimmed};
use crate::calibration::{Refusal, Settings};
use crate::robust::WeighedSample;
use crate::robust::fits::Fits;
use crate::samples::Noise;

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

/// Fits that keep a record of which samples they were of, by bits; what they leave is stated.
struct Recorder {
    settings: Settings<f64>,
    subset: usize,
    prior: f64,
    /// The distance of the sample k is k + 1 times this after so many fits.
    unit: fn(usize) -> f64,
    sets: [u64; 400],
    count: usize,
    limit: u16,
}

const PARAMETERS: usize = 8;

impl Recorder {
    fn new(subset: usize, unit: fn(usize) -> f64) -> Self {
        Self {
            settings: Settings::default(),
            subset,
            prior: 0.0,
            unit,
            sets: [0; 400],
            count: 0,
            limit: 0,
        }
    }
}

impl Fits<f64> for Recorder {
    type Correction = u64;
    type Outcome = ();

    fn settings(&self) -> &Settings<f64> {
        &self.settings
    }

    fn widened(&self) -> f64 {
        1.0
    }

    fn nominal(&self) -> u64 {
        0
    }

    fn subset(&self) -> usize {
        self.subset
    }

    fn prior_cost(&self, _: &u64) -> f64 {
        self.prior
    }

    fn parameters(&self) -> usize {
        PARAMETERS
    }

    fn fit(
        &mut self,
        settings: &Settings<f64>,
        weighed: &[WeighedSample<f64>],
        effective: f64,
    ) -> Option<u64> {
        let mut set = 0;
        for (index, sample) in weighed.iter().enumerate() {
            assert!(sample.factor == 0.0 || sample.factor == 1.0);
            set |= u64::from(sample.factor > 0.0) << index;
        }
        assert_eq!(effective, f64::from(set.count_ones()));
        self.sets[self.count] = set;
        self.count += 1;
        self.limit = settings.iteration_limit;
        Some(set)
    }

    fn outcome(&mut self, _: &[WeighedSample<f64>], _: f64) -> Result<(), Refusal> {
        Ok(())
    }

    fn measure(&self, _: &u64, weighed: &mut [WeighedSample<f64>]) {
        for (index, sample) in weighed.iter_mut().enumerate() {
            sample.distance = (index + 1) as f64 * (self.unit)(self.count);
        }
    }
}

fn samples<const COUNT: usize>() -> [WeighedSample<f64>; COUNT] {
    let mut samples = [WeighedSample::vacant(); COUNT];
    for sample in &mut samples {
        (sample.starting, sample.factor) = (true, 1.0);
    }
    samples
}

fn search(fits: &mut Recorder, kept: usize) -> Search<'_, f64, Recorder> {
    let settings = fits.settings;
    Search {
        fits,
        settings,
        kept,
        best: None,
    }
}

/// Σ (k + 1)² over the first twenty.
const SUM: f64 = 2870.0;

/// Concentration goes on while a step takes off a thousandth of the sum or more, as long as steps are left; and the
/// least sum is kept, with what is known beforehand.
#[test]
fn concentration_ends_where_it_gains_nothing() {
    let halving = |fits: usize| 0.5_f64.powi(i32::try_from(fits).unwrap());
    let by_little = |fits: usize| 0.9998_f64.powi(i32::try_from(fits).unwrap());
    let by_enough = |fits: usize| 0.999_f64.powi(i32::try_from(fits).unwrap());
    let growing = |fits: usize| fits as f64;
    for (unit, expected) in [
        (halving as fn(usize) -> f64, 4),
        (by_enough, 4),
        (by_little, 2),
        (|_| 1.0, 2),
        (growing, 2),
    ] {
        let mut fits = Recorder::new(9, unit);
        fits.prior = 7.0;
        let mut search = search(&mut fits, 20);
        search.try_chosen(&mut samples::<30>(), 3);
        let (least, best) = search.best.unwrap();
        assert_eq!(fits.count, expected);
        // All samples, and then the nearest to each fit.
        assert_eq!(fits.sets[0], (1 << 30) - 1);
        assert!(
            fits.sets[1..fits.count]
                .iter()
                .all(|set| *set == (1 << 20) - 1)
        );
        let sums = (1..=fits.count).map(|fits| SUM * unit(fits).powi(2) + 7.0);
        let expected = sums.fold(f64::INFINITY, f64::min);
        assert!((least - expected).abs() < 1e-12 * expected);
        if unit(2) >= unit(1) {
            assert_eq!(best, (1 << 30) - 1);
        }
    }
}

/// A fit that leaves a hundred times the least sum so far is not followed.
#[test]
fn a_hopeless_fit_is_not_followed() {
    for (part, expected) in [(0.99, 2), (1.01, 1)] {
        let mut fits = Recorder::new(9, |_| 1.0);
        let mut search = search(&mut fits, 20);
        let least = SUM / (100.0 * part);
        search.best = Some((least, 5));
        search.try_chosen(&mut samples::<30>(), 3);
        assert_eq!(search.best, Some((least, 5)));
        assert_eq!(fits.count, expected);
    }
}

/// What the stated noise explains: three quarters of the residuals of the kept samples, of which each has as many as
/// those at the start have on average.
#[test]
fn the_search_ends_where_the_stated_noise_explains_the_kept() {
    let mut starting = samples::<30>();
    for (index, sample) in starting.iter_mut().enumerate() {
        sample.dimensions = if index % 3 == 0 { 1 } else { 3 };
        sample.starting = index < 24;
    }
    // 24 samples with 56 residuals.
    let expected = 0.75 * 56.0 / 24.0 * 20.0;
    let stated = Settings::default().with_noise(Noise::new(0.02, 0.0).unwrap());
    for (settings, sum, good) in [
        (stated, 0.999 * expected, true),
        (stated, 1.001 * expected, false),
        (Settings::default(), 0.5 * expected, false),
    ] {
        let mut fits = Recorder::new(9, |_| 1.0);
        fits.settings = settings;
        let mut search = search(&mut fits, 20);
        assert!(!search.is_good(&starting));
        search.best = Some((sum, 0));
        assert_eq!(search.is_good(&starting), good);
        search.try_changes(&mut starting, 24);
        search.try_subsets(&mut starting, 24);
        assert_eq!(fits.count == 0, good);
    }
}

/// All samples before and all after each of 24 places, if there are enough of them.
#[test]
fn a_change_is_supposed_to_begin_at_each_of_many_places() {
    let mut fits = Recorder::new(10, |_| 1.0);
    let mut starting = samples::<30>();
    starting[4].starting = false;
    search(&mut fits, 20).try_changes(&mut starting, 29);
    let all: u64 = ((1 << 30) - 1) & !(1 << 4);
    let mut found = fits.sets[..fits.count].iter().step_by(2);
    for place in 1..24 {
        let before = (1 << (30 * place / 24)) - 1;
        for set in [all & before, all & !before] {
            if set.count_ones() >= 10 {
                assert_eq!(found.next(), Some(&set), "{place}");
            }
        }
    }
    assert_eq!(found.next(), None);
    // With fewer samples there are as many places as those.
    let mut few = Recorder::new(1, |_| 1.0);
    search(&mut few, 4).try_changes(&mut samples::<6>(), 6);
    let sets = [1, 62, 3, 60, 7, 56, 15, 48, 31, 32];
    assert!(few.sets[..few.count].iter().step_by(2).eq(&sets));
}

/// 150 of as many samples as determine the robot, or as are kept; each sample is in as many of them.
#[test]
fn random_subsets_are_as_small_as_possible() {
    for (subset, kept, size) in [(9, 20, 9), (12, 10, 10)] {
        let mut fits = Recorder::new(subset, |_| 1.0);
        let mut starting = samples::<30>();
        starting[4].starting = false;
        search(&mut fits, kept).try_subsets(&mut starting, 29);
        let chosen = || fits.sets[..fits.count].iter().step_by(2);
        assert_eq!(chosen().count(), 150);
        assert!(chosen().all(|set| set.count_ones() == size));
        for index in 0..30 {
            let times = chosen().filter(|set| *set & (1 << index) != 0).count();
            if index == 4 {
                assert_eq!(times, 0);
            } else {
                // Five σ of a binomial number.
                let share = f64::from(size) / 29.0;
                let sigma = libm::sqrt(150.0 * share * (1.0 - share));
                assert!(
                    (times as f64 - 150.0 * share).abs() < 5.0 * sigma,
                    "{times}"
                );
            }
        }
    }
}

/// The h that the highest breakdown point keeps, with few linearisations, and no row without readings.
#[test]
fn the_start_keeps_half_of_the_samples_and_half_of_the_parameters() {
    for (stated, expected) in [(50, 15), (5, 5)] {
        let mut fits = Recorder::new(9, |_| 1.0);
        fits.settings = Settings::default().with_iteration_limit(stated);
        let mut all = [WeighedSample::vacant(); 62];
        all[17].dimensions = 0;
        assert!(least_trimmed(&mut fits, &mut all).is_some());
        assert_eq!(fits.limit, expected);
        let sets = &fits.sets[..fits.count];
        assert!(sets.iter().all(|set| set & (1 << 17) == 0));
        assert_eq!(sets[0].count_ones(), 61);
        // (61 + 8 + 1)/2.
        assert_eq!(sets[1].count_ones(), 35);
    }
}
