//! Conversions between messages and the core's types, shared by the controller and whoever checks its results.

use crate::messages::{ArmReport, Begin, Fault};
use delta_cal::calibration::ArmOutcome;
use delta_cal::robot::Transmission;
use delta_cal::stream::{Forgetting, Selection};
use delta_cal::{ArmIndex, Noise, Real, Settings, Tolerance};

impl<T: Real> Begin<T> {
    /// The settings and selection of the session's [`StreamCalibrator`](delta_cal::stream::StreamCalibrator), which is
    /// large and best constructed in place.
    ///
    /// # Errors
    /// [`Fault::Settings`] if they are invalid.
    pub fn calibrator(&self) -> Result<(Settings<T>, Selection<T>), Fault> {
        if self.session == 0 {
            return Err(Fault::Settings);
        }
        Ok((self.settings()?, self.selection()?))
    }

    fn settings(&self) -> Result<Settings<T>, Fault> {
        let tolerance = match (self.tolerance, self.joint_zero) {
            (None, None) => None,
            (Some((length, angle)), None) => Some(Tolerance::new(length, angle)),
            (Some((length, angle)), Some(zero)) => {
                Some(Tolerance::new(length, angle).and_then(|own| own.with_joint_zero(zero)))
            }
            (None, Some(_)) => return Err(Fault::Settings),
        };
        let tolerance = tolerance.transpose().map_err(|_| Fault::Settings)?;
        let noise = self
            .noise
            .map(|(position, joint)| Noise::by_axis(position, joint))
            .transpose()
            .map_err(|_| Fault::Settings)?;
        Ok(Settings::default()
            .with_noise(noise)
            .with_tolerance(tolerance))
    }

    fn selection(&self) -> Result<Selection<T>, Fault> {
        let forgetting = self
            .forgetting
            .map(Forgetting::new)
            .transpose()
            .map_err(|_| Fault::Settings)?;
        Ok(if self.gate {
            Selection::Gated { forgetting }
        } else {
            Selection::All { forgetting }
        })
    }
}

impl<T: Real> ArmReport<T> {
    /// The report of one arm's outcome.
    pub fn new(arm: ArmIndex, outcome: &ArmOutcome<T>) -> Self {
        let [prior_share] = outcome.prior_share.data.0;
        let sigma = outcome.covariance.map(|covariance| {
            let [variances] = covariance.diagonal().data.0;
            variances.map(Real::square_root)
        });
        Self {
            arm,
            parameters: outcome.arm.parameters(),
            transmission: outcome.arm.transmission().map(Transmission::numbers),
            sigma,
            residual_rms: outcome.residual_rms,
            estimated_noise: outcome.estimated_noise,
            degrees_of_freedom: outcome.degrees_of_freedom,
            samples: outcome.samples,
            iterations: outcome.iterations,
            termination: outcome.termination,
            start: outcome.start,
            condition: outcome.condition,
            prior_share,
        }
    }
}
