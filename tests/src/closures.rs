//! The closure errors of a sample's three arms and their covariance, and the distances of one arm, densely and by their
//! definitions: what the factors hold in triangles.

use delta_cal::robot::Arm;
use delta_cal::{ArmIndex, Noise, Robot, Sample};
use nalgebra::{DVector, Dyn, Matrix3, OMatrix, SMatrix, U8, Vector3};

/// The nominal forearms' directions may be off by so much: the part of a closure's variance that the arms do
/// not share is at least that of such an angle. Radians.
const DIRECTION: f64 = 0.01;

/// f₁, f₂, f₃: mm².
pub fn closures(robot: &Robot<f64>, sample: &Sample<f64>) -> Vector3<f64> {
    Vector3::from(ArmIndex::ALL.map(|arm| {
        robot
            .arm(arm)
            .constraint(&sample.position, sample.joints[arm.index()])
    }))
}

/// ∂f/∂P: mm²/mm, mm²/rad.
pub fn by_parameters(robot: &Robot<f64>, sample: &Sample<f64>) -> SMatrix<f64, 3, 24> {
    let mut jacobian = SMatrix::<f64, 3, 24>::zeros();
    for arm in ArmIndex::ALL {
        let q = sample.joints[arm.index()];
        let row = robot.arm(arm).constraint_by_parameters(&sample.position, q);
        for (column, entry) in row.iter().enumerate() {
            jacobian[(arm.index(), 8 * arm.index() + column)] = *entry;
        }
    }
    jacobian
}

/// A row for each sample: ∂d/∂P of one arm.
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

/// cov(f) at the robot before calibration, in mm⁴:
///
/// ```text
/// 4 (X − Bᵢ)ᵀ Σx (X − Bⱼ) + δᵢⱼ ((∂fᵢ/∂qᵢ)² σq² + (2 Lbᵢ)² tr Σx/3 · 0.01²)
/// ```
pub fn covariance(nominal: &Robot<f64>, sample: &Sample<f64>, noise: &Noise<f64>) -> Matrix3<f64> {
    let variances = Vector3::from(noise.position_by_axis()).map(|sigma| sigma * sigma);
    let forearms = ArmIndex::ALL.map(|arm| {
        let (sine, cosine) = sample.joints[arm.index()].sin_cos();
        let arm = nominal.arm(arm);
        sample.position - (arm.d() + arm.basis().u * cosine + arm.basis().v * sine)
    });
    let mut covariance = Matrix3::from_fn(|row, column| {
        4.0 * forearms[row]
            .component_mul(&variances)
            .dot(&forearms[column])
    });
    for index in ArmIndex::ALL {
        let arm = nominal.arm(index);
        let q = sample.joints[index.index()];
        let by_joint = arm.constraint_by_joint(&sample.position, q) * noise.joint();
        let direction = 2.0 * arm.lb() * DIRECTION;
        covariance[(index.index(), index.index())] +=
            by_joint.powi(2) + direction.powi(2) * variances.sum() / 3.0;
    }
    covariance
}

/// The inverse of an information matrix whose parameters are lengths and angles; scaled, since these differ
/// by a factor of some hundred.
pub fn inverse_of(information: &SMatrix<f64, 24, 24>) -> Option<SMatrix<f64, 24, 24>> {
    let scale = information.map_diagonal(|entry| entry.sqrt().recip());
    let scale = SMatrix::<f64, 24, 24>::from_diagonal(&scale);
    let inverse = (scale * information * scale).try_inverse()?;
    Some(scale * inverse * scale)
}
