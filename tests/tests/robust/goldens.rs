//! Against optima that NumPy found, stored with their generator.

use delta_cal::robust::{Loss, WeighedSample, robust_fit};
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
    loss: String,
    parameters: Vec<String>,
    weights: Vec<String>,
    rejected: Vec<bool>,
    covariance: Vec<String>,
}

/// Rounds end when no weight changes by more than √ε = 1.5e-8, NumPy's at 1e-9. Weights that settle in
/// 80 rounds or fewer, from changes of about 1, contract by 0.8 a round or better, so that four times
/// the last change is left. The parameters, in σ, are off by that times the sum of a sample's pull over
/// the sixty, ten at most.
const STANDS_STILL: f64 = 1e-6;
/// Central differences know the Jacobian to 1e-8 or so, and the covariance multiplies that by the
/// condition.
const COVARIANCE: f64 = 1e-3;

#[test]
fn numpys_fixed_point_is_reached_with_its_weights_and_covariance() {
    let goldens: Goldens =
        serde_json::from_str(include_str!("../../goldens/numpy_robust.json")).unwrap();
    assert_eq!(goldens.cases.len(), 8);
    let mut worst = [0f64; 3];
    for (index, golden) in goldens.cases.iter().enumerate() {
        let samples = golden.input.samples();
        let loss = match golden.loss.as_str() {
            "tukey" => Loss::Tukey,
            "huber" => Loss::Huber,
            other => panic!("{other}"),
        };
        let settings = golden.input.settings();
        let mut work = vec![WeighedSample::vacant(); samples.len()];
        let outcome = robust_fit(&paper_robot(), &settings, &samples, loss, &mut work).unwrap();
        assert!(outcome.settled, "case {index}");

        let rejected: Vec<_> = work.iter().map(WeighedSample::suspected).collect();
        assert_eq!(rejected, golden.rejected, "case {index}");
        for (sample, expected) in work.iter().zip(numbers(&golden.weights)) {
            worst[0] = worst[0].max((sample.weight() - expected).abs());
        }
        let covariance = numbers(&golden.covariance);
        let sigma: Vec<f64> = (0..24).map(|k| covariance[k * 25].sqrt()).collect();
        let parameters = outcome.fit.robot.parameters().concat();
        let found = outcome.fit.estimate.covariance.unwrap();
        for row in 0..24 {
            let expected = number(&golden.parameters[row]);
            let off = (parameters[row] - expected) / sigma[row];
            worst[1] = worst[1].max(off.abs());
            for column in 0..24 {
                let expected = covariance[row * 24 + column];
                let off = (found[(row, column)] - expected) / (sigma[row] * sigma[column]);
                worst[2] = worst[2].max(off.abs());
            }
        }
    }
    let [weights, parameters, covariance] = worst;
    println!(
        "worst deviation from NumPy: weights {weights:.1e}, parameters {parameters:.1e} σ, \
         covariance {covariance:.1e}"
    );
    assert!(weights < STANDS_STILL, "{weights:e}");
    assert!(parameters < STANDS_STILL, "{parameters:e}");
    assert!(covariance < COVARIANCE, "{covariance:e}");
}
