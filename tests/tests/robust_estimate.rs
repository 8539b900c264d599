//! What a robust fit is, by the definitions of an M-estimate: its weights are those of its residuals, its
//! gradient vanishes, its covariance is Huber's.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

use delta_cal::robust::{Loss, RobustOutcome, RobustRefusal, WeighedSample, robust_fit};
use delta_cal::samples::SampleError;
use delta_cal::{ArmIndex, Noise, Refusal, Robot, Sample, Settings};
use delta_cal_tests::closures::{by_parameters, closures, covariance, inverse_of};
use delta_cal_tests::{
    Spread, generator, largest_difference, measurements, paper_robot, perturbed,
};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

const POSITION: f64 = 0.02;
const JOINT: f64 = 5e-5;
const BOTH: [Loss; 2] = [Loss::Huber, Loss::Tukey];

fn noise(times: f64) -> Noise<f64> {
    Noise::new(POSITION * times, JOINT * times).unwrap()
}

fn stated(times: f64) -> Settings<f64> {
    Settings::default().with_noise(noise(times))
}

/// A robot and its measurements, of which some are wrong: every fifth from the third on.
fn case(
    seed: u64,
    count: usize,
    wrong: usize,
    noise: Option<&Noise<f64>>,
) -> (Robot<f64>, Vec<Sample<f64>>) {
    let mut rng = generator(620, seed);
    let truth = perturbed(&paper_robot(), 1.0, 0.01, Spread::Uniform, &mut rng);
    let mut samples = measurements(&truth, count, noise, &mut rng);
    for (index, sample) in samples
        .iter_mut()
        .enumerate()
        .skip(3)
        .step_by(5)
        .take(wrong)
    {
        if index % 2 == 0 {
            sample.joints[index % 3] += 0.05;
        } else {
            sample.position += Vector3::new(8.0, -5.0, 6.0 + index as f64);
        }
    }
    (truth, samples)
}

fn is_wrong(index: usize, wrong: usize) -> bool {
    index >= 3 && (index - 3).is_multiple_of(5) && (index - 3) / 5 < wrong
}

fn fit(
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
    loss: Loss,
) -> (
    Result<RobustOutcome<f64>, RobustRefusal>,
    Vec<WeighedSample<f64>>,
) {
    let mut work = vec![WeighedSample::vacant(); samples.len()];
    let outcome = robust_fit(&paper_robot(), settings, samples, loss, &mut work);
    (outcome, work)
}

/// |W f| of every sample at a robot, W at the robot before calibration.
fn distances(robot: &Robot<f64>, samples: &[Sample<f64>], noise: &Noise<f64>) -> Vec<f64> {
    let distance = |sample: &Sample<f64>| {
        let closures = closures(robot, sample);
        (closures.transpose() * information(sample, noise) * closures)[0].sqrt()
    };
    samples.iter().map(distance).collect()
}

/// WᵀW.
fn information(sample: &Sample<f64>, noise: &Noise<f64>) -> Matrix3<f64> {
    covariance(&paper_robot(), sample, noise)
        .try_inverse()
        .unwrap()
}

/// The scale: the median of the lengths over that of three normal numbers, with 24 degrees of freedom of
/// three residuals a sample lost.
fn scale(distances: &[f64]) -> f64 {
    let mut sizes = distances.to_vec();
    sizes.sort_by(f64::total_cmp);
    let count = sizes.len();
    let median = f64::midpoint(sizes[(count - 1) / 2], sizes[count / 2]);
    median / 2.365_973_88_f64.sqrt() * (count as f64 / (count as f64 - 12.0)).sqrt()
}

/// By how much a loss is wider for the length of three numbers than for one, at the same efficiency of
/// 95 %.
const fn stretch(loss: Loss) -> f64 {
    match loss {
        Loss::Huber => 1.210_396,
        Loss::Tukey => 1.171_878,
    }
}

fn psi_over_r(loss: Loss, r: f64) -> f64 {
    let size = r.abs();
    match loss {
        _ if size >= 4.685 => 0.0,
        Loss::Huber => (1.345 / size).min(1.0),
        Loss::Tukey => (1.0 - (size / 4.685).powi(2)).powi(2),
    }
}

