#![allow(clippy::unwrap_used)]

use super::{Work, damping_rows};
use crate::calibration::arm_problem::Normal;
use crate::calibration::point::Weighted;
use crate::calibration::step_control::{StepControl, StepResult};
use crate::calibration::{Problem, Solver};
use crate::robot::Arm;
use crate::samples::joint_factor_tests::{changed, empty, noises, samples};
use crate::samples::{ArmFactor, Displacement, JointDisplacement, NominalArm};
use nalgebra::{SMatrix, SVector, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

type Iteration = super::Iteration<f64, Displacement<f64>, 8, 9, 45>;

/// A problem, for what it says of its size alone.
fn problem() -> ArmFactor<f64> {
    let arm = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0]).unwrap();
    ArmFactor::new(NominalArm::new(&arm, &Vector3::new(0.0, 0.0, -450.0), None))
}

/// The step that the iteration would try, damped as its control says, if it is not too long.
fn trial_step(iteration: &Iteration, problem: &ArmFactor<f64>) -> Option<[f64; 8]> {
    let mut damped = iteration.point.normal;
    let damping = iteration.control.damping();
    if damping > 0.0 {
        let rows = damping_rows(&iteration.point.normal, damping);
        assert!(!problem.damp(&mut damped, &rows, 0));
    }
    damped
        .minimiser(&[0.0; 9])
        .filter(|step| iteration.usable(step))
}

/// An iteration at a random linearised problem J δ + r of twenty rows.
fn iteration(seed: u64) -> (Iteration, SMatrix<f64, 20, 8>, SVector<f64, 20>) {
    let mut rng = Pcg32::seed_from_u64(seed);
    let mut uniform = || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    let mut jacobian = SMatrix::<f64, 20, 8>::zeros();
    for (column, length) in [1.0, 3.0, 0.1, 2.0, 0.5, 7.0, 1.5, 0.2]
        .into_iter()
        .enumerate()
    {
        for entry in &mut jacobian.column_mut(column) {
            *entry = uniform() * length;
        }
    }
    let residual = SVector::<f64, 20>::from([(); 20].map(|()| 0.01 * uniform()));
    let mut iteration = Iteration::unstarted(Solver::LevenbergMarquardt);
    for (row, right) in jacobian.row_iter().zip(&residual) {
        let mut block = [[0.0]; 9];
        for (column, value) in block.iter_mut().zip(row.iter().chain([right])) {
            *column = [*value];
        }
        iteration.point.normal.absorb(&mut block);
    }
    (iteration, jacobian, residual)
}

/// (JᵀJ + λ D²) δ = −Jᵀ r, D the lengths of the columns (Marquardt 1963).
#[test]
fn a_damped_step_is_marquardts() {
    for seed in 0..20 {
        let (mut iteration, jacobian, residual) = iteration(seed);
        let information = jacobian.transpose() * jacobian;
        let right = -(jacobian.transpose() * residual);
        let mut control = StepControl::new(Solver::LevenbergMarquardt);
        for _ in 0..5 {
            let mut damped = information;
            for k in 0..8 {
                damped[(k, k)] *= 1.0 + control.damping();
            }
            let expected = damped.try_inverse().unwrap() * right;
            iteration.control = control;
            let found = SVector::from(trial_step(&iteration, &problem()).unwrap());
            assert!((found - expected).norm() < 1e-9 * expected.norm());
            let prospect = control.judge(0.5, 1.0, 1.0);
            assert_eq!(control.rejected(&prospect), StepResult::Continue);
        }
    }
}

#[test]
fn a_step_that_is_too_long_is_taken_by_gauss_newton_alone() {
    let mut diagonal = [1.0; 8];
    diagonal[5] = 0.01;
    let mut iteration = Iteration::unstarted(Solver::LevenbergMarquardt);
    for (right, short) in [(0.002_49, true), (0.002_51, false), (-0.003, false)] {
        let mut rights = [0.0; 8];
        rights[5] = right;
        iteration.point.normal = Normal::from_diagonal(&diagonal, &rights);
        iteration.control = StepControl::new(Solver::LevenbergMarquardt);
        // A quarter of the unit at most.
        assert_eq!(trial_step(&iteration, &problem()).is_some(), short);
        iteration.control = StepControl::new(Solver::GaussNewton);
        let step = trial_step(&iteration, &problem()).unwrap();
        assert!((step[5] + right / 0.01).abs() < 1e-12);
    }
}

/// |J δ|².
#[test]
fn the_length_of_a_displacement_is_what_it_adds_to_the_residuals() {
    for seed in 0..20 {
        let (iteration, jacobian, _) = iteration(seed);
        let mut displacement = [0.0; 8];
        let mut angle = 1.0;
        for value in &mut displacement {
            angle += 1.7;
            *value = libm::sin(angle);
        }
        let expected = (jacobian * SVector::from(displacement)).norm_squared();
        assert!((iteration.point.length_squared(&displacement) / expected - 1.0).abs() < 1e-12);
    }
}

/// A rejected step counts as a linearisation does: the limit holds for both.
#[test]
fn rejected_steps_are_counted() {
    let (mut iteration, _, _) = iteration(0);
    let prospect = iteration.control.judge(0.5, 1.0, 1.0);
    for count in 1..4 {
        assert_eq!(iteration.reject(&prospect), StepResult::Continue);
        assert_eq!(iteration.iterations, count);
    }
    iteration.control = StepControl::new(Solver::GaussNewton);
    let prospect = iteration.control.judge(0.5, 1.0, 1.0);
    assert_eq!(iteration.reject(&prospect), StepResult::Failed);
    assert_eq!(iteration.iterations, 3);
}

/// Where the problem is linearised a chord step is the full step; one that is too long is not tried.
#[test]
fn a_chord_step_is_the_full_step_there() {
    type Joint = super::Iteration<f64, JointDisplacement<f64>, 24, 25, 325>;
    let mut factor = empty(noises()[2]);
    for sample in &samples::<30>(&changed(11), 12) {
        factor.add(sample).unwrap();
    }
    let weighted = Weighted {
        prior: &[500.0; 24],
        sigma: 1.0,
    };
    for azimuth in [0.0, 0.01, 0.8] {
        let mut from = [0.0; 24];
        from[3] = azimuth;
        let mut iteration = Joint::unstarted(Solver::LevenbergMarquardt);
        iteration.restart(&factor, &weighted, &from);
        while iteration.is_linearizing() {
            iteration.step(&factor, &weighted);
        }
        let step: [f64; 24] = iteration.point.normal.minimiser(&[0.0; 25]).unwrap();
        let longest = step.into_iter().map(f64::abs).fold(0.0, f64::max);
        let at = Problem::displaced(&factor, &from);
        assert!(iteration.refine(&factor, &weighted, at).is_none());
        let tried = match &iteration.work {
            Work::Trying { trial, .. } => Some(trial.correction),
            _ => None,
        };
        assert_eq!(tried.is_some(), longest <= 0.25, "{longest}");
        assert_eq!(iteration.is_linearizing(), longest > 0.25);
        assert_eq!(longest <= 0.25, azimuth < 0.1);
        for ((tried, before), step) in tried.iter().flatten().zip(from).zip(step) {
            // Two ways to the same step, whose condition is some thousands.
            assert!((tried - before - step).abs() < 1e-9 * longest);
        }
    }
}
