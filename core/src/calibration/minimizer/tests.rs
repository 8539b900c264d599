#![allow(clippy::unwrap_used)]

use super::{Minimizer, Progress};
use crate::calibration::curve::Curve;
use crate::calibration::settings::{Settings, Solver};
use crate::calibration::tolerance::Tolerance;
use crate::robot::ArmIndex;

/// Where the iteration of a problem ends, by full steps from p = 0.
fn end(problem: &Curve) -> Option<[f64; 1]> {
    let settings = Settings::new().with_solver(Solver::GaussNewton);
    let mut solver =
        Minimizer::<f64, f64, [f64; 1], 1, 2, 3>::unstarted(ArmIndex::First, [0.0], &settings);
    solver.begin(problem);
    while solver.step(problem) == Progress::Working {}
    solver.end()
}

/// A full step can lead over a hill into another valley. From residuals of (1, 0) at p = 0 it leads to p = 10, and the
/// next to p = 11, the lowest place of a valley. That is an end if the residuals are smaller there than at the start;
/// if they are larger it is none, however well the iteration has settled.
#[test]
fn an_end_that_is_worse_than_the_start_is_none() {
    let lower = Curve {
        residuals: |p| {
            if p < 5.0 {
                [(1.0 - 0.1 * p, -0.1), (0.0, 0.0)]
            } else {
                [(p - 11.0, 1.0), (0.9, 0.0)]
            }
        },
        ..Curve::straight()
    };
    assert_eq!(end(&lower), Some([11.0]));
    let higher = Curve {
        residuals: |p| {
            if p < 5.0 {
                [(1.0 - 0.1 * p, -0.1), (0.0, 0.0)]
            } else {
                [(p - 11.0, 1.0), (1.1, 0.0)]
            }
        },
        ..Curve::straight()
    };
    assert_eq!(end(&higher), None);
}

/// With a tolerance and without a noise the noise is estimated in rounds, each of which solves the problem again. Other
/// solutions are looked for in the first alone: what the residuals of (p, 1) leave is above any noise in all of them.
#[test]
fn other_solutions_are_looked_for_once_and_not_with_every_estimate_of_the_noise() {
    let problem = Curve {
        residuals: |p| [(p, 1.0), (1.0, 0.0)],
        free_start: Some(7.0),
        ..Curve::straight()
    };
    let settings = Settings::new().with_tolerance(Tolerance::new(0.5, 0.003).unwrap());
    let mut solver =
        Minimizer::<f64, f64, [f64; 1], 1, 2, 3>::unstarted(ArmIndex::First, [1.0], &settings);
    solver.begin(&problem);
    while solver.step(&problem) == Progress::Working {}
    // Two residuals of 0 and 1, of 60, one of them for the parameter.
    let sigma = libm::sqrt(1.0 / 59.0);
    assert!((solver.balance.sigma / sigma - 1.0).abs() < 0.01);
    assert_eq!(problem.asked.get(), 1);
}
