//! The FKM method: exact data return the robot, noisy data SciPy's optimum.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation
)]

use delta_cal::calibration::{Solver, Start, StartUsed};
use delta_cal::{
    ArmIndex, Calibrator, Noise, Parameter, Refusal, Robot, Sample, Settings, SymmetricRobot,
    Tolerance,
};
use delta_cal_host::accuracy::evaluation::differences;
use delta_cal_host::fit::fkm;
use delta_cal_host::fit::fkm::Linearization;
use delta_cal_tests::goldens::{GoldenInput, number, numbers};
use delta_cal_tests::{
    Spread, generator, largest_difference, measurements, paper_robot, perturbed,
};
use nalgebra::{SMatrix, Vector3};
use serde::Deserialize;

const ROBOTS: u64 = 500;

/// A robot off by up to 1 cm and 1°, measured exactly.
fn case(campaign: u64, robot: u64, count: usize) -> (Robot<f64>, Vec<Sample<f64>>) {
    let mut rng = generator(campaign, robot);
    let angle = 1f64.to_radians();
    let truth = perturbed(&paper_robot(), 10.0, angle, Spread::Uniform, &mut rng);
    let samples = measurements(&truth, count, None, &mut rng);
    (truth, samples)
}

#[test]
fn nine_or_more_poses_return_500_of_500_robots_to_1e_6_mm() {
    for count in [9, 12, 20, 60] {
        let (mut by_itself, mut worst) = (0, 0f64);
        let mut iterations = 0;
        let mut failures = Vec::new();
        for robot in 0..ROBOTS {
            let (truth, samples) = case(31, robot, count);
            match fkm::calibrate(&paper_robot(), &samples, &Settings::default()) {
                Ok(outcome) => {
                    let error = largest_difference(&outcome.fit.robot, &truth);
                    let [arm, ..] = outcome.fit.arms;
                    if !(error < 1e-6) {
                        failures.push((robot, format!("{error:e} mm")));
                    }
                    worst = worst.max(error);
                    by_itself += usize::from(arm.start == StartUsed::Nominal);
                    iterations = iterations.max(arm.iterations);
                }
                Err(refusal) => failures.push((robot, refusal.to_string())),
            }
        }
        println!(
            "{count} poses: {} of {ROBOTS} returned, {by_itself} from the nominal start, worst \
             {worst:.1e} mm, at most {iterations} iterations",
            ROBOTS as usize - failures.len()
        );
        assert!(failures.is_empty(), "{count} poses: {failures:?}");
    }
}

#[test]
fn gauss_newton_returns_the_robots_from_a_millimetre_as_well() {
    let settings = Settings::default().with_solver(Solver::GaussNewton);
    for robot in 0..100 {
        let mut rng = generator(32, robot);
        let angle = 0.1f64.to_radians();
        let truth = perturbed(&paper_robot(), 1.0, angle, Spread::Uniform, &mut rng);
        let samples = measurements(&truth, 20, None, &mut rng);
        let outcome = fkm::calibrate(&paper_robot(), &samples, &settings).unwrap();
        let [arm, ..] = outcome.fit.arms;
        assert_eq!(arm.start, StartUsed::Nominal, "robot {robot}");
        let error = largest_difference(&outcome.fit.robot, &truth);
        assert!(error < 1e-6, "robot {robot}: {error:e} mm");
    }
}

#[test]
fn twelve_poses_return_the_robots_without_a_guess() {
    // A robot that resembles the true one in nothing.
    let no_guess = SymmetricRobot {
        base_radius: 120.0,
        platform_radius: 60.0,
        upper_arm: 150.0,
        forearm: 700.0,
    }
    .robot_from_azimuth(40f64.to_radians())
    .unwrap();
    let settings = Settings::default().with_start(Start::Free);
    for count in [12, 20] {
        for robot in 0..100 {
            let (truth, samples) = case(35, robot, count);
            let outcome = fkm::calibrate(&no_guess, &samples, &settings).unwrap();
            assert_eq!(outcome.fit.arms[0].start, StartUsed::Free);
            let error = differences(&outcome.fit.robot, &truth).amax();
            assert!(error < 1e-6, "{count} poses, robot {robot}: {error:e} mm");
        }
    }
    let (_, samples) = case(35, 0, 11);
    assert_eq!(
        fkm::calibrate(&no_guess, &samples, &settings),
        Err(Refusal::TooFewSamples {
            arm: ArmIndex::First,
            samples: 11,
            needed: 12
        })
    );
}

