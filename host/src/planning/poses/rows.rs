//! What each pose adds to the information, in blocks of parameters that no row couples.

use crate::accuracy::information::{ARM, PARAMETERS, closure_rows, position_rows};
use delta_cal::{Noise, Robot, Sample};
use nalgebra::SMatrix;

/// `R` rows of each of `B` blocks of `D` parameters: one row of three blocks of eight for the IKM
/// method, three rows of one block of 24 for the FKM method.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rows<const B: usize, const D: usize, const R: usize> {
    /// Transposed: a row is a column here.
    pub(super) blocks: [SMatrix<f64, D, R>; B],
}

/// The rows of a method's residuals.
pub(super) trait Model<const B: usize, const D: usize, const R: usize> {
    /// `None` where the pose says nothing.
    fn rows(robot: &Robot<f64>, pose: &Sample<f64>, noise: &Noise<f64>) -> Option<Rows<B, D, R>>;
}

/// Each arm by itself.
pub(super) struct Ikm;
/// All arms at once.
pub(super) struct Fkm;

impl Model<3, ARM, 1> for Ikm {
    fn rows(robot: &Robot<f64>, pose: &Sample<f64>, noise: &Noise<f64>) -> Option<Rows<3, ARM, 1>> {
        Some(Rows {
            blocks: closure_rows(robot, pose, noise),
        })
    }
}

impl Model<1, PARAMETERS, 3> for Fkm {
    fn rows(
        robot: &Robot<f64>,
        pose: &Sample<f64>,
        noise: &Noise<f64>,
    ) -> Option<Rows<1, PARAMETERS, 3>> {
        Some(Rows {
            blocks: [position_rows(robot, pose, noise)?.transpose()],
        })
    }
}
