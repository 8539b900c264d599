#![allow(clippy::cast_precision_loss)]

use super::Weighted;
use crate::calibration::problem::Prior;

/// Half the derivative of the weighted cost: of a quadratic one a central difference of any step.
#[test]
fn the_gradient_of_the_prior_is_that_of_its_weighted_cost() {
    let prior: [f64; 8] = [3.0, 0.5, 0.0, 2.0, 1.0, 4.0, 0.2, 1.5];
    let weighted = Weighted {
        prior: &prior,
        sigma: 0.4,
    };
    let cost = |correction: &[f64; 8]| {
        let squares = prior.iter().zip(correction);
        squares
            .map(|(weight, delta)| (weight * delta * 0.4).powi(2))
            .sum::<f64>()
    };
    let correction: [f64; 8] = core::array::from_fn(|index| 0.3 * index as f64 - 1.0);
    assert!((weighted.cost::<8, 9, 45>(&correction) - cost(&correction)).abs() < 1e-14);
    let before: [f64; 8] = core::array::from_fn(|index| 0.1 * index as f64 + 0.2);
    let mut gradient = before;
    weighted.add_gradient::<8, 9, 45>(&correction, &mut gradient);
    for parameter in 0..8 {
        let [above, below] = [0.5, -0.5].map(|by| {
            let mut moved = correction;
            moved[parameter] += by;
            cost(&moved)
        });
        let expected = before[parameter] + (above - below) / 2.0;
        assert!((gradient[parameter] - expected).abs() < 1e-14);
    }
    let unheld = Prior::<f64, 8, 9, 45>::unheld(&prior);
    assert_eq!(unheld, 1);
}
