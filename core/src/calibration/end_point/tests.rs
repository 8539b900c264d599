#![allow(clippy::unwrap_used)]

use super::EndPoint;
use crate::calibration::outcome::{StartUsed, Termination};
use crate::calibration::point::Point;
use crate::robot::Arm;
use crate::samples::{ArmFactor, Noise, NominalArm, Triangle};
use nalgebra::Vector3;

/// An end at a distance from nominal, where a step of 1 raises the cost by 10,000.
fn end(distance: f64, cost: f64) -> Point<f64, 8, 9, 45> {
    let mut correction = [0.0; 8];
    correction[2] = distance;
    Point {
        correction,
        normal: Triangle::from_diagonal(&[100.0; 8], &[0.0; 8]),
        sum_of_squares: cost,
        cost,
    }
}

/// With a stated noise and without a tolerance costs within 4 are a tie, otherwise within a thousandth: of a tie the
/// nearer end is taken, of no tie the one that costs less. What was balanced otherwise is taken in any case.
#[test]
fn the_better_of_two_ends_is_taken_and_of_a_tie_the_nearer() {
    let arm = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0]).unwrap();
    let problem = |noise| {
        let centre = Vector3::new(0.0, 0.0, -450.0);
        ArmFactor::new(NominalArm::new(&arm, &centre, noise))
    };
    let (stated, unknown) = (problem(Noise::new(0.02, 0.0).ok()), problem(None));
    let best = EndPoint {
        point: end(2.0, 10.0),
        termination: Termination::GradientVanished,
        start: StartUsed::Nominal,
        residual_sigma: 1.0,
    };
    let (nearer, farther) = (1.0, 3.0);
    for (distance, cost, of_noise, otherwise) in [
        (nearer, 12.0, true, false),
        (nearer, 15.0, false, false),
        (farther, 7.0, false, true),
        (farther, 5.0, true, true),
        (nearer, 10.005, true, true),
        (farther, 9.995, false, false),
        (farther, 9.9, false, true),
        // The same place: nothing but the cost counts.
        (1.999, 10.005, false, false),
        (2.001, 9.995, true, true),
    ] {
        let end = end(distance, cost);
        let improved = |problem, sigma, has_tolerance| {
            best.is_improved_by(&end, sigma, has_tolerance, problem)
        };
        assert_eq!(improved(&stated, 1.0, false), of_noise, "{distance} {cost}");
        assert_eq!(improved(&stated, 1.0, true), otherwise, "{distance} {cost}");
        assert_eq!(
            improved(&unknown, 1.0, false),
            otherwise,
            "{distance} {cost}"
        );
        assert_eq!(
            improved(&unknown, 1.0, true),
            otherwise,
            "{distance} {cost}"
        );
        assert!(improved(&unknown, 0.9, true));
    }
}
