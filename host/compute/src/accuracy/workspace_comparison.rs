//! What a calibration means for positions all over the workspace, not only where it was measured.

use crate::accuracy::evaluation::differences;
use crate::accuracy::improvement::Change;
use crate::accuracy::information::units;
use crate::accuracy::position_uncertainty::PositionUncertainty;
use crate::accuracy::rigid_motion::RigidMotions;
use crate::accuracy::workspace_poses::inside;
use crate::fit::options::{CalibrationMethod, Frame, Options};
use crate::fit::outcome::Outcome;
use crate::geometry::reach::Reach;
use delta_cal::{Robot, Settings};
use nalgebra::{DMatrix, DVector, SMatrix, Vector3};

/// A change of less than this part of its own uncertainty is none.
const UNCHANGED: f64 = 0.1;
/// An uncertainty below this, in mm, is that of the arithmetic.
const NEGLIGIBLE: f64 = 1e-6;
/// A calibration that is more likely than this to make the robot worse is expected to do so.
const LARGEST_CHANCE: f64 = 0.005;

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
    /// The probability that the rms position error is larger after the calibration than before; with `--frame sensor`
    /// that of the positions relative to each other.
    /// `None` if the noise is neither stated nor known well enough from the residuals.
    pub chance_of_harm: Option<f64>,
}

impl WorkspaceComparison {
    /// `settings` and `options` are those of the fit. `None` if the covariance is not known, or no pose is reached
    /// by both robots.
    pub(crate) fn of(
        before: &Robot<f64>,
        outcome: &Outcome,
        reach: &Reach,
        settings: &Settings<f64>,
        options: &Options,
    ) -> Option<Self> {
        let covariance = outcome.covariance.as_ref()?;
        let after = &outcome.fit.robot;
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
        let noise_freedom = || {
            let arms = outcome.fit.arms.iter().map(|arm| arm.degrees_of_freedom);
            if options.method == CalibrationMethod::Ikm {
                // Each arm has its own estimate.
                arms.fold(f64::INFINITY, f64::min)
            } else {
                arms.sum()
            }
        };
        let dynamic =
            |matrix: SMatrix<f64, 24, 24>| DMatrix::from_column_slice(24, 24, matrix.as_slice());
        let of = |sensitivity: SMatrix<f64, 24, 24>| Change {
            difference: DVector::from_column_slice(differences(after, before).as_slice()),
            covariance: dynamic(covariance.component_mul(&products)),
            sensitivity: dynamic(sensitivity.component_div(&products)),
            has_tolerance: settings.tolerance.is_some(),
            degrees_of_freedom: settings.noise.is_none().then(noise_freedom),
        };
        let change = match options.frame {
            Frame::Base => of(absolute),
            Frame::Sensor => {
                let motions = RigidMotions::of(jacobians.iter().map(|(position, _)| *position))?;
                let explained = motions.explaining(jacobians.iter().copied());
                for (position, jacobian) in &mut jacobians {
                    *jacobian -= motions.at(position) * explained;
                }
                // Besides the six motions the empty places of a tower's parameters.
                let empty = 24 - 3 * before.drive().parameters().len();
                of(mean_square(&jacobians)).without_kernel(6 + empty)
            }
        };
        Some(Self {
            poses,
            change: (change_squared / f64::from(poses)).sqrt(),
            sigma: covariance.component_mul(&absolute).sum().sqrt(),
            chance_of_harm: change.chance_of_harm(),
        })
    }

    /// Whether the calibrated robot may well be further off than the robot was before.
    ///
    /// Not if the calibration leaves the robot where it was, nor for exact samples of a robot that
    /// is exact already.
    pub fn may_be_worse(&self) -> bool {
        !self.unchanged()
            && self.sigma > NEGLIGIBLE
            && self
                .chance_of_harm
                .is_some_and(|chance| chance > LARGEST_CHANCE)
    }

    /// Whether the calibration leaves the robot where it was, as the same samples calibrated again
    /// do.
    pub fn unchanged(&self) -> bool {
        self.change <= UNCHANGED * self.sigma
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
