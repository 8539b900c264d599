//! The calibration of each arm against independent optima: SciPy's, with their generator,
//! and the `levenberg-marquardt` crate's.

use delta_cal::calibration::{ArmOutcome, Solver};
use delta_cal::{
    ArmIndex, Calibrator, Noise, Parameter, RobotOutcome, Sample, Settings, Tolerance,
};
use delta_cal_tests::goldens::{GoldenInput, number, numbers};
use delta_cal_tests::peer::{Parameters, PeerProblem, Row};
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed};
use serde::Deserialize;

#[derive(Deserialize)]
struct Goldens {
    cases: Vec<Golden>,
}

#[derive(Deserialize)]
struct Golden {
    #[serde(flatten)]
    input: GoldenInput,
    parameters: [Vec<String>; 3],
    covariance: [Vec<String>; 3],
    cost: [String; 3],
}

fn factor_outcome(samples: &[Sample<f64>], settings: &Settings<f64>) -> RobotOutcome<f64> {
    let mut calibrator = Calibrator::new(&paper_robot(), settings);
    calibrator.add_many(samples).unwrap();
    calibrator.solve().unwrap()
}

fn largest_deviation(a: &ArmOutcome<f64>, expected: &[f64], sigma: &[f64]) -> f64 {
    a.arm
        .parameters()
        .iter()
        .zip(expected)
        .zip(sigma)
        .map(|((value, expected), sigma)| ((value - expected) / sigma).abs())
        .fold(0.0, f64::max)
}

#[test]
fn both_solvers_reach_scipys_optimum() {
    let goldens: Goldens = serde_json::from_str(include_str!("../goldens/scipy.json")).unwrap();
    assert_eq!(goldens.cases.len(), 20);
    for (index, golden) in goldens.cases.iter().enumerate() {
        let samples = golden.input.samples();
        for method in [Solver::LevenbergMarquardt, Solver::GaussNewton] {
            let settings = golden.input.settings().with_solver(method);
            let outcome = factor_outcome(&samples, &settings);
            for arm in ArmIndex::ALL {
                let result = &outcome.arms[arm.index()];
                let expected = numbers(&golden.parameters[arm.index()]);
                let covariance = numbers(&golden.covariance[arm.index()]);
                let cost = number(&golden.cost[arm.index()]);
                // Without weights SciPy's residuals are in mm and its covariance unscaled: times
                // cost/ν, and ν/(ν − 2) for Student's t.
                let variance = result
                    .estimated_noise
                    .map_or(1.0, |_| cost / (samples.len() as f64 - 10.0));
                let sigma: Vec<f64> = (0..8)
                    .map(|k| (covariance[k * 9] * variance).sqrt())
                    .collect();
                // SciPy's own end points, from finite differences, scatter by some 1e-6 σ.
                let deviation = largest_deviation(result, &expected, &sigma);
                assert!(
                    deviation < 1e-4,
                    "case {index} {arm}: {deviation:e} σ from SciPy"
                );
                let found = result.covariance.unwrap();
                for row in 0..8 {
                    for column in 0..8 {
                        let scale = sigma[row] * sigma[column];
                        let expected = covariance[row * 8 + column] * variance;
                        let error = ((found[(row, column)] - expected) / scale).abs();
                        // Central differences know the Jacobian to 1e-8 or so, and the
                        // covariance multiplies that by the condition.
                        assert!(
                            error < 1e-3,
                            "case {index} {arm}: covariance off by {error:e}"
                        );
                    }
                }
            }
        }
    }
}

fn peer_parameters(
    samples: &[Sample<f64>],
    arm: ArmIndex,
    noise: Option<&Noise<f64>>,
    tolerance: Option<(f64, f64)>,
) -> Option<Parameters> {
    let nominal = paper_robot::<f64>();
    let arm_nominal = nominal.arm(arm);
    let start = Parameters::from(arm_nominal.parameters());
    let rows = samples
        .iter()
        .map(|sample| {
            let q = sample.joints[arm.index()];
            let weight = noise.map_or(1.0, |noise| {
                let by_position = 2.0 * arm_nominal.lb() * noise.position();
                let by_joint = arm_nominal.constraint_by_joint(&sample.position, q) * noise.joint();
                by_position.hypot(by_joint).recip()
            });
            Row {
                x: nalgebra_of_peer::Vector3::from(sample.position.data.0[0]),
                sine: q.sin(),
                cosine: q.cos(),
                weight,
            }
        })
        .collect();
    let prior = tolerance.map_or_else(Parameters::zeros, |(length, angle)| {
        let (l, a) = (1.0 / length, 1.0 / angle);
        Parameters::from([l, l, l, a, a, l, l, l])
    });
    PeerProblem {
        rows,
        prior,
        nominal: start,
        parameters: start,
    }
    .solve()
}

#[test]
fn a_hundred_noisy_robots_agree_with_the_levenberg_marquardt_crate() {
    let degree = 1f64.to_radians();
    let noise = Noise::new(0.01, 0.002 * degree).unwrap();
    let mut compared = 0;
    for robot in 0..100 {
        let count = [12, 20, 60, 200][robot as usize % 4];
        let (weights, prior) = [(false, false), (true, false), (true, true)][robot as usize % 3];
        let mut rng = generator(11, robot);
        let truth = perturbed(&paper_robot(), 1.0, 0.3 * degree, Spread::Uniform, &mut rng);
        let samples = measurements(&truth, count, Some(&noise), &mut rng);
        let tolerance = prior.then_some((1.0, 0.3 * degree));
        let settings = Settings::default()
            .with_noise(weights.then_some(noise))
            .with_tolerance(tolerance.map(|(l, a)| Tolerance::new(l, a).unwrap()));
        let factor = factor_outcome(&samples, &settings);
        for arm in ArmIndex::ALL {
            let factor = &factor.arms[arm.index()];
            let sigma = Parameter::ROTARY.map(|p| factor.standard_deviation(p).unwrap());
            let peer = peer_parameters(&samples, arm, weights.then_some(&noise), tolerance)
                .expect("the peer converges");
            let deviation = largest_deviation(factor, &peer.data.0[0], &sigma);
            // MINPACK's default tolerance of 1e-8·|P| leaves that much of a parameter open.
            assert!(
                deviation < 1e-3,
                "robot {robot} {arm}: {deviation:e} σ from the peer"
            );
            compared += 1;
        }
    }
    assert_eq!(compared, 300);
}
