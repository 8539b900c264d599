//! The benefit of a calibration where the true robot is known: in simulation.
//!
//! Parameters of different kinds are compared in mm: angles are multiplied by the true upper arm's length.

use super::information::{ARM, PARAMETERS, is_empty, units, whitening};
use super::rigid_motion::RigidMotions;
use super::uncertainty::jacobian;
use crate::fit::{Method, closure};
use delta_cal::calibration::{JointNormal, Prior, TolerancePrior};
use delta_cal::{ArmIndex, Noise, Parameter, Robot, Sample, Tolerance};
use nalgebra::{DMatrix, SMatrix, SVector, Vector3};

/// The true robot, the robot of the file and the calibrated one.
#[derive(Debug, Clone, Copy)]
pub struct Evaluation<'a> {
    /// Pr: the true robot, which was measured.
    pub truth: &'a Robot<f64>,
    /// Pn: the robot before calibration.
    pub before: &'a Robot<f64>,
    /// Pc: the calibrated robot.
    pub after: &'a Robot<f64>,
}

/// Error of the positions computed with a robot's geometry, over points that were not measured, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldOutError {
    /// Root mean square; NaN if the geometry reaches none of the points.
    pub rms: f64,
    /// Maximum; NaN if the geometry reaches none of the points.
    pub max: f64,
    /// Root mean square after removal of the best-fitting rigid motion; NaN also with fewer than three points.
    pub intrinsic_rms: f64,
    /// Number of points that the geometry does not reach; the other figures exclude them.
    pub unreachable: usize,
}

impl Evaluation<'_> {
    /// Gain G = 100 (‖Pr − Pn‖ − ‖Pr − Pc‖) / ‖Pr − Pn‖, percent (4.1). NaN if Pn = Pr.
    pub fn gain(&self) -> f64 {
        let (before, after) = (self.error_before(), self.error_after());
        100.0 * ((before - after) / before)
    }

    /// ‖Pr − Pn‖, mm.
    pub fn error_before(&self) -> f64 {
        differences(self.before, self.truth).norm()
    }

    /// ‖Pr − Pc‖, mm.
    pub fn error_after(&self) -> f64 {
        differences(self.after, self.truth).norm()
    }

    /// The position error before calibration, at joint angles (radians) that the true robot can reach.
    pub fn position_error_before(&self, joints: &[[f64; 3]]) -> HeldOutError {
        position_error(self.truth, self.before, joints)
    }

    /// The position error after calibration.
    pub fn position_error_after(&self, joints: &[[f64; 3]]) -> HeldOutError {
        position_error(self.truth, self.after, joints)
    }
}

/// All 24 parameter differences, a − truth: mm, with angles times the true upper arm's length.
pub fn differences(a: &Robot<f64>, truth: &Robot<f64>) -> SVector<f64, PARAMETERS> {
    let units = units(truth);
    let truth_drive = truth.drive();
    let mut differences = SVector::zeros();
    for (arm, (a, truth)) in a.arms().iter().zip(truth.arms()).enumerate() {
        for parameter in truth_drive.parameters().iter().copied() {
            let mut difference = a.get(parameter) - truth.get(parameter);
            if parameter == Parameter::Theta {
                // 359° and −1° are the same azimuth.
                let turn = std::f64::consts::TAU;
                difference -= (difference / turn).round() * turn;
            }
            let index = 8 * arm + parameter.index();
            differences[index] = difference * units[index];
        }
    }
    differences
}

fn position_error(truth: &Robot<f64>, robot: &Robot<f64>, joints: &[[f64; 3]]) -> HeldOutError {
    let mut errors = Vec::with_capacity(joints.len());
    for q in joints {
        if let (Ok(is), Ok(said)) = (truth.forward(q), robot.forward(q)) {
            errors.push((is, said - is));
        }
    }
    let count = errors.iter().fold(0.0, |count, _| count + 1.0);
    let rms = |squares: f64| f64::sqrt(squares / count);
    let lengths = errors.iter().map(|(_, error)| error.norm());
    let intrinsic =
        RigidMotions::of(errors.iter().map(|(point, _)| *point)).map_or(f64::NAN, |motions| {
            let left = motions.removed(&errors);
            left.iter().map(Vector3::norm_squared).sum()
        });
    HeldOutError {
        rms: rms(lengths.clone().map(|length| length * length).sum()),
        max: lengths.fold(f64::NAN, f64::max),
        intrinsic_rms: rms(intrinsic),
        unreachable: joints.len() - errors.len(),
    }
}

/// The Cramér–Rao bound: the smallest covariance of unbiased parameter estimates, the inverse of the residuals'
/// information at the true robot.
#[derive(Debug, Clone, PartialEq)]
pub struct CramerRaoBound {
    /// All parameters, arm by arm: mm², angles times the upper arm's length.
    pub covariance: SMatrix<f64, PARAMETERS, PARAMETERS>,
}

impl CramerRaoBound {
    /// The bound of a method for measurements of `truth` at these joint angles (radians).
    ///
    /// The IKM method uses the variance of each arm's closure error but not its correlation with the other arms, so its
    /// information is that of three separate arms. The other methods' residuals carry the full information of the
    /// measurements. A tolerance adds the information of the prior; the bound then holds for the mean over robots drawn
    /// from it (van Trees).
    ///
    /// `None` if the poses do not determine the robot, or the true robot does not reach one of them or is singular
    /// there.
    pub fn new(
        method: Method,
        truth: &Robot<f64>,
        joints: &[[f64; 3]],
        noise: &Noise<f64>,
        tolerance: Option<&Tolerance<f64>>,
    ) -> Option<Self> {
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
        }
        let rows = DMatrix::from_fn(rows.len(), PARAMETERS, |row, column| rows[row][column]);
        let triangle = rows
            .qr()
            .r()
            .fixed_view::<PARAMETERS, PARAMETERS>(0, 0)
            .into_owned();
        let inverse =
            triangle.solve_upper_triangular(&SMatrix::<f64, PARAMETERS, PARAMETERS>::identity())?;
        let mut covariance = inverse * inverse.transpose();
        for place in (0..PARAMETERS).filter(|place| is_empty(truth, *place)) {
            covariance[(place, place)] = 0.0;
        }
        let finite = covariance.iter().all(|entry| entry.is_finite());
        finite.then_some(Self { covariance })
    }

    /// √ of the trace, mm: the lower bound of the rms of ‖Pr − Pc‖.
    pub fn error(&self) -> f64 {
        self.covariance.trace().sqrt()
    }
}

/// A row g of the information Σ gᵀg, each parameter in its unit.
type Row = SVector<f64, PARAMETERS>;

/// The rows U of the tolerance's information, |U δ|².
fn rows_of_prior(truth: &Robot<f64>, tolerance: Option<&Tolerance<f64>>) -> Vec<Row> {
    let units = units(truth).map(f64::recip).into();
    let prior = TolerancePrior::new(truth.arms().each_ref(), &units, tolerance);
    let triangle: JointNormal<f64> = prior.rows(1.0, &[0.0; PARAMETERS]);
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
        let (gradient, _) = closure(truth.arm(index), pose, index.index(), noise);
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
    let rows = whitening * jacobian::<PARAMETERS>(truth, &pose.position, &pose.joints)?;
    let each = rows.row_iter().map(|row| row.transpose());
    Some(each.map(|row| row.component_div(&units)).collect())
}