#[test]
fn a_start_that_does_not_reach_the_samples_is_replaced() {
    let short = SymmetricRobot {
        base_radius: 194.0,
        platform_radius: 30.0,
        upper_arm: 260.0,
        forearm: 300.0,
    }
    .robot()
    .unwrap();
    for robot in 0..20 {
        let (truth, samples) = case(36, robot, 20);
        assert!(
            samples
                .iter()
                .any(|sample| short.forward(&sample.joints).is_err())
        );
        let outcome = fkm::calibrate(&short, &samples, &Settings::default()).unwrap();
        assert_eq!(outcome.fit.arms[0].start, StartUsed::Joint);
        let error = differences(&outcome.fit.robot, &truth).amax();
        assert!(error < 1e-6, "robot {robot}: {error:e} mm");
    }
}

/// Eight exact poses have several solutions: that of the FKM method fits, and is no farther from the
/// start than that of the IKM method.
#[test]
fn eight_exact_poses_lead_to_an_exact_solution() {
    let nominal = paper_robot::<f64>();
    let (mut returned, mut refused) = (0, 0);
    for robot in 0..ROBOTS {
        let (truth, samples) = case(33, robot, 8);
        let Ok(outcome) = fkm::calibrate(&nominal, &samples, &Settings::default()) else {
            refused += 1;
            continue;
        };
        let found = outcome.fit.robot;
        for sample in &samples {
            let position = found.forward(&sample.joints).unwrap();
            assert!((position - sample.position).norm() < 1e-6, "robot {robot}");
        }
        returned += usize::from(largest_difference(&found, &truth) < 1e-6);
        let mut calibrator = Calibrator::new(&nominal, &Settings::default());
        calibrator.add_many(&samples).unwrap();
        if let Ok(ikm) = calibrator.solve() {
            let far = |robot: &Robot<f64>| differences(robot, &nominal).norm();
            // The two metrics differ by little: angles times 260 mm here, 256 there.
            assert!(far(&found) < 1.01 * far(&ikm.robot), "robot {robot}");
        }
    }
    delta_cal_tests::documents::print_documented(
        "docs/benchmarks.md",
        &format!("| FKM method, 8 random poses | {returned} of {ROBOTS} |"),
    );
    assert_eq!(refused, 0);
}

/// (3.18) against central differences of the forward kinematics.
#[test]
fn jacobian_is_that_of_the_forward_kinematics() {
    for robot in 0..50 {
        let (truth, samples) = case(34, robot, 1);
        let [sample] = samples.try_into().unwrap();
        let jacobian = Linearization::new(&truth, &sample.joints)
            .unwrap()
            .jacobian();
        let core = truth
            .platform_jacobian(&sample.position, &sample.joints)
            .unwrap();
        for arm in 0..3 {
            for parameter in 0..8 {
                let step = if parameter == 3 || parameter == 4 {
                    1e-6
                } else {
                    1e-4
                };
                let moved = |by: f64| -> Vector3<f64> {
                    let mut arms = *truth.arms();
                    let mut p = arms[arm].parameters();
                    p[parameter] += by;
                    arms[arm] = delta_cal::robot::Arm::new(p).unwrap();
                    Robot::new(arms).unwrap().forward(&sample.joints).unwrap()
                };
                let expected = (moved(step) - moved(-step)) / (2.0 * step);
                let column = jacobian.column(8 * arm + parameter);
                // Differences of positions known to 1e-12 mm or so, and third derivatives, which
                // grow towards singular poses.
                let error = (column - expected).norm();
                assert!(
                    error < 1e-6 * (1.0 + expected.norm()),
                    "robot {robot}, arm {arm}, parameter {parameter}: {error:e}"
                );
                let other = (column - core.by_parameters[arm].column(parameter)).norm();
                assert!(other < 1e-10 * (1.0 + expected.norm()));
            }
        }
    }
}