#[test]
fn exact_samples_return_the_robot_and_name_the_wrong_ones() {
    for loss in BOTH {
        for settings in [Settings::default(), stated(1.0)] {
            for (seed, count, wrong) in [(1, 30, 4), (2, 41, 6), (3, 60, 11), (4, 20, 0)] {
                let (truth, samples) = case(seed, count, wrong, None);
                let (outcome, work) = fit(&samples, &settings, loss);
                let outcome = outcome.unwrap();
                assert!(largest_difference(&outcome.fit.robot, &truth) < 1e-6);
                assert_eq!(outcome.suspected, wrong);
                // Weights of residuals that are rounding alone, in units of rounding, need not settle.
                assert!(outcome.settled || settings.noise.is_none());
                assert!(!outcome.settled || (2..60).contains(&outcome.rounds));
                assert!(outcome.rounds <= 80);
                assert_eq!(outcome.fit.estimate.samples, (count - wrong) as u64);
                for (index, weighed) in work.iter().enumerate() {
                    assert_eq!(weighed.suspected(), is_wrong(index, wrong), "{index}");
                    assert_eq!(weighed.weight() > 0.0, !weighed.suspected());
                }
            }
        }
    }
}

/// The fit is where its own weights put it, and every figure is what the definitions say.
#[test]
fn weights_residuals_and_gradient_are_those_of_the_estimate() {
    for loss in BOTH {
        for (seed, count, times, wrong) in [
            (11, 60, 0.85, 6),
            (12, 61, 0.85, 0),
            (13, 90, 0.6, 9),
            (14, 75, 1.05, 5),
        ] {
            let actual = noise(1.0);
            let (_, samples) = case(seed, count, wrong, Some(&actual));
            let (outcome, work) = fit(&samples, &stated(times), loss);
            let outcome = outcome.unwrap();
            assert!(outcome.settled);
            let robot = &outcome.fit.robot;
            let distances = distances(robot, &samples, &noise(times));
            // The stated noise keeps it at 1 or above.
            let scale = scale(&distances).max(1.0);
            let unit = scale * stretch(loss);
            let weights: Vec<f64> = distances
                .iter()
                .map(|distance| psi_over_r(loss, distance / unit))
                .collect();
            // They have settled to √ε; after half of the rounds at a scale that stays as it is.
            let close = if outcome.rounds < 40 { 1e-6 } else { 1e-3 };
            for (k, weighed) in work.iter().enumerate() {
                assert!((weighed.weight() - weights[k]).abs() < close, "{k}");
                assert!((weighed.residual() / distances[k] - 1.0).abs() < 1e-5);
                assert_eq!(weighed.suspected(), weights[k] <= 0.0);
            }
            let mut gradient = SVector::<f64, 24>::zeros();
            let mut curvature = SMatrix::<f64, 24, 24>::zeros();
            let (mut weight, mut influence, mut moment, mut slope) = (0.0, 0.0, 0.0, 0.0);
            for ((sample, distance), w) in samples.iter().zip(&distances).zip(&weights) {
                if *w <= 0.0 {
                    continue;
                }
                let by_parameters = by_parameters(robot, sample);
                let weighted = by_parameters.transpose() * information(sample, &noise(times)) * *w;
                gradient += weighted * closures(robot, sample);
                curvature += weighted * by_parameters;
                let r = distance / scale;
                // ψ of a vector of three: one slope along it, and ψ/r across it twice.
                let along = match loss {
                    Loss::Huber => f64::from(distance / unit <= 1.345),
                    Loss::Tukey => {
                        let u = (distance / unit / 4.685).powi(2);
                        (1.0 - u) * (1.0 - 5.0 * u)
                    }
                };
                weight += w;
                influence += (w * r).powi(2) / 3.0;
                moment += w * r * r / 3.0;
                slope += (along + 2.0 * w) / 3.0;
            }
            let inverse = inverse_of(&curvature).unwrap();
            // The Newton step from there: a ten thousandth of a σ.
            let step = inverse * gradient;
            for k in 0..24 {
                assert!(step[k].abs() < close.max(1e-4) * inverse[(k, k)].sqrt());
            }
            // mean ψ² · mean w / (mean ψ r · mean ψ′) times (JᵀWJ)⁻¹.
            let factor = influence * weight / (moment * slope);
            assert!((0.55..1.3).contains(&factor), "{factor}");
            let found = outcome.fit.estimate.covariance.unwrap();
            for row in 0..24 {
                for column in 0..24 {
                    let unit = (inverse[(row, row)] * inverse[(column, column)]).sqrt() * factor;
                    let off = found[(row, column)] - inverse[(row, column)] * factor;
                    assert!(off.abs() < 1e-3 * unit, "{row} {column}");
                }
            }
        }
    }
}

