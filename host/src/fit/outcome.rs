//! What a fit returns.

use delta_cal::RobotOutcome;
use delta_cal::calibration::JointOutcome;
use nalgebra::SMatrix;

/// Number of parameters of Model 24.
pub(crate) const PARAMETERS: usize = 24;
/// With the numbers of the transmissions.
pub(crate) const WITH_TRANSMISSIONS: usize = PARAMETERS + 15;

/// Covariance of the parameters, arm by arm, and of the numbers of the transmissions: mm, radians and their
/// products. That of what is known is 0.
pub type RobotCovariance = SMatrix<f64, WITH_TRANSMISSIONS, WITH_TRANSMISSIONS>;

/// Where the transmissions are known.
pub(crate) fn with_exact_transmissions(
    of_parameters: &SMatrix<f64, PARAMETERS, PARAMETERS>,
) -> RobotCovariance {
    let mut covariance = RobotCovariance::zeros();
    covariance
        .fixed_view_mut::<PARAMETERS, PARAMETERS>(0, 0)
        .copy_from(of_parameters);
    covariance
}

/// The part of the parameters alone.
pub(crate) fn of_parameters(covariance: &RobotCovariance) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
    covariance
        .fixed_view::<PARAMETERS, PARAMETERS>(0, 0)
        .into_owned()
}

/// A robot calibrated by either method.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The robot and each arm's share of the result.
    ///
    /// Of the joint and the FKM method residual and noise are the whole robot's, in each coordinate of the
    /// position; an arm's condition is the rms, over its parameters, of how much worse each is known
    /// because the others are not.
    pub fit: RobotOutcome<f64>,
    /// Covariance of all 24 parameters, arm by arm: the arms' covariances are its diagonal blocks.
    /// `None` where theirs are.
    pub covariance: Option<SMatrix<f64, 24, 24>>,
}

impl Outcome {
    /// One σ of the measured position in each coordinate, mm, as the residuals have it: of the arms'
    /// variances the mean, weighted with their degrees of freedom. `None` with a stated noise, or if
    /// no sample is left over.
    pub fn estimated_noise(&self) -> Option<f64> {
        let (mut squares, mut freedom) = (0.0, 0.0);
        for arm in &self.fit.arms {
            if let Some(sigma) = arm.estimated_noise {
                squares += arm.degrees_of_freedom * sigma * sigma;
                freedom += arm.degrees_of_freedom;
            }
        }
        (freedom > 0.0).then(|| (squares / freedom).sqrt())
    }

    /// With every σ of the parameters, and so of the positions, multiplied by a factor.
    pub(crate) fn widened(mut self, factor: f64) -> Self {
        let variance = factor * factor;
        for arm in &mut self.fit.arms {
            arm.covariance = arm.covariance.map(|covariance| covariance * variance);
        }
        self.covariance = self.covariance.map(|covariance| covariance * variance);
        self
    }
}

impl From<JointOutcome<f64>> for Outcome {
    /// Three arms that were estimated together.
    fn from(outcome: JointOutcome<f64>) -> Self {
        Self {
            fit: RobotOutcome::from(&outcome),
            covariance: outcome.estimate.covariance,
        }
    }
}

impl From<RobotOutcome<f64>> for Outcome {
    /// Three arms that know nothing of each other.
    fn from(fit: RobotOutcome<f64>) -> Self {
        let mut covariance = Some(SMatrix::zeros());
        for (arm, outcome) in fit.arms.iter().enumerate() {
            covariance = covariance.zip(outcome.covariance).map(
                |(mut all, own): (SMatrix<f64, 24, 24>, _)| {
                    all.fixed_view_mut::<8, 8>(8 * arm, 8 * arm).copy_from(&own);
                    all
                },
            );
        }
        Self { fit, covariance }
    }
}
