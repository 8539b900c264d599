//! What a robust fit has to say of measurements: why it is refused, and whether it would help.

use super::{CHECK, Circumstances, Refused, SPREAD, lies_elsewhere};
use crate::position_error::distances;
use crate::words::{count, in_lines};
use crate::{CalibrateError, PositionError, calibrate_robust, plausibility};
use delta_cal::{Loss, RobustRefusal};

/// More samples are not fitted again for the sake of a hint.
const MANY: usize = 2000;

impl Circumstances<'_> {
    /// The core's refusal of a robust fit.
    pub(crate) fn explain_robust(&self, refusal: &RobustRefusal) -> CalibrateError {
        match *refusal {
            RobustRefusal::Fit(ref refusal) => self.explain(refusal).into(),
            RobustRefusal::Sample(index, error) => {
                CalibrateError::Input(self.samples.fault(index, error.to_string()))
            }
            RobustRefusal::TooFewSamples { samples, needed } => Refused {
                cause: format!(
                    "{}: {} are too few for a robust fit: half of them must determine an arm's 8 \
                     parameters, so it needs {needed} samples",
                    self.samples.name,
                    count(samples, "sample")
                ),
                remedy: format!("measure more poses and {SPREAD}, or use --loss squared"),
                diagnosis: None,
            }
            .into(),
            RobustRefusal::TooManySuspected { suspected, samples } => self
                .refused(
                    &format!(
                        "{suspected} of {samples} samples disagree with the others: with so many \
                         the program cannot tell which ones are wrong"
                    ),
                    format!(
                        "{CHECK}; check whether the sensor or the robot's base moved during \
                             the measurement"
                    ),
                )
                .into(),
            ref other => self.refused(&other.to_string(), CHECK.to_owned()).into(),
        }
    }

    /// That a robust fit does calibrate the robot, if it does and was not asked for.
    pub(super) fn without_wrong_samples(&self) -> Option<String> {
        if self.options.loss.is_some()
            || self.options.streaming.asked()
            || self.measured.len() > MANY
        {
            return None;
        }
        let nominal = &self.robot.robot;
        let settings = crate::calibrate::settings(self.robot, self.options).ok()?;
        let method = self.options.method;
        let fit = calibrate_robust(nominal, self.measured, &settings, method, Loss::Tukey).ok()?;
        let calibrated = &fit.outcome.robot.robot;
        let fitted = self.samples.rows.iter().zip(&fit.samples);
        let suspected: Vec<_> = fitted
            .filter(|(_, sample)| sample.suspected)
            .map(|(row, _)| row.line)
            .collect();
        let apart = distances(calibrated, self.measured);
        let error = PositionError::of_counted(&apart, &self.samples.rows, &fit.samples);
        let credible = self.robot.tolerance.is_some()
            || self.options.no_guess
            || plausibility::implausible(nominal, calibrated).is_none();
        (!suspected.is_empty() && credible && !lies_elsewhere(calibrated, &error)).then(|| {
            let (does, them) = if suspected.len() == 1 {
                ("does", "it")
            } else {
                ("do", "them")
            };
            format!(
                "{} of {} agree with each other, and {} {does} not: {} calibrates the robot \
                 without {them}",
                self.measured.len() - suspected.len(),
                count(self.measured.len(), "sample"),
                in_lines(&suspected),
                self.robust_fit,
            )
        })
    }
}
