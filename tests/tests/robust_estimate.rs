//! What a robust fit is, by the definitions of an M-estimate: its weights are those of its residuals, its
//! gradient vanishes, its covariance is Huber's.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

use delta_cal::classical::StoredCalibrator;
use delta_cal::robot::Arm;
use delta_cal::robust::{Loss, RobustOutcome, RobustRefusal, WeighedSample, robust_fit};
use delta_cal::samples::SampleError;
use delta_cal::{ArmIndex, Noise, Refusal, Robot, Sample, Settings};
use delta_cal_tests::{
    Spread, generator, largest_difference, measurements, paper_robot, perturbed,
};
use nalgebra::{SMatrix, SVector, Vector3};

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

/// f/σf of an arm at a sample, σf at the robot before calibration.
fn residual(arm: &Arm<f64>, index: ArmIndex, sample: &Sample<f64>, noise: &Noise<f64>) -> f64 {
    let q = sample.joints[index.index()];
    arm.constraint(&sample.position, q) / deviation(index, sample, noise)
}

fn deviation(index: ArmIndex, sample: &Sample<f64>, noise: &Noise<f64>) -> f64 {
    let nominal = *paper_robot::<f64>().arm(index);
    let q = sample.joints[index.index()];
    (2.0 * nominal.lb() * noise.position())
        .hypot(nominal.constraint_by_joint(&sample.position, q) * noise.joint())
}

/// The scale: the median of |r| over that of a normal number, with eight degrees of freedom lost.
fn scale(residuals: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let count = sizes.len();
    let median = f64::midpoint(sizes[(count - 1) / 2], sizes[count / 2]);
    median / 0.6745 * (count as f64 / (count as f64 - 8.0)).sqrt()
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
                for arm in &outcome.fit.arms {
                    assert_eq!(arm.samples, (count - wrong) as u64);
                }
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
            let mut weights = vec![1.0; count];
            let mut largest = vec![(ArmIndex::First, -1.0); count];
            let mut all = Vec::new();
            for index in ArmIndex::ALL {
                let arm = outcome.fit.robot.arm(index);
                let residuals: Vec<f64> = samples
                    .iter()
                    .map(|sample| residual(arm, index, sample, &noise(times)))
                    .collect();
                all.push((index, residuals));
            }
            // The largest of the arms' scales; the stated noise keeps it at 1 or above.
            let scale = all
                .iter()
                .map(|(_, residuals)| scale(residuals))
                .fold(1.0, f64::max);
            for (index, residuals) in &all {
                for (k, r) in residuals.iter().enumerate() {
                    weights[k] = f64::min(weights[k], psi_over_r(loss, r / scale));
                    if r.abs() > largest[k].1 {
                        largest[k] = (*index, r.abs());
                    }
                }
            }
            // They have settled to √ε; after half of the rounds at scales that stay as they are.
            let close = if outcome.rounds < 40 { 1e-6 } else { 1e-3 };
            for (k, weighed) in work.iter().enumerate() {
                assert!((weighed.weight() - weights[k]).abs() < close, "{k}");
                assert_eq!(weighed.residual().0, largest[k].0);
                assert!((weighed.residual().1 / largest[k].1 - 1.0).abs() < 1e-5);
                assert_eq!(weighed.suspected(), weights[k] <= 0.0);
            }
            for (index, residuals) in &all {
                let arm = outcome.fit.robot.arm(*index);
                let mut gradient = SVector::<f64, 8>::zeros();
                let mut information = SMatrix::<f64, 8, 8>::zeros();
                let (mut weight, mut influence, mut moment, mut slope) = (0.0, 0.0, 0.0, 0.0);
                for ((sample, r), counted) in samples.iter().zip(residuals).zip(&weights) {
                    if *counted <= 0.0 {
                        continue;
                    }
                    let q = sample.joints[index.index()];
                    let row = arm.constraint_by_parameters(&sample.position, q)
                        / deviation(*index, sample, &noise(times));
                    let w = psi_over_r(loss, r / scale);
                    gradient += row * (w * r);
                    information += row * row.transpose() * w;
                    weight += w;
                    influence += (w * r).powi(2);
                    moment += w * r * r;
                    slope += match loss {
                        Loss::Huber => f64::from(r.abs() / scale <= 1.345),
                        Loss::Tukey => {
                            let u = (r / scale / 4.685).powi(2);
                            (1.0 - u) * (1.0 - 5.0 * u)
                        }
                    };
                }
                let covariance = information.try_inverse().unwrap();
                // The Newton step from there: a ten thousandth of a σ.
                let step = covariance * gradient;
                for k in 0..8 {
                    assert!(step[k].abs() < close.max(1e-4) * covariance[(k, k)].sqrt());
                }
                // mean ψ² · mean w / (mean ψ r · mean ψ′) times (JᵀWJ)⁻¹.
                let factor = influence * weight / (moment * slope);
                assert!((0.55..1.3).contains(&factor), "{factor}");
                let found = outcome.fit.arms[index.index()].covariance.unwrap();
                let expected = covariance * factor;
                assert!((found - expected).norm() < 1e-3 * expected.norm());
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
        let mut largest = vec![0.0_f64; samples.len()];
        let mut weights = vec![1.0_f64; samples.len()];
        let mut all = Vec::new();
        for (index, calibrated) in ArmIndex::ALL.into_iter().zip(&outcome.fit.arms) {
            let sigma = calibrated.estimated_noise.unwrap();
            // 72 good samples: a few tenths of 20 µm, and a robust one is a little less sure.
            assert!((sigma / POSITION - 1.0).abs() < 0.35, "{sigma}");
            let distances: Vec<f64> = samples
                .iter()
                .map(|sample| {
                    let q = sample.joints[index.index()];
                    calibrated.arm.constraint(&sample.position, q)
                        / (2.0 * paper_robot::<f64>().arm(index).lb())
                })
                .collect();
            all.push((sigma, distances));
        }
        let scale = all
            .iter()
            .map(|(_, distances)| scale(distances))
            .fold(0.0, f64::max);
        for (sigma, distances) in &all {
            for (k, distance) in distances.iter().enumerate() {
                largest[k] = largest[k].max((distance / sigma).abs());
                weights[k] = weights[k].min(psi_over_r(loss, distance / scale));
            }
        }
        for (k, weighed) in work.iter().enumerate() {
            assert!((weighed.residual().1 / largest[k] - 1.0).abs() < 1e-5);
            assert!((weighed.weight() - weights[k]).abs() < 1e-6);
        }
    }
}

#[test]
fn stored_samples_give_the_same_fit() {
    let (_, samples) = case(31, 30, 4, Some(&noise(1.0)));
    for settings in [Settings::default(), stated(1.0)] {
        let (outcome, work) = fit(&samples, &settings, Loss::Tukey);
        let mut calibrator = StoredCalibrator::<f64, 30>::new(&paper_robot(), &settings);
        for sample in &samples {
            calibrator.add(sample).unwrap();
        }
        let mut other = vec![WeighedSample::vacant(); 30];
        assert_eq!(calibrator.solve_robust(Loss::Tukey, &mut other), outcome);
        assert_eq!(other, work);
        assert_eq!(
            calibrator.solve_robust(Loss::Tukey, &mut other[..29]),
            Err(RobustRefusal::NoRoom { samples: 30 })
        );
    }
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