/// Without a stated noise the residuals are in σ as well, of the noise that the fit found.
#[test]
fn without_a_stated_noise_residuals_are_in_units_of_the_estimated_one() {
    for loss in BOTH {
        let position_only = Noise::new(POSITION, 0.0).unwrap();
        let (_, samples) = case(21, 80, 8, Some(&position_only));
        let (outcome, work) = fit(&samples, &Settings::default(), loss);
        let outcome = outcome.unwrap();
        let sigma = outcome.fit.estimate.estimated_noise.unwrap();
        // 72 good samples: a few tenths of 20 µm, and a robust one is a little less sure.
        assert!((sigma / POSITION - 1.0).abs() < 0.35, "{sigma}");
        let millimetre = Noise::new(1.0, 0.0).unwrap();
        let distances = distances(&outcome.fit.robot, &samples, &millimetre);
        let unit = scale(&distances) * stretch(loss);
        for (weighed, distance) in work.iter().zip(&distances) {
            assert!((weighed.residual() * sigma / distance - 1.0).abs() < 1e-5);
            assert!((weighed.weight() - psi_over_r(loss, distance / unit)).abs() < 1e-6);
        }
    }
}

#[test]
fn a_work_space_without_room_is_refused() {
    let (_, samples) = case(31, 30, 4, Some(&noise(1.0)));
    let mut work = vec![WeighedSample::vacant(); 29];
    let outcome = robust_fit(
        &paper_robot(),
        &stated(1.0),
        &samples,
        Loss::Tukey,
        &mut work,
    );
    assert_eq!(outcome, Err(RobustRefusal::NoRoom { samples: 30 }));
}

#[test]
fn what_cannot_be_fitted_robustly_is_refused() {
    let (_, samples) = case(41, 17, 0, Some(&noise(1.0)));
    for count in [0, 15] {
        assert_eq!(
            fit(&samples[..count], &stated(1.0), Loss::Huber).0,
            Err(RobustRefusal::TooFewSamples {
                samples: count,
                needed: 16
            })
        );
    }
    for count in [16, 17] {
        let outcome = fit(&samples[..count], &stated(1.0), Loss::Huber).0;
        assert!(
            !matches!(outcome, Err(RobustRefusal::TooFewSamples { .. })),
            "{outcome:?}"
        );
    }
    let mut spoilt = samples.clone();
    spoilt[9].joints[1] = f64::NAN;
    assert_eq!(
        fit(&spoilt, &stated(1.0), Loss::Huber).0,
        Err(RobustRefusal::Sample(
            9,
            SampleError::JointNonFinite(ArmIndex::Second)
        ))
    );
    // Twenty times the same pose among a few others: what is left determines nothing.
    let (_, mut same) = case(42, 30, 0, None);
    let first = same[0];
    same.fill(first);
    assert!(matches!(
        fit(&same, &Settings::default(), Loss::Tukey).0,
        Err(RobustRefusal::Fit(Refusal::Undetermined { .. }))
    ));
}

/// Of sixty samples 24 are two fifths; with one more it is not known which are right.
#[test]
fn beyond_two_fifths_it_is_not_known_which_are_wrong() {
    let (_, good) = case(51, 60, 0, Some(&noise(1.0)));
    let spoilt = |count: usize| {
        let mut rng = generator(621, 0);
        let mut samples = good.clone();
        for sample in &mut samples[..count] {
            let by = [(); 3].map(|()| delta_cal_tests::uniform(&mut rng));
            sample.position += Vector3::from(by).normalize() * 30.0;
        }
        fit(&samples, &stated(1.0), Loss::Tukey).0
    };
    let outcome = spoilt(24).unwrap();
    assert_eq!(outcome.suspected, 24);
    assert_eq!(
        spoilt(25),
        Err(RobustRefusal::TooManySuspected {
            suspected: 25,
            samples: 60
        })
    );
}

#[test]
fn more_samples_than_the_start_looks_at() {
    let (truth, samples) = case(61, 700, 140, Some(&noise(1.0)));
    let (outcome, work) = fit(&samples, &stated(1.0), Loss::Tukey);
    let outcome = outcome.unwrap();
    assert_eq!(outcome.suspected, 140);
    assert!(
        work.iter()
            .enumerate()
            .all(|(index, weighed)| weighed.suspected() == is_wrong(index, 140))
    );
    // σ of the weakest parameter from 560 samples of 20 µm is some 30 µm.
    assert!(largest_difference(&outcome.fit.robot, &truth) < 0.15);
}
