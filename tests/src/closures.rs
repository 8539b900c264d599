//! The distances of one arm as a dense matrix, from their definition: what the factors hold in triangular form.

use delta_cal::robot::Arm;
use delta_cal::{ArmIndex, Robot, Sample};
use nalgebra::{DVector, Dyn, OMatrix, SMatrix, U8};

/// One row per sample: ∂d/∂P of one arm.
pub type Jacobian = OMatrix<f64, Dyn, U8>;

/// d = f/(2 Lb) of an arm, the distance along the forearm of the robot before calibration, and ∂d/∂P.
pub fn distances(
    nominal: &Robot<f64>,
    index: ArmIndex,
    arm: &Arm<f64>,
    samples: &[Sample<f64>],
) -> (DVector<f64>, Jacobian) {
    let unit = 2.0 * nominal.arm(index).lb();
    let mut distances = DVector::zeros(samples.len());
    let mut jacobian = Jacobian::zeros(samples.len());
    for (k, sample) in samples.iter().enumerate() {
        let q = sample.joints[index.index()];
        distances[k] = arm.constraint(&sample.position, q) / unit;
        let row = arm.constraint_by_parameters(&sample.position, q) / unit;
        jacobian.set_row(k, &row.transpose());
    }
    (distances, jacobian)
}

/// Inverts an information matrix of lengths and angles; scaled first, since they differ by a factor of some hundred.
pub fn inverse_of(information: &SMatrix<f64, 24, 24>) -> Option<SMatrix<f64, 24, 24>> {
    let scale = information.map_diagonal(|entry| entry.sqrt().recip());
    let scale = SMatrix::<f64, 24, 24>::from_diagonal(&scale);
    let inverse = (scale * information * scale).try_inverse()?;
    Some(scale * inverse * scale)
}
