//! Innovations: their sign, their distribution where the samples are good, and the solver's beside them.

use crate::gate::{DEGREE, Stream, noise, robot, stated};
use delta_cal::{Sample, Settings};
use delta_cal_tests::{generator, measurements};

/// A position that is measured too far from an elbow has a positive innovation there, one too near a negative one,
/// whether the noise is stated or not.
#[test]
fn the_sign_of_an_innovation_is_that_of_the_error() {
    for settings in [stated(0.5, 0.2 * DEGREE), Settings::default()] {
        let mut rng = generator(1190, 0);
        let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
        let mut stream = Stream::new(&settings);
        for sample in measurements(&truth, 60, Some(&noise()), &mut rng) {
            stream.add(&sample);
        }
        for next in measurements(&truth, 20, None, &mut rng) {
            for (index, (arm, q)) in truth.arms().iter().zip(next.joints).enumerate() {
                let away = (next.position - arm.elbow(q)).normalize();
                // Fifty times the noise.
                for by in [1.0, -1.0] {
                    let position = next.position + away * by;
                    let moved = Sample { position, ..next };
                    let found = stream.gate.innovations(&stream.calibrator, &moved).unwrap();
                    assert!(found[index].normalized * by > 0.0, "{:?}", found[index]);
                }
            }
        }
    }
}

/// Normalised innovations of good samples: mean square, and how many are beyond a number of σ.
#[derive(Debug, Default)]
struct Innovations {
    number: u32,
    sum: f64,
    beyond: [u32; 3],
    rejected: u64,
    samples: u64,
}

const SIGMAS: [f64; 3] = [2.0, 3.0, 4.0];
/// 2Φ(−z) of those.
const EXPECTED: [f64; 3] = [0.045_500, 0.002_699_8, 0.000_063_342];

fn innovations(campaign: u64, settings: &Settings<f64>, length: f64, angle: f64) -> Innovations {
    let mut found = Innovations::default();
    for number in 0..300 {
        let mut rng = generator(campaign, number);
        let truth = robot(length, angle, &mut rng);
        let mut stream = Stream::new(settings);
        for sample in measurements(&truth, 120, Some(&noise()), &mut rng) {
            if let Ok(arms) = stream.gate.innovations(&stream.calibrator, &sample) {
                for arm in arms {
                    found.number += 1;
                    found.sum += arm.normalized.powi(2);
                    for (count, sigmas) in found.beyond.iter_mut().zip(SIGMAS) {
                        *count += u32::from(arm.normalized.abs() > sigmas);
                    }
                }
            }
            stream.add(&sample);
        }
        found.rejected += stream.gate.counts().rejected;
        found.samples += 120;
    }
    found
}

/// The distribution of good samples' normalised innovations squared is χ² with one degree of freedom: so is
/// how often they are rejected.
#[test]
fn good_samples_are_rejected_as_often_as_chi_square_has_it() {
    let no_tolerance = Settings::default().with_noise(noise());
    for (what, campaign, settings, length, angle) in [
        (
            "noise, tolerance 0.5 mm/0.2°",
            900,
            stated(0.5, 0.2 * DEGREE),
            0.5,
            0.2 * DEGREE,
        ),
        (
            "noise, tolerance 2 mm/1°",
            901,
            stated(2.0, DEGREE),
            2.0,
            DEGREE,
        ),
        ("noise alone", 902, no_tolerance, 0.5, 0.2 * DEGREE),
        (
            "nothing stated",
            903,
            Settings::default(),
            0.5,
            0.2 * DEGREE,
        ),
    ] {
        let found = innovations(campaign, &settings, length, angle);
        let number = f64::from(found.number);
        let mean = found.sum / number;
        let [two, three, four] = found.beyond;
        let [of_two, of_three, of_four] = EXPECTED.map(|probability| number * probability);
        println!(
            "| {what} | {} | {mean:.3} | {two} ({of_two:.0}), {three} ({of_three:.0}), {four} \
                 ({of_four:.1}) | {} of {} |",
            found.number, found.rejected, found.samples
        );
        // The mean square of 100,000 numbers is known to √(2/1e5), three arms of one position to no
        // more than √3 times that; curvature adds a hundredth with the wide tolerance.
        assert!((mean - 1.0).abs() < 0.03, "{mean}");
        for (found, expected) in found.beyond.iter().zip(EXPECTED) {
            let expected = number * expected;
            // √3 of the arms again, and 3.5 σ of a count.
            let off = (f64::from(*found) - expected).abs();
            assert!(off < 6.0 * expected.sqrt() + 0.03 * expected, "{found}");
        }
        // 2Φ(−4.685) = 2.8e-6 an arm: 0.3 in all.
        assert!(found.rejected <= 4, "{}", found.rejected);
    }
}
