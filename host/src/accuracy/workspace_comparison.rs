//! What a calibration means for positions all over the workspace, not only where it was measured.

use crate::accuracy::evaluation::differences;
use crate::accuracy::improvement::Change;
use crate::accuracy::information::{prior_covariance, units};
use crate::accuracy::position_uncertainty::PositionUncertainty;
use crate::accuracy::rigid_motion::RigidMotions;
use crate::accuracy::workspace_poses::inside;
use crate::geometry::reach::Reach;
use delta_cal::{Robot, Tolerance};
use nalgebra::{DMatrix, DVector, SMatrix, Vector3};
use serde::Serialize;

/// A change of less than this part of what noise alone makes it scatter is none.
const UNCHANGED: f64 = 0.3;
/// An uncertainty below this part of the forearms is less than any instrument resolves: 2 µm of 480 mm.
const NEGLIGIBLE: f64 = 5e-6;
/// A calibration that is more likely than this to make the robot worse is doubtful.
const DOUBTFUL: f64 = 0.005;
/// With a stated tolerance, one that is more likely than this to do so is refused. Without one every doubtful
/// one is: the probability is then somewhat too small (docs/accuracy.md).
const HARMFUL: f64 = 0.05;

/// Positions before and after a calibration, over the workspace.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Moved {
    /// rms distance, mm.
    #[serde(rename = "change_mm")]
    pub change: f64,
    /// rms standard deviation after the calibration, mm.
    #[serde(rename = "sigma_mm")]
    pub sigma: f64,
    /// rms standard deviation of the change that the samples' noise alone makes, mm.
    #[serde(skip)]
    pub scatter: f64,
}

/// How far the calibration moves the platform over poses evenly spread in joint space
/// ([`inside`](crate::accuracy::workspace_poses::WorkspacePoses::inside)), and how uncertain the
/// calibrated positions are there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkspaceComparison {
    /// Poses that both robots reach.
    pub poses: u32,
    /// rms distance between the calibrated and the original robot's positions, mm.
    pub change: f64,
    /// rms standard deviation of the calibrated positions, mm: √ of the mean of tr(J C Jᵀ) over all
    /// poses that the calibrated robot reaches.
    pub sigma: f64,
    /// `change` and `sigma`; with `--frame sensor` those of the positions relative to each other.
    pub judged: Moved,
    /// A `judged.sigma` up to this does not count, mm.
    pub negligible: f64,
    /// The probability that the rms position error is larger after the calibration than before; with `--frame sensor`
    /// that of the positions relative to each other.
    /// `None` if the noise is neither stated nor known well enough from the residuals.
    pub chance_of_harm: Option<f64>,
}

/// A robot before and after a calibration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Calibrated<'a> {
    pub(crate) before: &'a Robot<f64>,
    pub(crate) after: &'a Robot<f64>,
    /// Of the parameters, mm and radians.
    pub(crate) covariance: &'a SMatrix<f64, 24, 24>,
    /// The stated one.
    pub(crate) tolerance: Option<&'a Tolerance<f64>>,
    /// Of an estimated noise; `None` if it is stated.
    pub(crate) degrees_of_freedom: Option<f64>,
    /// What of the positions counts.
    pub(crate) judged: Judged,
}

/// What of the positions decides whether a robot becomes better.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Judged {
    /// The positions in the frame of the base, over the workspace.
    Absolute,
    /// The positions after the best rigid motion, over the workspace.
    Relative,
}

impl WorkspaceComparison {
    /// `None` if no pose is reached by both robots.
    pub(crate) fn of(calibrated: &Calibrated<'_>, reach: &Reach) -> Option<Self> {
        let &Calibrated {
            before,
            after,
            covariance,
            ..
        } = calibrated;
        let uncertainty = PositionUncertainty {
            robot: after,
            covariance,
        };
        let mut poses = 0;
        let mut change_squared = 0.0;
        let mut jacobians = Vec::new();
        for pose in inside(after, reach) {
            let Some(jacobian) = uncertainty.jacobian(&pose.position, &pose.joints) else {
                continue;
            };
            jacobians.push((pose.position, jacobian));
            if let Ok(from) = before.forward(&pose.joints) {
                poses += 1;
                change_squared += (pose.position - from).norm_squared();
            }
        }
        if poses == 0 {
            return None;
        }
        let absolute = mean_square(&jacobians);
        let units = units(before);
        let products = units * units.transpose();
        let dynamic =
            |matrix: SMatrix<f64, 24, 24>| DMatrix::from_column_slice(24, 24, matrix.as_slice());
        let of = |sensitivity: SMatrix<f64, 24, 24>| Change {
            difference: DVector::from_column_slice(differences(after, before).as_slice()),
            covariance: dynamic(covariance.component_mul(&products)),
            sensitivity: dynamic(sensitivity.component_div(&products)),
            prior: calibrated.tolerance.map(|tolerance| {
                dynamic(prior_covariance(before, tolerance).component_mul(&products))
            }),
            degrees_of_freedom: calibrated.degrees_of_freedom,
        };
        let whole_change = (change_squared / f64::from(poses)).sqrt();
        let whole_sigma = covariance.component_mul(&absolute).sum().sqrt();
        let relative = calibrated.judged == Judged::Relative;
        let (size, change) = if relative {
            let motions = RigidMotions::of(jacobians.iter().map(|(position, _)| *position))?;
            let explained = motions.explaining(jacobians.iter().copied());
            for (position, jacobian) in &mut jacobians {
                *jacobian -= motions.at(position) * explained;
            }
            // Besides the six motions the empty places of a tower's parameters.
            let empty = 24 - 3 * before.drive().parameters().len();
            let change = of(mean_square(&jacobians)).without_kernel(6 + empty);
            (change.size(), change)
        } else {
            (whole_change, of(absolute))
        };
        let judged = Moved {
            change: size,
            sigma: change.sigma(),
            scatter: change.scatter(),
        };
        Some(Self {
            poses,
            change: whole_change,
            sigma: whole_sigma,
            judged,
            negligible: NEGLIGIBLE
                * after
                    .arms()
                    .iter()
                    .fold(0.0, |most: f64, arm| most.max(arm.lb())),
            chance_of_harm: change.chance_of_harm(),
        })
    }

    /// Whether the calibrated robot may well be further off than the robot was before.
    ///
    /// Not if the calibration leaves the robot where it was, nor for exact samples of a robot that
    /// is exact already.
    pub fn may_be_worse(&self) -> bool {
        !self.unchanged()
            && self.judged.sigma > self.negligible
            && self.chance_of_harm.is_some_and(|chance| chance > DOUBTFUL)
    }

    /// Whether that is so likely that the calibration is refused.
    pub(crate) fn is_harmful(&self, has_tolerance: bool) -> bool {
        let likely = self.chance_of_harm.is_some_and(|chance| chance > HARMFUL);
        self.may_be_worse() && (likely || !has_tolerance)
    }

    /// Whether the calibration leaves the robot where it was, as the same samples calibrated again
    /// do.
    pub fn unchanged(&self) -> bool {
        self.judged.change <= UNCHANGED * self.judged.scatter
    }
}

/// The mean of JᵀJ.
fn mean_square(jacobians: &[(Vector3<f64>, SMatrix<f64, 3, 24>)]) -> SMatrix<f64, 24, 24> {
    let (mut sum, mut count) = (SMatrix::<f64, 24, 24>::zeros(), 0.0);
    for (_, jacobian) in jacobians {
        sum.gemm_tr(1.0, jacobian, jacobian, 1.0);
        count += 1.0;
    }
    sum / count
}
