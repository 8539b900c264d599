#![allow(clippy::float_cmp)] // of figures that are copied

use super::Starts;
use crate::calibration::curve::Curve;
use crate::calibration::end_point::EndPoint;
use crate::calibration::identifiability::Identifiability;
use crate::calibration::outcome::{StartUsed, Termination};
use crate::calibration::point::Point;
use crate::calibration::settings::Start;
use crate::samples::Triangle;

/// An end at p = 0, which is known to 1.
fn end(sum_of_squares: f64) -> Point<f64, 1, 2, 3> {
    Point {
        correction: [0.0],
        normal: Triangle::from_diagonal(&[1.0], &[0.0]),
        sum_of_squares,
        cost: sum_of_squares,
    }
}

/// Whether a start without a guess is tried after the one from nominal has ended.
fn another_is_tried(problem: &Curve, sum_of_squares: f64) -> bool {
    let best = EndPoint {
        point: end(sum_of_squares),
        termination: Termination::GradientVanished,
        start: StartUsed::Nominal,
        residual_sigma: 1.0,
    };
    let mut starts = Starts::<f64, 1>::new(Start::Nominal);
    let found = starts.better_free(problem, StartUsed::Nominal, Some(&best));
    assert!(found.is_none() || found == Some([7.0]));
    found.is_some()
}

/// n samples with three residuals each leave 3 (n − 12) of them spare of the fit of the twelve coefficients, and a sum
/// of squares of 48; the end's may be larger by 50 variances of a residual. With twelve samples nothing is spare, and
/// the variance is taken for that sum.
#[test]
fn an_end_that_is_worse_than_the_coefficients_by_fifty_variances_is_not_the_last() {
    for (samples, noise_stated, variance) in [
        (20, false, 2.0),
        (28, false, 1.0),
        (12, false, 48.0),
        (20, true, 1.0),
        (12, true, 1.0),
    ] {
        let problem = Curve {
            free_start: Some(7.0),
            least_sum_of_squares: 48.0,
            samples,
            noise_stated,
            ..Curve::straight()
        };
        let limit = 48.0 + 50.0 * variance;
        assert!(!another_is_tried(&problem, 0.999 * limit), "{problem:?}");
        assert!(another_is_tried(&problem, 1.001 * limit), "{problem:?}");
    }
}

/// Of exact samples the coefficients leave nothing, an end what rounding leaves: (32 ε)² times the rows' squares.
#[test]
fn what_rounding_leaves_is_no_reason_to_start_again() {
    let rounding = f64::powi(32.0 * f64::EPSILON, 2) * 1e6;
    let problem = Curve {
        free_start: Some(7.0),
        rows_squared: 1e6,
        ..Curve::straight()
    };
    assert!(!another_is_tried(&problem, 0.9 * rounding));
    assert!(another_is_tried(&problem, 1.1 * rounding));
}

/// Starts of a search about p = 0, where eleven samples may have several solutions.
fn searching(first: Start, problem: &Curve) -> Starts<f64, 1> {
    let mut starts = Starts::new(first);
    if first == Start::Free {
        assert_eq!(starts.next_free(problem), problem.free_start.map(|p| [p]));
    }
    let there = Identifiability::of(&end(1e-6).normal);
    starts.search(problem, &end(1e-6), &there);
    starts
}

fn few() -> Curve {
    Curve {
        free_start: Some(7.0),
        samples: 11,
        ..Curve::straight()
    }
}

/// How far the next starts of the search are from p = 0, in hundredths, the first side positive; and what comes behind
/// the last.
fn searched(starts: &mut Starts<f64, 1>, problem: &Curve) -> ([i32; 8], Option<[f64; 1]>) {
    let mut steps = [0; 8];
    let mut side = 1.0;
    for index in 0..9 {
        match starts.next_searched(problem) {
            Some((StartUsed::Search, [p])) => {
                if index == 0 {
                    side = p.signum();
                }
                #[allow(clippy::cast_possible_truncation)]
                {
                    steps[index] = libm::round(100.0 * side * p) as i32;
                }
            }
            Some((StartUsed::Free, start)) => return (steps, Some(start)),
            other => {
                assert_eq!(other, None);
                break;
            }
        }
    }
    (steps, None)
}

/// Behind the last start of a search comes the one without a guess, once, unless the first of all was one.
#[test]
fn behind_a_search_comes_the_start_without_a_guess_if_none_was() {
    let mut starts = searching(Start::Nominal, &few());
    let all = [12, -12, 6, -6, 3, -3, 1, -1];
    assert_eq!(searched(&mut starts, &few()), (all, Some([7.0])));
    assert_eq!(starts.next_searched(&few()), None);
    let mut starts = searching(Start::Free, &few());
    assert_eq!(searched(&mut starts, &few()), (all, None));
    assert_eq!(starts.next_searched(&few()), None);
}

/// Where one of the search's own starts comes back to p = 0, those between are left out. Another start that ends there
/// says nothing of them.
#[test]
fn only_a_start_of_the_search_can_come_back() {
    for (start, rest) in [
        (StartUsed::Search, [12, 6, 3, 1, 0, 0, 0, 0]),
        (StartUsed::Free, [12, -6, 6, -3, 3, -1, 1, 0]),
        (StartUsed::Nominal, [12, -6, 6, -3, 3, -1, 1, 0]),
    ] {
        let mut starts = searching(Start::Free, &few());
        assert!(starts.next_searched(&few()).is_some());
        starts.converged(start, &end(1e-6), &few());
        assert_eq!(searched(&mut starts, &few()).0, rest, "{start:?}");
    }
}

/// Where there is no such robot nothing starts.
#[test]
fn starts_without_a_robot_are_passed_over() {
    let problem = Curve {
        residuals: |p| [(if p < 0.0 { f64::INFINITY } else { p }, 1.0), (0.0, 0.0)],
        ..few()
    };
    let mut starts = searching(Start::Free, &problem);
    assert_eq!(searched(&mut starts, &problem).0, [12, 6, 3, 1, 0, 0, 0, 0]);
}

/// Twelve samples determine the twelve coefficients, and those one arm: there is nothing to search for.
#[test]
fn twelve_samples_need_no_search() {
    let problem = Curve {
        samples: 12,
        ..few()
    };
    let mut starts = searching(Start::Nominal, &problem);
    assert_eq!(starts.next_searched(&problem), None);
}
