//! How good a calibration can be where the true robot is known.

use crate::accuracy::information::{ARM, PARAMETERS, is_empty, units};
use crate::accuracy::uncertainty::jacobian;
use crate::files::Tool;
use crate::fit::{Closure, Method};
use crate::halt;
use delta_cal::calibration::{TolerancePrior, Triangle};
use delta_cal::{ArmIndex, Noise, Robot, Sample, Tolerance};
use nalgebra::{DMatrix, Matrix3, SMatrix, SVector, Vector3};

/// The Cramér–Rao bound on the rms parameter error, mm, with angles times the upper arm's length: √ of the trace of the
/// inverse information at the true robot, measured by a method at these joint angles (radians).
///
/// The IKM method uses the variance of each arm's closure error but not its correlation with the other arms, so its
/// information is that of three separate arms. The other methods' residuals carry the full information of the
/// measurements. A tolerance adds the information of the prior; the bound then holds for the mean over robots drawn
/// from it (van Trees).
///
/// `None` if the poses do not determine the robot, or the true robot does not reach one of them or is singular there.
pub(super) fn bound(
    method: Method,
    truth: &Robot<f64>,
    joints: &[[f64; 3]],
    noise: &Noise<f64>,
    tolerance: Option<&Tolerance<f64>>,
) -> Option<f64> {
    let mut rows = rows_of_prior(truth, tolerance);
    for q in joints {
        let position = truth.forward(q).ok()?;
        let pose = Sample {
            joints: *q,
            position,
        };
        rows.extend(match method {
            Method::Ikm => closure_rows(truth, &pose, noise),
            Method::Joint | Method::Fkm => position_rows(truth, &pose, noise)?,
        });
        if rows.len() > AT_ONCE {
            halt::check();
            let sum = triangle(&rows);
            rows = sum.row_iter().map(|row| row.transpose()).collect();
        }
    }
    let triangle = triangle(&rows);
    let inverse =
        triangle.solve_upper_triangular(&SMatrix::<f64, PARAMETERS, PARAMETERS>::identity())?;
    let mut covariance = inverse * inverse.transpose();
    for place in (0..PARAMETERS).filter(|place| is_empty(truth, *place)) {
        covariance[(place, place)] = 0.0;
    }
    let error = covariance.trace().sqrt();
    error.is_finite().then_some(error)
}

/// A row g of the information Σ gᵀg, each parameter in its unit.
type Row = SVector<f64, PARAMETERS>;

/// Rows that are reduced together.
const AT_ONCE: usize = 10_000;

/// R of rows, with the same information.
fn triangle(rows: &[Row]) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
    let rows = DMatrix::from_fn(rows.len(), PARAMETERS, |row, column| rows[row][column]);
    rows.qr()
        .r()
        .fixed_view::<PARAMETERS, PARAMETERS>(0, 0)
        .into_owned()
}

/// The rows U of the tolerance's information, |U δ|².
fn rows_of_prior(truth: &Robot<f64>, tolerance: Option<&Tolerance<f64>>) -> Vec<Row> {
    let units = units(truth).map(f64::recip).into();
    let prior = TolerancePrior::new(truth.arms().each_ref(), &units, tolerance);
    let triangle: Triangle<f64, PARAMETERS> = prior.rows(1.0, &[0.0; PARAMETERS]);
    let rows = triangle.rows().take(PARAMETERS).enumerate();
    rows.map(|(first, row)| {
        let entry = |column: usize| row.get(column.checked_sub(first)?).copied();
        Row::from_fn(|column, _| entry(column).unwrap_or(0.0))
    })
    .collect()
}

/// IKM: one row per arm, (∂f/∂P)/σf.
fn closure_rows(truth: &Robot<f64>, pose: &Sample<f64>, noise: &Noise<f64>) -> Vec<Row> {
    let units = units(truth);
    let of_arm = |index: ArmIndex| {
        let gradient = Closure::of(truth, pose, index, noise).by_parameters;
        let mut row = Row::zeros();
        row.fixed_rows_mut::<ARM>(ARM * index.index())
            .copy_from(&gradient);
        row.component_div(&units)
    };
    ArmIndex::ALL.map(of_arm).to_vec()
}

/// Other methods: three rows per pose, L⁻¹ ∂X/∂P. `None` at a singular pose.
fn position_rows(truth: &Robot<f64>, pose: &Sample<f64>, noise: &Noise<f64>) -> Option<Vec<Row>> {
    let (units, whitening) = (units(truth), whitening(truth, pose, noise)?);
    let rows =
        whitening * jacobian::<PARAMETERS>(truth, &Tool::default(), &pose.position, &pose.joints)?;
    let each = rows.row_iter().map(|row| row.transpose());
    Some(each.map(|row| row.component_div(&units)).collect())
}

/// L⁻¹ of the position covariance L Lᵀ = σx² I + σq² J_q J_qᵀ at a pose of the robot. `None` at a singular pose.
fn whitening(robot: &Robot<f64>, pose: &Sample<f64>, noise: &Noise<f64>) -> Option<Matrix3<f64>> {
    let by_joints = robot
        .platform_jacobian(&pose.position, &pose.joints)
        .ok()?
        .by_joints
        * noise.joint();
    let axes = Vector3::from(noise.position_by_axis());
    let covariance =
        Matrix3::from_diagonal(&axes.component_mul(&axes)) + by_joints * by_joints.transpose();
    covariance.cholesky()?.l().try_inverse()
}
