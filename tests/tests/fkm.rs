//! The FKM method: exact data return the robot, noisy data the statistics that they should.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

use delta_cal::{
    ArmIndex, Calibrator, Method, Noise, Parameter, Refusal, Robot, Sample, Settings, Start,
    StartUsed, SymmetricRobot, Tolerance,
};
use delta_cal_host::CalibrationMethod;
use delta_cal_host::evaluation::{CramerRaoBound, Evaluation, differences};
use delta_cal_host::fkm::{self, Linearization};
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
                    let error = largest_difference(&outcome.robot.robot, &truth);
                    let [arm, ..] = outcome.robot.arms;
                    if !(error < 1e-6) {
                        failures.push((robot, format!("{error:e} mm")));
                    }
                    worst = worst.max(error);
                    by_itself += usize::from(arm.start == StartUsed::Reference);
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
    let settings = Settings {
        method: Method::GaussNewton,
        ..Settings::default()
    };
    for robot in 0..100 {
        let mut rng = generator(32, robot);
        let angle = 0.1f64.to_radians();
        let truth = perturbed(&paper_robot(), 1.0, angle, Spread::Uniform, &mut rng);
        let samples = measurements(&truth, 20, None, &mut rng);
        let outcome = fkm::calibrate(&paper_robot(), &samples, &settings).unwrap();
        let [arm, ..] = outcome.robot.arms;
        assert_eq!(arm.start, StartUsed::Reference, "robot {robot}");
        let error = largest_difference(&outcome.robot.robot, &truth);
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
    let settings = Settings {
        start: Start::Free,
        ..Settings::default()
    };
    for count in [12, 20] {
        for robot in 0..100 {
            let (truth, samples) = case(35, robot, count);
            let outcome = fkm::calibrate(&no_guess, &samples, &settings).unwrap();
            assert_eq!(outcome.robot.arms[0].start, StartUsed::Free);
            let error = differences(&outcome.robot.robot, &truth).amax();
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
        let found = outcome.robot.robot;
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
    println!("8 poses: {returned} of {ROBOTS} returned, {refused} refused, others fit as well");
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
                    let mut p = arms[arm].parameters().data.0[0];
                    p[parameter] += by;
                    arms[arm] = delta_cal::Arm::new(p).unwrap();
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
    joints: Vec<String>,
    positions: Vec<String>,
    noise: Option<[String; 2]>,
    tolerance: Option<[String; 2]>,
    parameters: Vec<String>,
    covariance: Vec<String>,
    cost: String,
}

fn number(bits: &str) -> f64 {
    f64::from_bits(u64::from_str_radix(bits, 16).unwrap())
}

fn numbers(bits: &[String]) -> Vec<f64> {
    bits.iter().map(|bits| number(bits)).collect()
}

#[test]
fn both_solvers_reach_scipys_optimum() {
    let goldens: Goldens = serde_json::from_str(include_str!("../goldens/scipy_fkm.json")).unwrap();
    assert_eq!(goldens.cases.len(), 8);
    for (index, golden) in goldens.cases.iter().enumerate() {
        let samples: Vec<_> = numbers(&golden.joints)
            .chunks(3)
            .zip(numbers(&golden.positions).chunks(3))
            .map(|(q, x)| Sample {
                joints: [q[0], q[1], q[2]],
                position: Vector3::new(x[0], x[1], x[2]),
            })
            .collect();
        let pair = |bits: &[String; 2]| (number(&bits[0]), number(&bits[1]));
        for method in [Method::LevenbergMarquardt, Method::GaussNewton] {
            let settings = Settings {
                noise: golden.noise.as_ref().map(|bits| {
                    let (position, joint) = pair(bits);
                    Noise::new(position, joint).unwrap()
                }),
                tolerance: golden.tolerance.as_ref().map(|bits| {
                    let (length, angle) = pair(bits);
                    Tolerance::new(length, angle).unwrap()
                }),
                method,
                ..Settings::default()
            };
            let outcome = fkm::calibrate(&paper_robot(), &samples, &settings).unwrap();
            // Without weights SciPy's residuals are in mm and its covariance unscaled: times
            // cost/ν, and ν/(ν − 2) for Student's t.
            let spare = 3.0 * samples.len() as f64 - 24.0;
            let variance = if golden.noise.is_some() {
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
                let value = outcome.robot.robot.arms()[k / 8].parameters()[k % 8];
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

struct Campaign {
    number: u64,
    robots: u64,
    poses: usize,
    /// mm and radians.
    start_error: (f64, f64),
    noise: (f64, f64),
    spread: Spread,
    prior: bool,
}

#[derive(Default)]
struct Statistics {
    gains: Vec<f64>,
    z_squared: Vec<f64>,
    error_squared: f64,
    bound_squared: f64,
    refused: usize,
}

fn run(campaign: &Campaign) -> Statistics {
    let nominal = paper_robot::<f64>();
    let (length, angle) = campaign.start_error;
    let noise = Noise::new(campaign.noise.0, campaign.noise.1).unwrap();
    let tolerance = campaign
        .prior
        .then(|| Tolerance::new(length, angle).unwrap());
    let settings = Settings {
        noise: Some(noise),
        tolerance,
        ..Settings::default()
    };
    let mut statistics = Statistics::default();
    for robot in 0..campaign.robots {
        let mut rng = generator(campaign.number, robot);
        let truth = perturbed(&nominal, length, angle, campaign.spread, &mut rng);
        let samples = measurements(&truth, campaign.poses, Some(&noise), &mut rng);
        let Ok(outcome) = fkm::calibrate(&nominal, &samples, &settings) else {
            statistics.refused += 1;
            continue;
        };
        let evaluation = Evaluation {
            truth: &truth,
            before: &nominal,
            after: &outcome.robot.robot,
        };
        statistics.gains.push(evaluation.gain());
        let covariance = outcome.covariance.unwrap();
        let errors = differences(&outcome.robot.robot, &truth);
        for (index, error) in errors.iter().enumerate() {
            let is_angle = index % 8 == 3 || index % 8 == 4;
            let unit = if is_angle {
                truth.arms()[index / 8].upper_arm_length()
            } else {
                1.0
            };
            let sigma = covariance[(index, index)].sqrt() * unit;
            statistics.z_squared.push((error / sigma).powi(2));
        }
        statistics.error_squared += errors.norm_squared();
        let joints: Vec<_> = samples.iter().map(|sample| sample.joints).collect();
        let method = CalibrationMethod::Fkm;
        statistics.bound_squared +=
            CramerRaoBound::new(method, &truth, &joints, &noise, tolerance.as_ref())
                .unwrap()
                .error()
                .powi(2);
    }
    statistics.gains.sort_by(f64::total_cmp);
    statistics
}

fn rms(squares: &[f64]) -> f64 {
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn z_scores_have_rms_between_0_9_and_1_1_and_errors_reach_the_cramer_rao_bound() {
    let degree = 1f64.to_radians();
    for (number, poses, noise) in [
        (61, 20, (0.001, 0.001 * degree)),
        (62, 20, (0.01, 0.01 * degree)),
        (63, 40, (0.05, 0.002 * degree)),
        (64, 60, (0.001, 0.01 * degree)),
    ] {
        let result = run(&Campaign {
            number,
            robots: 300,
            poses,
            start_error: (1.0, degree),
            noise,
            spread: Spread::Uniform,
            prior: false,
        });
        let z = rms(&result.z_squared);
        let ratio = (result.error_squared / result.bound_squared).sqrt();
        println!("{poses} poses, noise {noise:?}: z rms {z:.3}, error/bound {ratio:.3}");
        assert_eq!(result.refused, 0);
        assert!((0.9..=1.1).contains(&z), "{poses} poses: z rms {z}");
        // 7,200 numbers whose own scatter is some 3 %, heavy-tailed poses included: as the IKM
        // method's.
        assert!(
            (0.9..=1.1).contains(&ratio),
            "{poses} poses: error over bound {ratio}"
        );
    }
}

#[test]
fn with_a_prior_the_covariance_is_right_for_robots_drawn_from_it() {
    let degree = 1f64.to_radians();
    for (number, poses) in [(66, 5), (67, 8), (68, 20)] {
        let result = run(&Campaign {
            number,
            robots: 300,
            poses,
            start_error: (0.1, 0.1 * degree),
            noise: (0.001, 0.01 * degree),
            spread: Spread::Normal,
            prior: true,
        });
        let z = rms(&result.z_squared);
        let ratio = (result.error_squared / result.bound_squared).sqrt();
        println!("{poses} poses with prior: z rms {z:.3}, error/bound {ratio:.3}");
        assert_eq!(result.refused, 0);
        assert!((0.9..=1.1).contains(&z), "{poses} poses: z rms {z}");
        assert!(
            (0.9..=1.1).contains(&ratio),
            "{poses} poses: error over bound {ratio}"
        );
    }
}

/// The paper's FKM noise case: start error 0.1 mm/0.1°, σx 1 µm, σq 0.01°; its gains are −38.54, 20,
/// 38 and 45.38 %.
#[test]
fn with_a_prior_every_gain_is_above_the_papers_and_positive() {
    let degree = 1f64.to_radians();
    for (number, poses, paper) in [
        (71, 8, -38.54),
        (72, 20, 20.0),
        (73, 40, 38.0),
        (74, 60, 45.38),
    ] {
        let result = run(&Campaign {
            number,
            robots: 300,
            poses,
            start_error: (0.1, 0.1 * degree),
            noise: (0.001, 0.01 * degree),
            spread: Spread::Uniform,
            prior: true,
        });
        let median = result.gains[result.gains.len() / 2];
        println!(
            "{poses} poses: median gain {median:.1} %, worst robot {:.1} %; paper {paper} %",
            result.gains[0]
        );
        assert_eq!(result.refused, 0);
        assert!(median > 0.0 && median > paper, "{poses} poses: {median} %");
    }
}

/// Without joint noise the FKM method's bound is that of least squares on the positions. The IKM
/// method's, whose weights leave the correlation between the arms' closure errors out of account, is
/// never below it, and equal where the joints' noise, which has none, is all there is.
#[test]
fn bounds_are_those_of_the_measurements() {
    let degree = 1f64.to_radians();
    for robot in 0..20 {
        let (truth, samples) = case(75, robot, 20);
        let joints: Vec<_> = samples.iter().map(|sample| sample.joints).collect();
        let noise = Noise::new(0.01, 0.0).unwrap();
        let bound = CramerRaoBound::new(CalibrationMethod::Fkm, &truth, &joints, &noise, None);
        let mut information = SMatrix::<f64, 24, 24>::zeros();
        for sample in &samples {
            let core = truth
                .platform_jacobian(&sample.position, &sample.joints)
                .unwrap();
            let mut jacobian = SMatrix::<f64, 3, 24>::zeros();
            for (arm, block) in core.by_parameters.iter().enumerate() {
                jacobian.fixed_columns_mut::<8>(8 * arm).copy_from(block);
                for angle in [3, 4] {
                    let mut column = jacobian.column_mut(8 * arm + angle);
                    column /= truth.arms()[arm].upper_arm_length();
                }
            }
            information += jacobian.transpose() * jacobian / 0.01f64.powi(2);
        }
        let expected = information.try_inverse().unwrap();
        let found = bound.unwrap();
        // The sums lose twice the condition's digits.
        let error = (found.covariance - expected).norm() / expected.norm();
        assert!(error < 1e-6, "robot {robot}: {error:e}");

        let ratio = |position: f64, joint: f64| {
            let noise = Noise::new(position, joint).unwrap();
            let of = |method| CramerRaoBound::new(method, &truth, &joints, &noise, None).unwrap();
            of(CalibrationMethod::Ikm).error() / of(CalibrationMethod::Fkm).error()
        };
        let (positions, joints) = (ratio(0.01, 0.0), ratio(1e-6, 0.01 * degree));
        println!("bound of the IKM method over that of the FKM: {positions:.3}, {joints:.6}");
        assert!(positions > 1.0, "robot {robot}: {positions}");
        // σx is 1e-6 mm against some 0.05 mm: its share of the variance is 1e-9.
        assert!((joints - 1.0).abs() < 1e-6, "robot {robot}: {joints}");
    }
}

#[test]
fn a_gain_is_100_percent_for_the_true_robot_and_0_for_the_unchanged() {
    let (truth, samples) = case(76, 0, 5);
    let nominal = paper_robot::<f64>();
    let joints: Vec<_> = samples.iter().map(|sample| sample.joints).collect();
    let found = Evaluation {
        truth: &truth,
        before: &nominal,
        after: &truth,
    };
    assert_eq!(found.gain(), 100.0);
    assert!(
        found
            .parameter_gains()
            .iter()
            .flatten()
            .all(|gain| *gain == 100.0)
    );
    assert_eq!(found.position_error_after(&joints).rms, 0.0);
    let squares: f64 = samples
        .iter()
        .map(|s| (nominal.forward(&s.joints).unwrap() - s.position).norm_squared())
        .sum();
    let before = found.position_error_before(&joints);
    assert!((before.rms - (squares / 5.0).sqrt()).abs() < 1e-9);
    assert!(before.max >= before.rms && before.unreachable == 0);
    let unchanged = Evaluation {
        after: &nominal,
        ..found
    };
    assert_eq!(unchanged.gain(), 0.0);

    // θ of 120° and of −240° is the same; an angle counts by the true upper arm's length.
    let mut arms = *nominal.arms();
    let mut p = arms[1].parameters().data.0[0];
    p[3] -= std::f64::consts::TAU - 0.01;
    arms[1] = delta_cal::Arm::new(p).unwrap();
    let turned = Robot::new(arms).unwrap();
    let difference = differences(&turned, &nominal);
    assert!((difference[11] - 2.6).abs() < 1e-9);
    assert!((difference.norm() - 2.6).abs() < 1e-9);
}

#[test]
fn refusals_are_those_of_the_ikm_method() {
    let nominal = paper_robot::<f64>();
    let (_, samples) = case(77, 0, 20);
    let plain = Settings::default();
    assert!(matches!(
        fkm::calibrate(&nominal, &samples[..7], &plain),
        Err(Refusal::TooFewSamples {
            samples: 7,
            needed: 8,
            ..
        })
    ));
    // Twenty times the same pose.
    assert!(matches!(
        fkm::calibrate(&nominal, &[samples[0]; 20], &plain),
        Err(Refusal::Undetermined { .. })
    ));
    let noise = Settings {
        noise: Some(Noise::new(0.001, 0.0).unwrap()),
        ..plain
    };
    let mut outlier = samples.clone();
    outlier[3].position.x += 1.0;
    assert!(matches!(
        fkm::calibrate(&nominal, &outlier, &noise),
        Err(Refusal::ResidualContradictsNoise { .. })
    ));
    let coarse = Settings {
        noise: Some(Noise::new(50.0, 0.1).unwrap()),
        ..plain
    };
    assert!(matches!(
        fkm::calibrate(&nominal, &samples, &coarse),
        Err(Refusal::Uncertain { .. })
    ));
    let tight = Settings {
        tolerance: Some(Tolerance::new(0.01, 1e-4).unwrap()),
        ..noise
    };
    assert!(matches!(
        fkm::calibrate(&nominal, &samples, &tight),
        Err(Refusal::FarFromNominal { .. })
    ));
    let mirrored: Vec<_> = samples
        .iter()
        .map(|sample| Sample {
            position: Vector3::new(sample.position.x, sample.position.y, -sample.position.z),
            joints: sample.joints.map(|q| -q),
        })
        .collect();
    assert_eq!(
        fkm::calibrate(&nominal, &mirrored, &plain),
        Err(Refusal::WrongSide)
    );
    let mut infinite = samples;
    infinite[5].position.y = f64::NAN;
    assert!(matches!(
        fkm::calibrate(&nominal, &infinite, &plain),
        Err(Refusal::NonFinite { .. })
    ));
}

/// With a tolerance a single sample will do, with a stated noise or without.
#[test]
fn one_sample_and_a_tolerance_leave_the_robot_near_nominal() {
    let (_, samples) = case(78, 0, 1);
    for noise in [None, Some(Noise::new(0.01, 0.0).unwrap())] {
        let settings = Settings {
            noise,
            tolerance: Some(Tolerance::new(10.0, 0.02).unwrap()),
            ..Settings::default()
        };
        let outcome = fkm::calibrate(&paper_robot(), &samples, &settings).unwrap();
        let error =
            (outcome.robot.robot.forward(&samples[0].joints).unwrap() - samples[0].position).norm();
        assert!(error < 0.1, "{error}");
        for arm in outcome.robot.arms {
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
