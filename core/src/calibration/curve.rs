//! A one-parameter problem with arbitrary residual functions, for tests.

use super::problem::{Piece, Problem};
use crate::robot::Drive;
use crate::samples::Triangle;
use core::cell::Cell;

/// Two residuals, and the properties of the problem.
#[derive(Debug, Clone)]
pub(super) struct Curve {
    /// The residuals and their slopes.
    pub(super) residuals: fn(f64) -> [(f64, f64); 2],
    /// The free start, if any.
    pub(super) free_start: Option<f64>,
    /// How often it was requested.
    pub(super) asked: Cell<u32>,
    pub(super) least_sum_of_squares: f64,
    pub(super) rows_squared: f64,
    pub(super) samples: u32,
    pub(super) noise_stated: bool,
}

impl Curve {
    /// r = (p, 0) for twenty samples with unknown noise.
    pub(super) fn straight() -> Self {
        Self {
            residuals: |p| [(p, 1.0), (0.0, 0.0)],
            free_start: None,
            asked: Cell::new(0),
            least_sum_of_squares: 0.0,
            rows_squared: 1.0,
            samples: 20,
            noise_stated: false,
        }
    }
}

impl Problem<f64, 1, 2, 3> for Curve {
    type At = f64;
    const PIECEWISE: bool = true;
    const RESIDUALS: u8 = 3;
    const FREE_STARTS: u8 = 1;

    fn displaced(&self, correction: &[f64; 1]) -> f64 {
        correction[0]
    }

    fn sum_of_squares(&self, at: &f64, _: usize) -> Piece<f64> {
        let [(one, _), (other, _)] = (self.residuals)(*at);
        Piece {
            sum_of_squares: one * one + other * other,
            more: false,
        }
    }

    fn linearize(&self, at: &f64, normal: &mut Triangle<f64, 2, 3>, piece: usize) -> Piece<f64> {
        for (residual, slope) in (self.residuals)(*at) {
            normal.absorb(&mut [[slope], [residual]]);
        }
        self.sum_of_squares(at, piece)
    }

    fn free_start(&self, _: u8) -> Option<[f64; 1]> {
        self.asked.set(self.asked.get() + 1);
        self.free_start.map(|start| [start])
    }

    fn least_sum_of_squares(&self) -> f64 {
        self.least_sum_of_squares
    }

    fn rows_squared(&self) -> f64 {
        self.rows_squared
    }

    fn terms_squared(&self) -> f64 {
        1.0
    }

    fn samples(&self) -> u64 {
        u64::from(self.samples)
    }

    fn effective_samples(&self) -> f64 {
        f64::from(self.samples)
    }

    fn noise_stated(&self) -> bool {
        self.noise_stated
    }

    fn unit(&self) -> f64 {
        1.0
    }

    fn unit_of(&self, _: usize) -> f64 {
        1.0
    }

    fn upper_arm(&self, _: usize) -> f64 {
        1.0
    }

    fn drive(&self) -> Drive {
        Drive::Rotary
    }
}
