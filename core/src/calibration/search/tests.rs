#![allow(clippy::float_cmp, clippy::unwrap_used)] // of rounded figures

use super::Search;
use crate::calibration::point::Point;
use crate::robot::Arm;
use crate::samples::{ArmFactor, NominalArm, Triangle};
use nalgebra::Vector3;

const ORIGIN: [f64; 8] = [0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.25];

fn search() -> Search<f64, 8> {
    let mut direction = [0.0; 8];
    direction[7] = 1.0;
    Search::new(ORIGIN, direction)
}

/// Where an iteration converged: every parameter known to one, the cost to a part of a thousandth.
fn end(correction: [f64; 8]) -> Point<f64, 8, 9, 45> {
    Point {
        correction,
        normal: Triangle::from_diagonal(&[1.0; 8], &[0.0; 8]),
        sum_of_squares: 1e-6,
        cost: 1e-6,
    }
}

/// How far the starts are from the origin, in hundredths, zeros behind the last, if the iteration from start number
/// `which` ends there.
fn steps(which: Option<usize>, end: &Point<f64, 8, 9, 45>) -> [f64; 9] {
    let arm = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0]).unwrap();
    let problem = ArmFactor::new(NominalArm::new(&arm, &Vector3::new(0.0, 0.0, -450.0), None));
    let (mut search, mut steps) = (search(), [0.0; 9]);
    for (index, step) in steps.iter_mut().enumerate() {
        let Some(start) = search.next() else {
            break;
        };
        assert_eq!(start[..7], ORIGIN[..7]);
        // The distances are single-precision constants.
        *step = libm::round(1e4 * (start[7] - ORIGIN[7])) / 100.0;
        if which == Some(index + 1) {
            search.converged(end, &problem);
        }
    }
    steps
}

#[test]
fn starts_are_on_both_sides_and_the_farthest_first() {
    let all = [-12.0, 12.0, -6.0, 6.0, -3.0, 3.0, -1.0, 1.0, 0.0];
    assert_eq!(steps(None, &end(ORIGIN)), all);
    // A tie is 1e-3 of the cost, and sixteen of them are the same point: beyond √(16 · 1e-9) it is another.
    let mut another = ORIGIN;
    another[2] = 1.3e-4;
    assert_eq!(steps(Some(1), &end(another)), all);
}

#[test]
fn between_the_origin_and_a_start_that_came_back_nothing_is_tried() {
    let mut near = ORIGIN;
    near[2] = 1.2e-4;
    for (start, expected) in [
        (1, [-12.0, 12.0, 6.0, 3.0, 1.0, 0.0]),
        (2, [-12.0, 12.0, -6.0, -3.0, -1.0, 0.0]),
        (4, [-12.0, 12.0, -6.0, 6.0, -3.0, -1.0]),
    ] {
        assert_eq!(steps(Some(start), &end(near))[..6], expected);
    }
}
