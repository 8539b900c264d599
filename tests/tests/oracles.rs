//! The calibration of each arm against an independent optimum: SciPy's.

use delta_cal::calibration::{ArmOutcome, Solver};
use delta_cal::{ArmIndex, IkmCalibrator, RobotOutcome, Sample, Settings};
use delta_cal_tests::goldens::{GoldenInput, number, numbers};
use delta_cal_tests::paper_robot;
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
    let mut calibrator = IkmCalibrator::new(&paper_robot(), settings);
    calibrator.add_many(samples).unwrap();
    calibrator.calibrate().unwrap()
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