#[derive(Deserialize)]
struct Goldens {
    cases: Vec<Golden>,
}

#[derive(Deserialize)]
struct Golden {
    #[serde(flatten)]
    input: GoldenInput,
    parameters: Vec<String>,
    covariance: Vec<String>,
    cost: String,
}

#[test]
fn both_solvers_reach_scipys_optimum() {
    let goldens: Goldens = serde_json::from_str(include_str!("../goldens/scipy_fkm.json")).unwrap();
    assert_eq!(goldens.cases.len(), 8);
    for (index, golden) in goldens.cases.iter().enumerate() {
        let samples = golden.input.samples();
        for method in [Solver::LevenbergMarquardt, Solver::GaussNewton] {
            let settings = golden.input.settings().with_solver(method);
            let outcome = fkm::calibrate(&paper_robot(), &samples, &settings).unwrap();
            // Without weights SciPy's residuals are in mm and its covariance unscaled: times
            // cost/ν, and ν/(ν − 2) for Student's t.
            let spare = 3.0 * samples.len() as f64 - 24.0;
            let variance = if settings.noise.is_some() {
                1.0
            } else {
                number(&golden.cost) / (spare - 2.0)
            };
            let covariance = SMatrix::<f64, 24, 24>::from_row_slice(&numbers(&golden.covariance));
            let covariance = covariance * variance;
            let found = outcome.covariance.unwrap();
            let sigma = covariance.diagonal().map(f64::sqrt);
            let mut deviation = 0f64;
            for (k, expected) in numbers(&golden.parameters).into_iter().enumerate() {
                let value = outcome.fit.robot.arms()[k / 8].parameters()[k % 8];
                deviation = deviation.max(((value - expected) / sigma[k]).abs());
            }
            let mut off = 0f64;
            for i in 0..24 {
                for j in 0..24 {
                    let error = (found[(i, j)] - covariance[(i, j)]) / (sigma[i] * sigma[j]);
                    off = off.max(error.abs());
                }
            }
            println!("case {index} {method:?}: {deviation:.1e} σ, covariance {off:.1e}");
            // As for the IKM method: SciPy's end points come from finite differences, and these know
            // the Jacobian to 1e-8 or so, which the covariance multiplies by the condition.
            assert!(deviation < 1e-4, "case {index}: {deviation:e} σ from SciPy");
            assert!(off < 1e-3, "case {index}: covariance off by {off:e}");
        }
    }
}

/// With a tolerance a single sample will do, with a stated noise or without.
#[test]
fn one_sample_and_a_tolerance_leave_the_robot_near_nominal() {
    let (_, samples) = case(78, 0, 1);
    for noise in [None, Some(Noise::new(0.01, 0.0).unwrap())] {
        let settings = Settings::default()
            .with_noise(noise)
            .with_tolerance(Tolerance::new(10.0, 0.02).unwrap());
        let outcome = fkm::calibrate(&paper_robot(), &samples, &settings).unwrap();
        let error =
            (outcome.fit.robot.forward(&samples[0].joints).unwrap() - samples[0].position).norm();
        assert!(error < 0.1, "{error}");
        for arm in outcome.fit.arms {
            assert!(
                arm.prior_share
                    .iter()
                    .all(|share| (0.0..=1.0).contains(share))
            );
            let decided: f64 = arm.prior_share.sum();
            // Three equations for three times eight parameters.
            assert!(decided > 6.0, "{decided}");
            assert!(
                arm.standard_deviation(Parameter::Lb)
                    .is_none_or(|s| s < 10.1)
            );
        }
    }
}
