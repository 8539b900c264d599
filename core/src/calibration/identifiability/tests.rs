#![allow(clippy::unwrap_used)]

use super::Identifiability;
use crate::calibration::problem::Normal;
use nalgebra::{SMatrix, SVector};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// A Jacobian of twenty rows whose columns differ in length, and its triangle.
fn jacobian(seed: u64) -> (SMatrix<f64, 20, 8>, Normal<f64>) {
    let mut rng = Pcg32::seed_from_u64(seed);
    let mut uniform = || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    let mut matrix = SMatrix::<f64, 20, 8>::zeros();
    for (column, length) in [1.0, 3.0, 0.1, 2.0, 0.5, 7.0, 1.5, 0.2]
        .into_iter()
        .enumerate()
    {
        for entry in &mut matrix.column_mut(column) {
            *entry = uniform() * length;
        }
    }
    let mut normal = Normal::zero();
    for row in matrix.row_iter() {
        let mut block = [[0.0]; 9];
        for (column, value) in block.iter_mut().zip(row.iter()) {
            *column = [*value];
        }
        block[8] = [uniform()];
        normal.absorb(&mut block);
    }
    (matrix, normal)
}

#[test]
fn covariance_and_condition_are_those_of_the_inverse() {
    for seed in 0..100 {
        let (matrix, normal) = jacobian(seed);
        let found = Identifiability::of(&normal);
        let information = matrix.transpose() * matrix;
        let covariance = information.try_inverse().unwrap();
        // Roundings of the normal equations, whose condition is some 1e4.
        assert!((found.covariance - covariance).amax() < 1e-10 * covariance.amax());
        assert_eq!(found.covariance, found.covariance.transpose());

        let mut unit = matrix;
        for mut column in unit.column_iter_mut() {
            column.normalize_mut();
        }
        let scaled = unit.transpose() * unit;
        let inverse = scaled.try_inverse().unwrap();
        // ‖A‖² = tr AᵀA = 8, ‖A⁻¹‖² = tr (AᵀA)⁻¹.
        let condition = (scaled.trace() * inverse.trace()).sqrt() / 8.0;
        assert!((found.condition / condition - 1.0).abs() < 1e-10);
        assert_eq!(found.weakest, inverse.diagonal().imax());
    }
}

#[test]
fn the_weakest_direction_is_that_of_the_least_singular_value() {
    let mut decided = 0;
    for seed in 0..100 {
        let (matrix, normal) = jacobian(seed);
        let information = matrix.transpose() * matrix;
        let eigen = information.symmetric_eigen();
        let least = eigen.eigenvalues.imin();
        let direction = SVector::from(Identifiability::of(&normal).weakest_direction());
        assert!((direction.norm() - 1.0).abs() < 1e-14);
        let mut others = eigen.eigenvalues;
        others[least] = f64::INFINITY;
        // Three steps of inverse iteration leave (λ/λ′)³ of what else there was.
        let left = (eigen.eigenvalues[least] / others.min()).powi(3);
        let along = eigen.eigenvectors.column(least).dot(&direction).abs();
        let across = (1.0 - along * along).max(0.0).sqrt();
        let started = eigen.eigenvectors.column(least)[Identifiability::of(&normal).weakest].abs();
        assert!(across <= left / started + 1e-7, "{across} {left}");
        decided += u32::from(left < 0.05);
    }
    assert!(decided > 30, "{decided}");
}

#[test]
fn a_prior_takes_its_share_of_the_parameters() {
    for seed in 0..20 {
        let (matrix, mut normal) = jacobian(seed);
        let prior = [0.3, 1.0, 0.5, 2.0, 0.0, 4.0, 0.1, 0.7];
        let mut block = [[0.0; 8]; 9];
        for (index, weight) in prior.into_iter().enumerate() {
            block[index][index] = weight;
        }
        normal.absorb(&mut block);
        let found = Identifiability::of(&normal).determined_parameters(&prior);
        // The trace of what maps the true parameters to the estimated ones.
        let information = matrix.transpose() * matrix;
        let mut with_prior = information;
        for (index, weight) in prior.into_iter().enumerate() {
            with_prior[(index, index)] += weight * weight;
        }
        let expected = (with_prior.try_inverse().unwrap() * information).trace();
        assert!((found - expected).abs() < 1e-11, "{found} {expected}");
    }
}

#[test]
fn a_parameter_without_any_influence_makes_the_condition_infinite() {
    let diagonal = |entry: f64| {
        let mut values = [2.0; 8];
        values[3] = entry;
        Identifiability::of(&Normal::from_diagonal(&values, &[1.0; 8]))
    };
    // Orthogonal columns of any length.
    let orthogonal = diagonal(0.5);
    assert!((orthogonal.condition - 1.0).abs() < 1e-15);
    let singular = diagonal(0.0);
    assert!(singular.condition.is_infinite());
    let direction = singular.weakest_direction();
    assert!(direction.iter().all(|part| part.abs() < 1e-30));
}

/// The second column is the first: exactly singular, with no column that is zero.
#[test]
fn equal_columns_make_the_condition_infinite() {
    let mut normal = Normal::<f64>::zero();
    for row in 0..8 {
        let mut block = [[0.0]; 9];
        block[row] = [1.0];
        if row == 0 {
            block[1] = [1.0];
        }
        if row != 1 {
            normal.absorb(&mut block);
        }
    }
    assert!(Identifiability::of(&normal).condition.is_infinite());
}
