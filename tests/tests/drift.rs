//! Forgetting: the estimate follows a robot that changes slowly, with the lag and the variance that
//! theory has for it.

use delta_cal::robot::Arm;
use delta_cal::stream::Forgetting;
use delta_cal::{Calibrator, Noise, Parameter, Robot, Sample, Settings, Tolerance};
use delta_cal_tests::{Spread, generator, measurements, paper_limits, paper_robot, perturbed};
use nalgebra::{SMatrix, SVector};
use rand_pcg::Pcg32;

const DEGREE: f64 = std::f64::consts::PI / 180.0;

fn noise() -> Noise<f64> {
    Noise::new(0.02, 0.002 * DEGREE).unwrap()
}

fn settings() -> Settings<f64> {
    Settings::default().with_noise(noise())
}

/// The second arm's parameter moved.
fn moved(robot: &Robot<f64>, parameter: Parameter, by: f64) -> Robot<f64> {
    let mut arms = *robot.arms();
    let mut parameters = arms[1].parameters();
    parameters[parameter.index()] += by;
    arms[1] = Arm::new(parameters).unwrap();
    Robot::new(arms).unwrap()
}

/// Measurements of a robot of which one parameter grows by `rate` a sample.
fn warming(
    truth: &Robot<f64>,
    parameter: Parameter,
    rate: f64,
    samples: usize,
    rng: &mut Pcg32,
) -> Vec<Sample<f64>> {
    (0..samples)
        .map(|index| {
            let now = moved(truth, parameter, rate * index as f64);
            let pose = delta_cal::simulate::random_pose(&now, &paper_limits(), rng).unwrap();
            delta_cal::simulate::simulate_sample(&now, &pose.joints, Some(&noise()), rng).unwrap()
        })
        .collect()
}

fn followed(samples: &[Sample<f64>], memory: f64, settings: &Settings<f64>) -> Robot<f64> {
    let memory = Forgetting::new(memory).unwrap();
    let mut calibrator = Calibrator::new(&paper_robot(), settings);
    for sample in samples {
        calibrator.add_forgetting(sample, &memory).unwrap();
    }
    calibrator.solve().unwrap().robot
}

/// What theory has of weighted least squares on these samples of the second arm: with the rows h over
/// their σ, A = Σ λᵏ hhᵀ and B = Σ λ²ᵏ hhᵀ.
struct Theory {
    /// A⁻¹ B A⁻¹: the weights are not the noise's.
    variance: f64,
    /// Σ k λᵏ A⁻¹ h hⱼ: by how many samples the estimate lags behind a ramp of the parameter j.
    lag: f64,
}

impl Theory {
    fn new(truth: &Robot<f64>, samples: &[Sample<f64>], memory: f64, parameter: Parameter) -> Self {
        let lambda = memory / (memory + 1.0);
        let arm = &truth.arms()[1];
        let index = parameter.index();
        let (mut a, mut b) = (SMatrix::<f64, 8, 8>::zeros(), SMatrix::zeros());
        let mut aged = SVector::<f64, 8>::zeros();
        for (age, sample) in samples.iter().rev().enumerate() {
            let (x, q) = (&sample.position, sample.joints[1]);
            let row = arm.constraint_by_parameters(x, q);
            let variance = (arm.constraint_by_position(x, q).norm() * noise().position()).powi(2)
                + (arm.constraint_by_joint(x, q) * noise().joint()).powi(2);
            let weight = lambda.powi(i32::try_from(age).unwrap());
            a += row * row.transpose() * (weight / variance);
            b += row * row.transpose() * (weight * weight / variance);
            aged += row * (row[index] * age as f64 * weight / variance);
        }
        let inverse = a.try_inverse().unwrap();
        Self {
            variance: (inverse * b * inverse)[(index, index)],
            lag: (inverse * aged)[index],
        }
    }
}

/// Mean and how well it is known.
fn mean(values: &[f64]) -> (f64, f64) {
    let number = values.len() as f64;
    let mean = values.iter().sum::<f64>() / number;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / number / number).sqrt())
}

