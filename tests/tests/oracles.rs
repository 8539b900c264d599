//! Calibrations from positions against an independent optimum: SciPy's.

use delta_cal::calibration::{Ikm, Joint};
use delta_cal_tests::goldens::{Bits, GoldenInput, numbers, robot};
use delta_cal_tests::{calibrated, paper_robot};
use nalgebra::SMatrix;
use serde::Deserialize;

#[derive(Deserialize)]
struct Goldens<O> {
    cases: Vec<Golden<O>>,
}

/// `O`: of the robot, or of each arm.
#[derive(Deserialize)]
struct Golden<O> {
    #[serde(flatten)]
    input: GoldenInput,
    #[serde(default)]
    nominal: Vec<Bits>,
    parameters: O,
    covariance: O,
    cost: Costs,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Costs {
    OfRobot(Bits),
    OfArms([Bits; 3]),
}

/// Checks that parameters are SciPy's but for so many σ, and the covariance but for a thousandth: central differences
/// know the Jacobian to 1e-8 or so, and the covariance multiplies that by the condition.
fn compare<const N: usize>(
    found: (&[f64], &SMatrix<f64, N, N>),
    expected: (&[Bits], &[Bits]),
    variance: f64,
    sigmas: f64,
) {
    let covariance = numbers(expected.1);
    let sigma: Vec<f64> = (0..N)
        .map(|k| (covariance[k * (N + 1)] * variance).sqrt())
        .collect();
    for row in 0..N {
        let off = (found.0[row] - expected.0[row].0) / sigma[row];
        assert!(off.abs() < sigmas, "parameter {row}: {off:e} σ from SciPy");
        for column in 0..N {
            let expected = covariance[row * N + column] * variance;
            let off = (found.1[(row, column)] - expected) / (sigma[row] * sigma[column]);
            assert!(off.abs() < 1e-3, "covariance off by {off:e}");
        }
    }
}

#[test]
fn both_solvers_reach_scipys_optimum_of_each_arm() {
    let text = include_str!("../goldens/scipy.json");
    let goldens: Goldens<[Vec<Bits>; 3]> = serde_json::from_str(text).unwrap();
    assert_eq!(goldens.cases.len(), 20);
    for golden in &goldens.cases {
        let Costs::OfArms(costs) = &golden.cost else {
            panic!("a cost an arm")
        };
        let samples = golden.input.samples();
        for damped in [true, false] {
            let settings = golden.input.settings().with_damping(damped);
            let outcome = calibrated::<_, Ikm>(&paper_robot(), &samples, &settings).unwrap();
            for (index, result) in outcome.arms.iter().enumerate() {
                // Without weights SciPy's residuals are in mm and its covariance unscaled: times cost/ν, and ν/(ν − 2)
                // for Student's t.
                let freedom = samples.len() as f64 - 10.0;
                let estimated = |_| costs[index].0 / freedom;
                let variance = result.estimated_noise.map_or(1.0, estimated);
                // SciPy's own end points, from finite differences, scatter by some 1e-6 σ.
                compare::<8>(
                    (&result.arm.parameters(), &result.covariance.unwrap()),
                    (&golden.parameters[index], &golden.covariance[index]),
                    variance,
                    1e-4,
                );
            }
        }
    }
}

#[test]
fn scipys_optimum_of_all_arms_is_reached() {
    let text = include_str!("../goldens/scipy_joint.json");
    let goldens: Goldens<Vec<Bits>> = serde_json::from_str(text).unwrap();
    assert_eq!(goldens.cases.len(), 20);
    for golden in &goldens.cases {
        let Costs::OfRobot(cost) = &golden.cost else {
            panic!("a cost a robot")
        };
        let cost = cost.0;
        let nominal = robot(&golden.nominal);
        let samples = golden.input.samples();
        let settings = golden.input.settings();
        let outcome = calibrated::<_, Joint>(&nominal, &samples, &settings).unwrap();
        let residuals = 3.0 * samples.len() as f64;
        // Where no noise is stated it is estimated, and the parameters are Student's: ν/(ν − 2).
        let variance = match settings.noise {
            Some(_) => 1.0,
            None => cost / (residuals - 24.0 - 2.0),
        };
        // The rounding of residuals that are differences of numbers 1e7 times as large, and the last Gauss–Newton step of
        // the generator, from central differences.
        compare::<24>(
            (
                &outcome.robot.parameters().concat(),
                &outcome.estimate.covariance.unwrap(),
            ),
            (&golden.parameters, &golden.covariance),
            variance,
            1e-5,
        );
        if settings.tolerance.is_none() {
            // The cost is flat at its minimum: what is left is the rounding of the residuals.
            let sum = outcome.estimate.residual_rms.powi(2) * residuals;
            assert!((sum / cost - 1.0).abs() < 1e-8, "{sum} {cost}");
        }
    }
}
