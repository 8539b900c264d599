//! How uncertain the platform's position is where the parameters are: J C Jᵀ, anywhere.

use crate::fit::covariance::{PARAMETERS, WITH_TRANSMISSIONS};
use delta_cal::{Robot, Sample};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// A robot and the covariance of its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionUncertainty<'a, const P: usize = 24> {
    /// The robot.
    pub robot: &'a Robot<f64>,
    /// Of all 24 parameters, arm by arm: mm, radians and their products. With P = 39 of the numbers of the
    /// transmissions as well.
    pub covariance: &'a SMatrix<f64, P, P>,
}

impl<const P: usize> PositionUncertainty<'_, P> {
    /// Covariance of the position, mm², at a pose (`x`, `q`) of the robot: J C Jᵀ with J = ∂X/∂P
    /// (3.18). `None` at a singular pose.
    pub fn covariance(&self, x: &Vector3<f64>, q: &[f64; 3]) -> Option<Matrix3<f64>> {
        let jacobian = self.jacobian(x, q)?;
        Some(jacobian * (self.covariance * jacobian.transpose()))
    }

    /// J = ∂X/∂P (3.18), the arms side by side, before the transmissions. `None` at a singular pose.
    pub(crate) fn jacobian(&self, x: &Vector3<f64>, q: &[f64; 3]) -> Option<SMatrix<f64, 3, P>> {
        let blocks = self.robot.platform_jacobian(x, q).ok()?.by_parameters;
        let mut jacobian = SMatrix::<f64, 3, P>::zeros();
        for (arm, block) in blocks.iter().enumerate() {
            jacobian.fixed_columns_mut::<8>(8 * arm).copy_from(block);
        }
        if P == WITH_TRANSMISSIONS {
            let by_transmissions = self.robot.by_transmissions(x, q).ok()?;
            jacobian
                .columns_mut(PARAMETERS, WITH_TRANSMISSIONS - PARAMETERS)
                .copy_from(&by_transmissions);
        }
        Some(jacobian)
    }

    /// σ of the position, mm: √tr(J C Jᵀ), the rms length of its error.
    pub fn sigma(&self, x: &Vector3<f64>, q: &[f64; 3]) -> Option<f64> {
        let variance = self.covariance(x, q)?.trace();
        (variance >= 0.0).then(|| variance.sqrt())
    }

    /// Over many poses at once; poses where it is not known are left out.
    pub fn over<'p>(
        &self,
        poses: impl IntoIterator<Item = &'p Sample<f64>>,
    ) -> Option<PositionSigma> {
        let (mut squares, mut count) = (0.0, 0_u32);
        let mut worst: Option<(f64, Vector3<f64>)> = None;
        for pose in poses {
            let Some(sigma) = self.sigma(&pose.position, &pose.joints) else {
                continue;
            };
            squares += sigma * sigma;
            count += 1;
            if worst.is_none_or(|(largest, _)| sigma > largest) {
                worst = Some((sigma, pose.position));
            }
        }
        worst.map(|(max, max_at)| PositionSigma {
            rms: (squares / f64::from(count)).sqrt(),
            max,
            max_at,
            poses: count,
        })
    }
}

/// σ of the position over many poses, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionSigma {
    /// √ of the mean square.
    pub rms: f64,
    /// The largest.
    pub max: f64,
    /// Where that is.
    pub max_at: Vector3<f64>,
    /// How many poses.
    pub poses: u32,
}