#[test]
fn the_estimate_follows_a_ramp_with_the_lag_and_the_variance_that_theory_has() {
    for (campaign, memory, parameter, robots) in [
        (960, 20_usize, Parameter::Lb, 400),
        (963, 50_usize, Parameter::Theta, 400),
        (964, 200_usize, Parameter::Lb, 200),
    ] {
        let samples = 8 * memory;
        let memory = f64::from(u32::try_from(memory).unwrap());
        let (mut lags, mut expected_lags, mut apart) = (Vec::new(), Vec::new(), Vec::new());
        let (mut squared_z, mut worth) = (0.0, 0.0);
        for number in 0..robots {
            let mut rng = generator(campaign, number);
            let truth = perturbed(&paper_robot(), 0.5, 0.2 * DEGREE, Spread::Normal, &mut rng);
            let value = |robot: &Robot<f64>| robot.arms()[1].get(parameter);
            // The same poses and the same noise, without the ramp and with it.
            let still = warming(&truth, parameter, 0.0, samples, &mut rng.clone());
            let theory = Theory::new(&truth, &still, memory, parameter);
            let error = value(&followed(&still, memory, &settings())) - value(&truth);
            squared_z += error * error / theory.variance;
            // What the samples are worth: the variance of one sample over that of the estimate.
            let alike = Theory::new(&truth, &still, 1e12, parameter).variance;
            worth += alike * samples as f64 / theory.variance;

            // So slow that no residual shows it; the same noise without the ramp takes the noise out.
            let rate = 0.1 * theory.variance.sqrt() / memory;
            let ramp = warming(&truth, parameter, rate, samples, &mut rng);
            let end = value(&truth) + rate * (samples - 1) as f64;
            let lag = (end - value(&followed(&ramp, memory, &settings())) + error) / rate;
            lags.push(lag);
            expected_lags.push(theory.lag);
            apart.push(lag - theory.lag);
        }
        let ((lag, spread), (expected, _)) = (mean(&lags), mean(&expected_lags));
        let (apart, known) = mean(&apart);
        let number = robots as f64;
        let z = (squared_z / number).sqrt();
        println!(
            "| {parameter}, N = {memory} | {lag:.1} ± {spread:.1} | {expected:.1} | {apart:.1} ± \
                 {known:.1} | {z:.2} | {:.0} |",
            worth / number,
        );
        // Forgetting by blocks of four shifts the weights by less than half a sample.
        assert!(apart.abs() < 4.0 * known + 0.5, "{apart} ± {known}");
        // The root mean square of so many numbers is known to 1/√(2 number).
        assert!((z - 1.0).abs() < 4.0 / (2.0 * number).sqrt(), "{z}");
        // Of few samples the newest have more leverage than their weight, and the lag is longer.
        if memory >= 200.0 {
            assert!((lag - memory).abs() < 4.0 * spread, "{lag} ± {spread}");
        } else {
            assert!(lag > memory - 4.0 * spread);
        }
    }
}

/// However long ago the tolerance was stated, it counts: with a memory of two samples it decides part
/// of every result, and without it there is none.
#[test]
fn the_prior_is_not_forgotten() {
    let rough = Noise::new(0.2, 0.02 * DEGREE).unwrap();
    let tolerance = Tolerance::new(0.5, 0.2 * DEGREE).unwrap();
    let with = Settings::default()
        .with_noise(rough)
        .with_tolerance(tolerance);
    let mut share = 0.0_f64;
    for number in 0..100 {
        let mut rng = generator(965, number);
        let truth = perturbed(&paper_robot(), 0.5, 0.2 * DEGREE, Spread::Normal, &mut rng);
        let memory = Forgetting::new(2.0).unwrap();
        let mut calibrator = Calibrator::new(&paper_robot(), &with);
        for sample in measurements(&truth, 300, Some(&rough), &mut rng) {
            calibrator.add_forgetting(&sample, &memory).unwrap();
        }
        for arm in &calibrator.solve().unwrap().arms {
            for parameter in Parameter::ROTARY {
                let sigma = arm.standard_deviation(parameter).unwrap();
                assert!(sigma <= tolerance.of(parameter) * 1.000_001);
            }
            share += arm.prior_share.mean() / 300.0;
        }
    }
    println!(
        "memory of two samples: the tolerance decides {:.0} % of a parameter",
        100.0 * share
    );
    assert!(share > 0.3);
}
