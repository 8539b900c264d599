//! Starts and linearisations: how many there are, and of which kind.

use crate::outcomes::{SIGMA, calibrate, case};
use delta_cal::calibration::{ArmSolver, Solver, Start, StartUsed};
use delta_cal::{ArmIndex, Calibrator, Noise, Progress, Refusal, Settings};
use delta_cal_tests::{generator, largest_difference, measurements, paper_robot};

/// An easy calibration is one start and few linearisations; the count is that of all starts.
#[test]
fn a_good_fit_is_not_started_again() {
    for (seed, count) in [(31, 20), (32, 40), (33, 100)] {
        for settings in [
            Settings::default(),
            Settings::default().with_noise(Noise::new(SIGMA, 0.0).unwrap()),
        ] {
            let (_, samples) = case(seed, count);
            let outcome = calibrate(&samples, &settings).unwrap();
            for arm in &outcome.arms {
                assert_eq!(arm.start, StartUsed::Nominal);
                assert!((2..6).contains(&arm.iterations), "{}", arm.iterations);
            }
            let mut calibrator = Calibrator::new(&paper_robot(), &settings);
            calibrator.add_many(&samples).unwrap();
            let factor = &calibrator.arms()[0];
            let mut solver = ArmSolver::new(factor, ArmIndex::First, &settings).unwrap();
            assert_eq!(solver.iterations(), 1);
            let mut steps = 1;
            while solver.step(factor) == Progress::Working {
                steps += 1;
            }
            // A step for each linearisation, and two: the end of the iteration, and the covariance.
            assert_eq!(solver.iterations(), outcome.arms[0].iterations);
            assert_eq!(steps, solver.iterations() + 2);
        }
    }
}

#[test]
fn no_start_takes_more_linearisations_than_allowed() {
    let (_, samples) = case(34, 20);
    let settings = Settings::default()
        .with_iteration_limit(2)
        .with_start(Start::Free);
    let refused = calibrate(&samples, &settings);
    let Err(Refusal::NotConverged { iterations, .. }) = refused else {
        panic!("{refused:?}");
    };
    // The linear fit, and six arms that the spread of the samples decides.
    assert_eq!(iterations, 7 * 2);
}

#[test]
fn gauss_newton_takes_full_steps_only() {
    let (truth, _) = case(54, 1);
    let samples = measurements(&truth, 20, None, &mut generator(645, 0));
    let settings = Settings::default().with_solver(Solver::GaussNewton);
    let outcome = calibrate(&samples, &settings).unwrap();
    assert!(largest_difference(&outcome.robot, &truth) < 1e-8);
}
