#![allow(clippy::unwrap_used)]

use super::Triangle;
use nalgebra::{SMatrix, SVector};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

type Small = Triangle<f64, 5, 15>;

/// Evenly in (−1, 1).
fn uniform(rng: &mut Pcg32) -> f64 {
    f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0
}

/// Random rows as columns of a matrix.
fn rows<const K: usize>(rng: &mut Pcg32) -> [SVector<f64, 5>; K] {
    [(); K].map(|()| SVector::from([(); 5].map(|()| uniform(rng))))
}

fn by_columns<const K: usize>(rows: &[SVector<f64, 5>; K]) -> [[f64; K]; 5] {
    let mut columns = [[0.0; K]; 5];
    for (index, row) in rows.iter().enumerate() {
        for (column, value) in columns.iter_mut().zip(row.iter()) {
            column[index] = *value;
        }
    }
    columns
}

/// Σ row rowᵀ.
fn gram(rows: &[SVector<f64, 5>]) -> SMatrix<f64, 5, 5> {
    let zero = SMatrix::zeros();
    rows.iter()
        .fold(zero, |sum, row| sum + row * row.transpose())
}

fn full(triangle: &Small) -> SMatrix<f64, 5, 5> {
    let mut matrix = SMatrix::zeros();
    for (index, row) in triangle.rows().enumerate() {
        assert_eq!(row.len(), 5 - index);
        assert_eq!(row, triangle.row(index));
        for (offset, value) in row.iter().enumerate() {
            matrix[(index, index + offset)] = *value;
        }
    }
    matrix
}

/// Some ten roundings of numbers of about 10.
const SAME: f64 = 1e-13;

fn same(triangle: &Small, expected: &SMatrix<f64, 5, 5>) -> bool {
    let r = full(triangle);
    (r.transpose() * r - expected).amax() < SAME
}

#[test]
fn rows_of_any_block_size_sum_up() {
    let mut rng = Pcg32::seed_from_u64(1);
    for _ in 0..100 {
        // One at a time, in fours and a remainder, and with zeros behind the last.
        let all = rows::<12>(&mut rng);
        let expected = gram(&all);
        let mut singly = Small::zero();
        for row in &all {
            singly.absorb(&mut by_columns(&[*row]));
        }
        assert!(same(&singly, &expected));
        let mut at_once = Small::zero();
        at_once.absorb(&mut by_columns(&all));
        assert!(same(&at_once, &expected));
        let mut in_parts = Small::zero();
        let [a, b, c, d, e, f, g, h, i, j, k, l] = all;
        in_parts.absorb(&mut by_columns(&[a, b, c, d, e, f, g]));
        in_parts.absorb(&mut by_columns(&[h, i, j, k, l, SVector::zeros()]));
        assert!(same(&in_parts, &expected));
        let mut merged = Small::zero();
        merged.absorb(&mut by_columns(&[a, b, c, d, e]));
        let mut other = Small::zero();
        other.absorb(&mut by_columns(&[f, g, h, i, j, k, l]));
        merged.merge(&other);
        assert!(same(&merged, &expected));
        merged.scale(0.5);
        assert!(same(&merged, &(expected * 0.25)));
    }
}

/// In a long stream the factor's entries are moved by small corrections: the diagonal never changes its
/// sign.
#[test]
fn the_diagonal_keeps_its_signs() {
    let mut rng = Pcg32::seed_from_u64(2);
    for _ in 0..100 {
        let start = rows::<1>(&mut rng)[0];
        let mut triangle = Small::from_diagonal(start.as_slice(), &[0.0, 0.0, 0.0, 0.0, start[4]]);
        for _ in 0..20 {
            let before = full(&triangle).diagonal();
            triangle.absorb(&mut by_columns(&rows::<3>(&mut rng)));
            let after = full(&triangle).diagonal();
            for (before, after) in before.iter().zip(after.iter()) {
                assert!(before * after > 0.0 && after.abs() >= before.abs());
            }
        }
    }
}

#[test]
fn a_block_of_zeros_changes_no_bit() {
    let mut rng = Pcg32::seed_from_u64(3);
    let mut triangle = Small::zero();
    triangle.absorb(&mut by_columns(&rows::<7>(&mut rng)));
    let before = triangle;
    triangle.absorb(&mut [[0.0; 4]; 5]);
    assert_eq!(triangle, before);
}

/// Numbers whose squares underflow are left out rather than divided by.
#[test]
fn what_cannot_be_squared_changes_nothing() {
    let mut triangle = Small::zero();
    triangle.absorb(&mut [[1e-160; 2]; 5]);
    assert_eq!(triangle, Small::zero());
}

