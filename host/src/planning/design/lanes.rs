//! Candidates side by side: the compiler computes with all of them at once.

use super::source::Rows;
use nalgebra::SMatrix;

/// So many.
pub(super) const LANES: usize = 8;

/// The rows V of [`LANES`] candidates: entry by entry those of all, zero where there are fewer.
pub(super) struct Lanes<const B: usize, const D: usize, const R: usize> {
    blocks: [[[[f64; LANES]; D]; R]; B],
}

/// A small matrix of each.
type Each<const R: usize> = [SMatrix<f64, R, R>; LANES];

impl<const B: usize, const D: usize, const R: usize> Lanes<B, D, R> {
    pub(super) fn of(rows: &[Rows<B, D, R>]) -> Vec<Self> {
        rows.chunks(LANES)
            .map(|chunk| {
                let mut blocks = [[[[0.0; LANES]; D]; R]; B];
                for (lane, rows) in chunk.iter().enumerate() {
                    for (block, own) in blocks.iter_mut().zip(&rows.blocks) {
                        for (row, own) in block.iter_mut().zip(own.column_iter()) {
                            for (entry, own) in row.iter_mut().zip(own.iter()) {
                                entry[lane] = *own;
                            }
                        }
                    }
                }
                Self { blocks }
            })
            .collect()
    }

    /// Vᵀ S.
    pub(super) fn times(&self, block: usize, matrix: &SMatrix<f64, D, R>) -> Each<R> {
        let mut products = [SMatrix::zeros(); LANES];
        for (index, row) in self.blocks[block].iter().enumerate() {
            for column in 0..R {
                let mut sums = [0.0; LANES];
                for (inner, entries) in row.iter().enumerate() {
                    add(&mut sums, entries, matrix[(inner, column)]);
                }
                for (product, sum) in products.iter_mut().zip(sums) {
                    product[(index, column)] = sum;
                }
            }
        }
        products
    }

    /// Vᵀ C V, C symmetric.
    pub(super) fn between(&self, block: usize, matrix: &SMatrix<f64, D, D>) -> Each<R> {
        let mut products = [SMatrix::<f64, R, R>::zeros(); LANES];
        for column in 0..R {
            let right = &self.blocks[block][column];
            for (own, of_column) in matrix.column_iter().enumerate() {
                // Of C V the one entry that this row of C gives.
                let mut sums = [0.0; LANES];
                for (factor, entries) in of_column.iter().zip(right) {
                    add(&mut sums, entries, *factor);
                }
                for (index, left) in self.blocks[block].iter().enumerate() {
                    for lane in 0..LANES {
                        products[lane][(index, column)] += left[own][lane] * sums[lane];
                    }
                }
            }
        }
        products
    }
}

fn add(sums: &mut [f64; LANES], entries: &[f64; LANES], factor: f64) {
    for (sum, entry) in sums.iter_mut().zip(entries) {
        *sum += entry * factor;
    }
}
