//! Against optima that SciPy found, stored with their generator.

use crate::joint::joint;
use delta_cal::Robot;
use delta_cal_tests::goldens::{GoldenInput, number, numbers};
use serde::Deserialize;

#[derive(Deserialize)]
struct Goldens {
    cases: Vec<Golden>,
}

#[derive(Deserialize)]
struct Golden {
    #[serde(flatten)]
    input: GoldenInput,
    nominal: Vec<String>,
    parameters: Vec<String>,
    covariance: Vec<String>,
    cost: String,
}

/// In σ: the rounding of residuals that are differences of numbers 1e7 times as large, and the last
/// Gauss–Newton step of the generator, from central differences.
const PARAMETERS: f64 = 1e-5;
/// Central differences know the Jacobian to 1e-8 or so, and the covariance multiplies that by the
/// condition.
const COVARIANCE: f64 = 1e-3;

#[test]
fn scipys_optimum_is_reached_with_its_covariance() {
    let goldens: Goldens =
        serde_json::from_str(include_str!("../../goldens/scipy_joint.json")).unwrap();
    assert_eq!(goldens.cases.len(), 20);
    let mut worst = [0f64; 3];
    for golden in &goldens.cases {
        let nominal = numbers(&golden.nominal);
        let arms = nominal.as_chunks::<8>().0;
        let nominal = Robot::from_parameters([arms[0], arms[1], arms[2]]).unwrap();
        let samples = golden.input.samples();
        let settings = golden.input.settings();
        let outcome = joint(&nominal, &samples, &settings).unwrap();

        let residuals = 3.0 * samples.len() as f64;
        let cost = number(&golden.cost);
        // Where no noise is stated it is estimated, and the parameters are Student's: ν/(ν − 2).
        let variance = if settings.noise.is_some() {
            1.0
        } else {
            cost / (residuals - 24.0 - 2.0)
        };
        let covariance = numbers(&golden.covariance);
        let sigma: Vec<f64> = (0..24)
            .map(|k| (covariance[k * 25] * variance).sqrt())
            .collect();
        let found = outcome.estimate.covariance.unwrap();
        let parameters = outcome.robot.parameters().concat();
        for row in 0..24 {
            let off = (parameters[row] - number(&golden.parameters[row])) / sigma[row];
            worst[0] = worst[0].max(off.abs());
            for column in 0..24 {
                let expected = covariance[row * 24 + column] * variance;
                let off = (found[(row, column)] - expected) / (sigma[row] * sigma[column]);
                worst[1] = worst[1].max(off.abs());
            }
        }
        if settings.tolerance.is_none() {
            let sum = outcome.estimate.residual_rms.powi(2) * residuals;
            worst[2] = worst[2].max((sum / cost - 1.0).abs());
        }
    }
    let [parameters, covariance, cost] = worst;
    println!(
        "worst deviation from SciPy: parameters {parameters:.1e} σ, covariance {covariance:.1e}, \
         cost {cost:.1e}"
    );
    assert!(parameters < PARAMETERS, "{parameters:e}");
    assert!(covariance < COVARIANCE, "{covariance:e}");
    // The cost is flat at its minimum: what is left is the rounding of the residuals.
    assert!(cost < 1e-8, "{cost:e}");
}