#[test]
fn column_norms_are_the_rows_norms() {
    let mut rng = Pcg32::seed_from_u64(4);
    let all = rows::<9>(&mut rng);
    let mut triangle = Small::zero();
    triangle.absorb(&mut by_columns(&all));
    for (norm, squared) in triangle.column_norms().iter().zip(&gram(&all).diagonal()) {
        assert!((norm - squared.sqrt()).abs() < SAME);
    }
}

#[test]
fn the_minimiser_solves_the_normal_equations() {
    let mut rng = Pcg32::seed_from_u64(5);
    for _ in 0..100 {
        let all = rows::<9>(&mut rng);
        let mut triangle = Small::zero();
        triangle.absorb(&mut by_columns(&all));
        let gram = gram(&all);
        let matrix = gram.fixed_view::<4, 4>(0, 0).into_owned();
        let right = gram.fixed_view::<4, 1>(0, 4).into_owned();
        let inverse = matrix.try_inverse().unwrap();
        let expected = -(inverse * right);
        let found: [f64; 4] = triangle.minimiser(&[0.0; 5]).unwrap();
        // The normal equations square a condition of up to some hundreds.
        assert!((SVector::from(found) - expected).norm() < 1e-8 * (1.0 + expected.norm()));

        let (step, gain) = triangle.step_against::<4>(right.into()).unwrap();
        assert!((SVector::from(step) - expected).norm() < 1e-8 * (1.0 + expected.norm()));
        assert!((gain + right.dot(&expected)).abs() < 1e-8 * (1.0 + gain));

        // Products with the leading part and its transpose.
        let leading = full(&triangle).fixed_view::<4, 4>(0, 0).into_owned();
        let beside = full(&triangle).fixed_view::<4, 1>(0, 4).into_owned();
        let residual = SVector::from(triangle.leading_residual::<4>(&step));
        assert!((residual - (leading * SVector::from(step) + beside)).norm() < SAME);
        let back = SVector::from(triangle.leading_transposed::<4>(&residual.into()));
        assert!((back - leading.transpose() * residual).norm() < SAME);

        // The inverse's last columns, two at a time, of every leading part.
        for length in 1..=5 {
            let mut columns = [[0.0; 2]; 5];
            triangle.inverse_columns(&mut columns[..length]);
            for place in 0..2_usize.min(length) {
                let column = columns.map(|entries| entries[1 - place]);
                let product = full(&triangle) * SVector::from(column);
                for (row, value) in product.iter().enumerate().take(length) {
                    let expected = if row + 1 + place == length { 1.0 } else { 0.0 };
                    assert!((value - expected).abs() < 1e-11);
                }
            }
        }
    }
}

#[test]
fn a_pivot_that_is_not_greater_than_the_smallest_determines_nothing() {
    let diagonal = Small::from_diagonal(&[1.0, -2.0, 3.0, 4.0, 5.0], &[3.0, 8.0, 6.0, 4.0, 5.0]);
    let minimiser = |smallest: &[f64; 5]| diagonal.minimiser::<4>(smallest);
    assert_eq!(minimiser(&[0.0; 5]), Some([-3.0, 4.0, -2.0, -1.0]));
    assert_eq!(
        minimiser(&[0.9, 1.9, 2.9, 3.9, 99.0]),
        Some([-3.0, 4.0, -2.0, -1.0])
    );
    assert_eq!(minimiser(&[0.0, 2.0, 0.0, 0.0, 0.0]), None);
    assert_eq!(minimiser(&[0.0, 0.0, 0.0, 4.1, 0.0]), None);
    assert_eq!(minimiser(&[f64::NAN, 0.0, 0.0, 0.0, 0.0]), None);
    assert_eq!(Small::zero().minimiser::<4>(&[0.0; 5]), None);
}

/// Of parameters p₁ … pₖ with pₖ = 1 the others follow such that the rows above the last give zero.
#[test]
fn a_completed_column_leaves_nothing_in_the_rows_above_its_last_entry() {
    let mut rng = Pcg32::seed_from_u64(6);
    for length in 1..=5 {
        let mut triangle = Small::zero();
        triangle.absorb(&mut by_columns(&rows::<9>(&mut rng)));
        let mut column = [0.0; 5];
        column[length - 1] = 1.0;
        triangle.complete_column(&mut column[..length]);
        assert!((column[length - 1] - 1.0).abs() < f64::MIN_POSITIVE);
        let product = full(&triangle) * SVector::from(column);
        assert!(product.rows(0, length - 1).amax() < SAME);
    }
}
